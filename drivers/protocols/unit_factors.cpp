#include "drivers/protocols/unit_factors.hpp"

#include <cmath>

#include "core/parameters/parameter_error.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/protocols/csv_text_style.hpp"

namespace merkel {
namespace {

constexpr std::string_view kPer = "_per_";
constexpr std::string_view kAnyPressure = "pressure";
constexpr std::string_view kMissing = " without its factor: add the key ";

/// "depth" of "position": the quantity that a name means, or the name itself.
std::string stem_of(std::string_view name) {
  std::string quantity = csv_quantity_of(name);
  const bool known = quantity != "-" && quantity != "seq" && quantity != "time";
  return known ? quantity : std::string(name);
}

bool is_length_name(std::string_view stem) noexcept {
  return stem == "depth" || stem == "x" || stem == "y" || stem == "z";
}

/// True if a key for `name` is for the column `stem`: "force" for "force", "force_x" and "force2".
bool is_for(std::string_view name, std::string_view stem) noexcept {
  if (!stem.starts_with(name)) return false;
  return stem.size() == name.size() || stem[name.size()] == '_' || is_digit(stem[name.size()]);
}

}  // namespace

bool UnitFactors::is_key(std::string_view key) noexcept {
  return key.find(kPer) != std::string_view::npos;
}

std::string UnitFactors::add(std::string_view key, double value) {
  const auto per = key.rfind(kPer);
  const std::string_view named = key.substr(0, per);
  const auto electrical =
      unit_named(per == std::string_view::npos ? "" : key.substr(per + kPer.size()));
  const auto mark = named.rfind('_');
  const auto unit = unit_named(mark == std::string_view::npos ? "" : named.substr(mark + 1));
  const std::string stem = stem_of(named.substr(0, mark));
  if (!electrical || !electrical->is_electrical() || !unit || unit->is_electrical() ||
      stem.empty()) {
    return std::string(key) +
           " is unknown: a factor is written like force_N_per_V, depth_mm_per_V or "
           "pressure_kPa_per_count";
  }
  const bool force = is_for("force", stem);
  const bool fits = force                  ? unit->quantity == Quantity::kForce
                    : is_length_name(stem) ? unit->quantity == Quantity::kLength
                                           : true;
  if (!fits) {
    return std::string(key) + " has another unit than its quantity: write " + stem + "_" +
           std::string(force ? "N" : "mm") + std::string(key.substr(per));
  }
  const double factor = value * unit->factor / electrical->factor;
  if (!std::isfinite(factor) || factor == 0.0) {
    return std::string(key) + " must be a finite number that is not 0";
  }
  for (const Factor& other : factors_) {
    if (other.stem != stem || other.of != electrical->quantity) continue;
    if (other.unit.quantity == unit->quantity && other.unit.factor == factor) return {};
    return std::string(key) + " differs from another factor of " + stem + ": keep one";
  }
  factors_.push_back({.stem = stem,
                      .unit = {.quantity = unit->quantity, .factor = factor},
                      .of = electrical->quantity});
  return {};
}

Expected<UnitFactors, SetupError> UnitFactors::from(UriOptions& options) {
  UnitFactors factors;
  for (const std::string& key : options.keys(&UnitFactors::is_key)) {
    const double value = options.number(key, 1.0, -1e12, 1e12);
    if (std::string wrong = factors.add(key, value); !wrong.empty()) return bad_input(wrong);
  }
  return factors;
}

std::optional<Unit> UnitFactors::of(std::string_view stem, const Unit& electrical) const {
  const std::string name = stem_of(stem);
  const bool known = is_length_name(name) || is_for("force", name);
  const Factor* best = nullptr;
  for (const Factor& factor : factors_) {
    if (factor.of != electrical.quantity) continue;
    const bool any = factor.stem == kAnyPressure && !known;
    if (!any && !is_for(factor.stem, name)) continue;
    const bool better = best == nullptr || best->stem == kAnyPressure ||
                        (factor.stem != kAnyPressure && factor.stem.size() > best->stem.size());
    if (better) best = &factor;
  }
  if (best == nullptr) return std::nullopt;
  return Unit{.quantity = best->unit.quantity, .factor = best->unit.factor * electrical.factor};
}

std::string UnitFactors::missing(std::string_view column, const Unit& electrical, bool length) {
  const std::string base(unit_of(electrical.quantity));
  const std::string stem = stem_of(column.substr(0, column.rfind('_')));
  const bool numbered = !stem.empty() && is_digit(stem.back()) && !is_for("force", stem);
  const std::string unit = length ? "mm" : numbered ? "kPa" : "N";
  const std::string key =
      (numbered ? std::string(kAnyPressure) : stem) + "_" + unit + std::string(kPer) + base;
  return "the column " + std::string(column) + " is in " +
         std::string(column.substr(column.rfind('_') + 1)) + std::string(kMissing) + key +
         ", the number of " + unit + " in one " + base + ", to the URI (" + key +
         "=1.5) or to its calibration file, or measure it by merkel calibrate";
}

std::string UnitFactors::key_in(std::string_view sentence) {
  const auto found = sentence.find(kMissing);
  if (found == std::string_view::npos) return {};
  const std::string_view rest = sentence.substr(found + kMissing.size());
  return std::string(rest.substr(0, rest.find(',')));
}

}  // namespace merkel
