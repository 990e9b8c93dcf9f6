#include "tools/studies/plan/known_methods.hpp"

#include <algorithm>
#include <iterator>
#include <limits>

#include "core/neurons/hodgkin_huxley/largest_step.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

/// Prior knowledge of a method, independent of the scene.
struct KnownMethod {
  IntegrationMethod method;
  Precision precision;
  double step_cost_ns;       ///< of one neuron, below kExponentialGates_ms
  double long_step_cost_ns;  ///< from there on
  double error_us[6];        ///< at kKnownSteps_us
};
constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kKnownSteps_us[] = {200.0, 100.0, 50.0, 25.0, 12.5, 6.25};
constexpr KnownMethod kKnown[] = {
#include "tools/studies/plan/method_table.inc"
};

/// Largest ratio of a scene's error to the table's. The table is for neurons that fire at 70 Hz for
/// half a second; near threshold, errors are larger.
constexpr double kTableDoubt = 20.0;

}  // namespace

std::vector<PlanOption> options_by_cost(std::chrono::nanoseconds tick, double budget_us) {
  struct Costed {
    double cost;
    PlanOption option;
  };
  std::vector<Costed> found;
  for (const KnownMethod& known : kKnown) {
    for (std::size_t k = 0; k < std::size(kKnownSteps_us); ++k) {
      const auto step = units::nanoseconds_from_us(kKnownSteps_us[k]);
      if (known.error_us[k] > kTableDoubt * budget_us) continue;
      if (tick % step != std::chrono::nanoseconds{0}) continue;
      if (units::ms_from(step) > largest_step_alone_ms({}, known.method)) continue;
      found.push_back(
          {(1e-3 * kKnownSteps_us[k] < kExponentialGates_ms ? known.step_cost_ns
                                                            : known.long_step_cost_ns) /
               kKnownSteps_us[k],
           {.method = known.method, .precision = known.precision, .step = step, .tick = tick}});
    }
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Costed& a, const Costed& b) { return a.cost < b.cost; });
  std::vector<PlanOption> options;
  for (const Costed& each : found) options.push_back(each.option);
  return options;
}

}  // namespace merkel
