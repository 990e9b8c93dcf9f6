#include "drivers/protocols/device_units.hpp"

#include <algorithm>
#include <array>
#include <cctype>

#include "core/units.hpp"

namespace merkel {
namespace {

struct UnitName {
  std::string_view name;
  Unit unit;
};

constexpr Unit force_unit(double newtons) { return {Quantity::kForce, newtons}; }
constexpr Unit length_unit(double millimetres) { return {Quantity::kLength, millimetres}; }
constexpr Unit pressure_unit(double kilopascals) { return {Quantity::kPressure, kilopascals}; }
constexpr Unit voltage_unit(double volts) { return {Quantity::kVoltage, volts}; }

constexpr auto kUnitNames = std::to_array<UnitName>(
    {{"N", force_unit(1.0)},
     {"mN", force_unit(units::N_from_mN(1.0))},
     {"kN", force_unit(1e3)},
     {"lbF", force_unit(units::kN_per_lbf)},
     {"lb", force_unit(units::kN_per_lbf)},
     {"ozF", force_unit(units::kN_per_ozf)},
     {"oz", force_unit(units::kN_per_ozf)},
     {"kgF", force_unit(units::kN_per_kgf)},
     {"kg", force_unit(units::kN_per_kgf)},
     {"gF", force_unit(units::kN_per_kgf * 1e-3)},
     {"g", force_unit(units::kN_per_kgf * 1e-3)},
     {"Newton", force_unit(1.0)},
     {"mm", length_unit(1.0)},
     {"um", length_unit(units::mm_from_um(1.0))},
     {"\u00b5m", length_unit(units::mm_from_um(1.0))},  // the micro sign, and the Greek letter
     {"\u03bcm", length_unit(units::mm_from_um(1.0))},
     {"cm", length_unit(10.0)},
     {"m", length_unit(1e3)},
     {"in", length_unit(units::kMm_per_inch)},
     {"inch", length_unit(units::kMm_per_inch)},
     {"kPa", pressure_unit(1.0)},
     {"Pa", pressure_unit(1e-3)},
     {"hPa", pressure_unit(0.1)},
     {"MPa", pressure_unit(1e3)},
     {"mbar", pressure_unit(0.1)},
     {"bar", pressure_unit(100.0)},
     {"psi", pressure_unit(1e3 * units::kN_per_lbf / (units::kMm_per_inch * units::kMm_per_inch))},
     {"mmHg", pressure_unit(0.133322387415)},
     {"V", voltage_unit(1.0)},
     {"volt", voltage_unit(1.0)},
     {"volts", voltage_unit(1.0)},
     {"mV", voltage_unit(1e-3)},
     {"uV", voltage_unit(1e-6)},
     {"\u00b5V", voltage_unit(1e-6)},
     {"\u03bcV", voltage_unit(1e-6)},
     {"count", {Quantity::kCount, 1.0}},
     {"counts", {Quantity::kCount, 1.0}}});

}  // namespace

std::optional<Unit> unit_named(std::string_view name) noexcept {
  if (name == "mPa") return std::nullopt;  // not MPa
  const auto* const found =
      std::find_if(kUnitNames.begin(), kUnitNames.end(), [name](const UnitName& each) {
        return std::equal(
            name.begin(), name.end(), each.name.begin(), each.name.end(),
            [](unsigned char a, unsigned char b) { return std::tolower(a) == std::tolower(b); });
      });
  return found == kUnitNames.end() ? std::nullopt : std::optional(found->unit);
}

std::optional<double> factor_to(Quantity quantity, std::string_view unit) noexcept {
  const auto named = unit_named(unit);
  return named && named->quantity == quantity ? std::optional(named->factor) : std::nullopt;
}

std::string_view unit_of(Quantity quantity) noexcept {
  constexpr std::array<std::string_view, 5> kBases = {"N", "mm", "kPa", "V", "count"};
  return kBases[static_cast<std::size_t>(quantity)];
}

}  // namespace merkel
