#pragma once

#include <memory>
#include <optional>

#include "core/contact/flat_tip_field.hpp"
#include "core/contact/indenter.hpp"
#include "core/contact/sphere_law.hpp"
#include "core/realtime_tag.hpp"
#include "core/records/contact_input.hpp"

namespace merkel {

/// The contact of any tip with the skin at one instant.
struct Press {
  ContactState contact;
  double x_mm = 0.0;  ///< of its centre
  double y_mm = 0.0;

  [[nodiscard]] bool touching() const noexcept { return contact.depth_mm > 0.0; }
};

/// Turns a probe's reading into the contact of its tip. Real-time: yes, after construction.
class TipContact {
 public:
  TipContact(const Indenter& indenter, const SkinParameters& skin);

  [[nodiscard]] Press press(const ContactInput& input) const noexcept MERKEL_REALTIME;
  /// The unit field of bars or a pin; null for a sphere.
  [[nodiscard]] const FlatTipField* flat_tip() const noexcept { return flat_tip_.get(); }
  /// The contact law of a sphere; null for a flat tip.
  [[nodiscard]] const SphereLaw* sphere() const noexcept { return sphere_ ? &*sphere_ : nullptr; }

 private:
  bool by_force_;
  std::optional<SphereLaw> sphere_;
  std::optional<Position> apex_;
  double offset_kept_ = 1.0;  ///< of the axis from the apex: k/(k + 1/R_skin), k = 1/R
  std::shared_ptr<const FlatTipField> flat_tip_;
};

}  // namespace merkel
