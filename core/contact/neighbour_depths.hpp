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

/// Tips that press one patch by depth share the skin that they displace: tip i at the depth d_i
/// finds the surface already displaced by the others, and indents it by the rest alone. Solves
/// d_i = δ_i + Σ_{j≠i} u_j(x_i; δ_j) for the indentations δ by Gauss-Seidel, to 1e-7 mm, and writes
/// the presses; a tip that its neighbours leave no depth for does not touch. Each displacement is
/// taken at the middle of the other contact. Real-time: yes (at most 64 rounds).
void solve_neighbour_depths(std::span<NeighbourPress> presses) noexcept MERKEL_REALTIME;

}  // namespace merkel
