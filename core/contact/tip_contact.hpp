#pragma once

#include <memory>
#include <optional>

#include "core/contact/indenter.hpp"
#include "core/contact/sphere_law.hpp"
#include "core/contact/tip_field.hpp"
#include "core/realtime_tag.hpp"
#include "core/records/contact_input.hpp"

namespace merkel {

/// Turns a probe's reading into the contact of its tip; of a surface, to that of a plate (see
/// SlidingContact). Real-time: yes, after construction.
class TipContact {
 public:
  TipContact(const Indenter& indenter, const SkinParameters& skin);

  [[nodiscard]] Press press(const ContactInput& input) const noexcept MERKEL_REALTIME;
  /// The same at the depth that the neighbouring contacts leave.
  [[nodiscard]] Press press_at_depth(const ContactInput& input,
                                     double depth_mm) const noexcept MERKEL_REALTIME;
  /// Downward displacement of the surface by a press at a point of the patch.
  [[nodiscard]] double displacement_mm(const Press& press, double x_mm,
                                       double y_mm) const noexcept MERKEL_REALTIME;
  /// The tables of a contact; null if it is circular or none.
  [[nodiscard]] const TipField* field() const noexcept { return field_.get(); }
  [[nodiscard]] bool by_force() const noexcept { return by_force_; }
  /// The closed form of a sphere; null for a solved contact.
  [[nodiscard]] const SphereLaw* sphere() const noexcept { return sphere_ ? &*sphere_ : nullptr; }

 private:
  [[nodiscard]] Press placed(const ContactInput& input, const ContactState& contact) const noexcept;

  [[nodiscard]] double solved_depth_mm(double force_mN) const noexcept;

  bool by_force_;
  SkinParameters skin_;
  std::optional<SphereLaw> sphere_;
  std::optional<Position> apex_;
  /// Ratio of the contact's offset from the apex to the axis's, along and across the finger: k/(k +
  /// 1/R_skin), k = 1/R.
  double kept_along_ = 1.0;
  double kept_across_ = 1.0;
  std::shared_ptr<const TipField> field_;
};

}  // namespace merkel
