#pragma once

#include <span>

#include "core/contact/tip_contact.hpp"
#include "core/realtime_tag.hpp"

namespace merkel {

/// A tip that presses on a patch, and its press.
struct NeighbourPress {
  const TipContact* tip = nullptr;
  ContactInput input;
  Press press;
};

/// Depth-controlled tips on one patch share the skin that they displace. Tip i at depth d_i meets a
/// surface already displaced by the other tips and indents it by the remainder. Solves d_i = δ_i +
/// Σ_{j≠i} u_j(x_i; δ_j) for the indentations δ by Gauss-Seidel, to 1e-7 mm, and writes the
/// presses. A tip with no remaining depth does not touch. Each displacement is evaluated at the
/// centre of the other contact. Real-time: yes (at most 64 iterations).
void solve_neighbour_depths(std::span<NeighbourPress> presses) noexcept MERKEL_REALTIME;

}  // namespace merkel
