#pragma once

#include <cstdint>
#include <limits>

#include "core/contact/reach_mask.hpp"
#include "core/contact/sliding_contact.hpp"
#include "core/contact/taxel_field.hpp"
#include "core/contact/tip_field.hpp"
#include "core/realtime_tag.hpp"
#include "core/records/contact_state.hpp"

namespace merkel {

/// A contact, the position of its axis on the patch, and its reach.
struct PlacedContact {
  ContactState contact;
  const TipField* field = nullptr;     ///< the tables of a solved contact; null: closed forms
  const TaxelField* taxels = nullptr;  ///< the energies under a tactile array, alone on its patch
  std::uint64_t version = 0;           ///< of these energies, or of the field of a surface
  const SlidingContact* sliding = nullptr;  ///< of a surface that slides
  double x_mm = 0.0;
  double y_mm = 0.0;
  /// Beyond this distance from the axis, the energy density is taken as zero (see DriveReach).
  double reach_mm = std::numeric_limits<double>::infinity();
  const ReachMask* mask = nullptr;  ///< within this distance; null: all of it

  /// The energy density in the skin, which this press stiffens, where the stress of its field would
  /// store `at_rest` in skin at rest. A solved contact's field is that of skin at rest; the
  /// pressure of a closed form already contains the stiffening. Real-time: yes.
  [[nodiscard]] double stored_energy(double at_rest) const noexcept MERKEL_REALTIME {
    return field != nullptr || sliding != nullptr ? at_rest * contact.stiffening
                                                  : at_rest / contact.stiffening;
  }

  friend bool operator==(const PlacedContact&, const PlacedContact&) = default;
};

}  // namespace merkel
