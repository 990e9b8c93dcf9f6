#pragma once

#include "core/contact/indenter.hpp"
#include "core/contact/solver/press_tables.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// The height of an indenter's tip, turned and tilted, infinite beyond its end.
[[nodiscard]] TipHeight height_of(const Indenter& indenter, const SkinParameters& skin);

/// The tip above the finger's apex: its gap, the part of it that can touch, and the depths to
/// solve. Bars on a finger with skin.apex_mm touch as if the finger were straight along.
[[nodiscard]] PressedTip pressed_tip(const Indenter& indenter, const SkinParameters& skin);

/// The heights of a tip within a rectangle around its axis; the lowest is found between samples.
struct HeightRange {
  double lowest_mm = 0.0;
  double highest_mm = 0.0;
};
/// \param pixel_mm  of a measured shape; infinity: not one
[[nodiscard]] HeightRange heights_of(const TipHeight& tip, const Position& half, double pixel_mm);
/// The distance between the heights of a measured shape; infinite for other tips.
[[nodiscard]] double map_pixel_mm(const Indenter& indenter) noexcept;

/// The smallest part of a tip that must be resolved, mm; infinite if it has none.
[[nodiscard]] double feature_of(const Indenter& indenter);

/// Half of the size of a turned tip along x and y; infinite for a plate.
[[nodiscard]] Position half_extent(const Indenter& indenter) noexcept;

/// Whether the pixels of a tip resolve its smallest part.
[[nodiscard]] bool fits(const PressedTip& tip, double receptor_depth_mm);

}  // namespace merkel
