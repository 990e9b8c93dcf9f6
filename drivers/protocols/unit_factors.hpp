#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"
#include "drivers/protocols/device_units.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// What one volt or count of a column means, by keys such as force_N_per_V, thumb_mN_per_V,
/// x_mm_per_count and pressure_kPa_per_count, in a URI or a calibration file. A key is for the
/// column of its name and for its numbered ones (taxel_kPa_per_count for taxel17_count), and
/// pressure_… for every column without a key of its own. Thread: any.
class UnitFactors {
 public:
  /// True for the name of such a key.
  [[nodiscard]] static bool is_key(std::string_view key) noexcept;

  /// Adds a factor. \return what is wrong with it; empty: nothing
  [[nodiscard]] std::string add(std::string_view key, double value);
  /// The keys among the options of a URI.
  [[nodiscard]] static Expected<UnitFactors, SetupError> from(UriOptions& options);

  [[nodiscard]] bool empty() const noexcept { return factors_.empty(); }

  /// The unit of a column whose numbers are in volts or counts: its quantity, and its factor to N,
  /// mm or kPa. Empty: no key is for it. \param stem  its name without the unit
  [[nodiscard]] std::optional<Unit> of(std::string_view stem, const Unit& electrical) const;

  /// What to do about a column in volts or counts that no key is for.
  /// \param column  its whole name. \param length  it is known to be one; else a force
  [[nodiscard]] static std::string missing(std::string_view column, const Unit& electrical,
                                           bool length);
  /// The key that such a sentence names; empty: it is another sentence.
  [[nodiscard]] static std::string key_in(std::string_view sentence);

 private:
  struct Factor {
    std::string stem;
    Unit unit;                         ///< of one
    Quantity of = Quantity::kVoltage;  ///< volt or count
  };
  std::vector<Factor> factors_;
};

}  // namespace merkel
