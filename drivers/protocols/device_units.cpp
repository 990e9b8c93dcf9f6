#include "drivers/protocols/device_units.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <span>

#include "core/units.hpp"

namespace merkel {
namespace {

struct Unit {
  std::string_view name;
  double factor;
};

constexpr std::array<Unit, 12> kForces = {{{"N", 1.0},
                                           {"mN", units::N_from_mN(1.0)},
                                           {"kN", 1e3},
                                           {"lbF", units::kN_per_lbf},
                                           {"lb", units::kN_per_lbf},
                                           {"ozF", units::kN_per_ozf},
                                           {"oz", units::kN_per_ozf},
                                           {"kgF", units::kN_per_kgf},
                                           {"kg", units::kN_per_kgf},
                                           {"gF", units::kN_per_kgf * 1e-3},
                                           {"g", units::kN_per_kgf * 1e-3},
                                           {"Newton", 1.0}}};
constexpr std::array<Unit, 5> kLengths = {{{"mm", 1.0},
                                           {"um", units::mm_from_um(1.0)},
                                           {"m", 1e3},
                                           {"in", units::kMm_per_inch},
                                           {"inch", units::kMm_per_inch}}};

constexpr std::array<Unit, 8> kPressures = {
    {{"kPa", 1.0},
     {"Pa", 1e-3},
     {"hPa", 0.1},
     {"MPa", 1e3},
     {"mbar", 0.1},
     {"bar", 100.0},
     {"psi", 1e3 * units::kN_per_lbf / (units::kMm_per_inch * units::kMm_per_inch)},
     {"mmHg", 0.133322387415}}};

std::optional<double> factor_of(std::string_view name, std::span<const Unit> table) noexcept {
  const auto same = [name](const Unit& unit) {
    return std::equal(
        name.begin(), name.end(), unit.name.begin(), unit.name.end(),
        [](unsigned char a, unsigned char b) { return std::tolower(a) == std::tolower(b); });
  };
  const auto found = std::find_if(table.begin(), table.end(), same);
  return found == table.end() ? std::nullopt : std::optional(found->factor);
}

}  // namespace

std::optional<double> newtons_per(std::string_view unit) noexcept {
  return factor_of(unit, kForces);
}

std::optional<double> kilopascals_per(std::string_view unit) noexcept {
  return factor_of(unit, kPressures);
}

std::optional<double> millimetres_per(std::string_view unit) noexcept {
  return factor_of(unit, kLengths);
}

}  // namespace merkel
