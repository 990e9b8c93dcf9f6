#pragma once

#include <span>

#include "core/contact/solver/layered_medium.hpp"
#include "core/contact/solver/tip_heights.hpp"
#include "core/realtime_tag.hpp"

namespace merkel {

/// Makes coarse pixels at the rims of a tip act as the fine ones that they stand for.
///
/// The tip is pressed into flat skin on finer pixels, to two depths. Of each coarse pixel, the mean
/// pressure p and its moments are known there, and so is the gap e that the coarse pixels leave for
/// it, d − C·p. The line through (p, e) of both depths gives the pixel a height and a compliance;
/// the coarse solution then is the fine one at these depths, and is close to it at others.
/// Leaves the map as it is if it has too many pixels. Real-time: no.
/// \param map  heights of the tip; its rims are filled
/// \param depth_mm  the larger depth
void sharpen_rims(const TipHeight& tip, const LayeredMedium& medium, double depth_mm,
                  HeightMap& map);

/// The pressures of a contact, with those of rims where they act within their pixels: next to them,
/// as much is added on one side as is taken away on the other. Real-time: yes.
void place_loads(const HeightMap& gap, std::span<const double> pressure,
                 std::span<double> loads) noexcept MERKEL_REALTIME;

}  // namespace merkel
