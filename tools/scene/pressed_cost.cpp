#include "tools/scene/pressed_cost.hpp"

#include <algorithm>
#include <vector>

#include "core/contact/sliding_contact.hpp"
#include "core/printed.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr int kPressingTicks = 10;
constexpr int kPressedTicks = 50;
constexpr nanoseconds kMaxPressed{50'000'000};
constexpr double kPressed_mm = 1.0;
constexpr double kPressed_mN = 500.0;
constexpr float kPressed_kPa = 20.0F;
constexpr double kSpeed_mm_per_s = 50.0;  ///< of a surface
constexpr double kLargestShare = 0.8;     ///< of a tick, without a warning

}  // namespace

nanoseconds pressed_cost(TactileModel& model, std::vector<ContactInput> places,
                         const std::function<nanoseconds()>& now) {
  const auto& indenters = model.parameters().indenters;
  const nanoseconds tick = model.parameters().tick;
  for (std::size_t i = 0; i < indenters.size(); ++i) {
    if (indenters[i].taxels() == nullptr) continue;
    const std::vector<float> pressures_kPa(indenters[i].taxels()->size(), kPressed_kPa);
    model.set_taxels(i, pressures_kPa);
  }
  std::vector<nanoseconds> costs;
  nanoseconds pressed{0};
  for (int k = 0; k < kPressingTicks + kPressedTicks && pressed < kMaxPressed; ++k) {
    const double part = std::min(1.0, (k + 1.0) / kPressingTicks);
    for (std::size_t i = 0; i < places.size(); ++i) {
      places[i].depth_mm = part * kPressed_mm;
      places[i].force_mN = part * kPressed_mN;
      if (model.sliding(i) != nullptr) places[i].x_mm += kSpeed_mm_per_s * units::s_from(tick);
    }
    const nanoseconds started = now();
    static_cast<void>(model.step(places, k * tick));
    const nanoseconds cost = now() - started;
    if (k < kPressingTicks) continue;
    costs.push_back(cost);
    pressed += cost;
  }
  model.reset();
  const auto median = costs.begin() + static_cast<std::ptrdiff_t>(costs.size() / 2);
  std::nth_element(costs.begin(), median, costs.end());
  return *median;
}

std::string cost_warning(nanoseconds cost, nanoseconds tick) {
  if (units::s_from(cost) < kLargestShare * units::s_from(tick)) return {};
  return printed(
      "while all probes press, a tick takes about %.3g ms on this machine, and it lasts %.3g ms: "
      "the simulation %s. Simplify the scene (merkel plan shows its cost), set [loop] threads, or "
      "increase [loop] tick_us",
      units::ms_from(cost), units::ms_from(tick),
      cost < tick ? "will barely keep up" : "will skip ticks");
}

}  // namespace merkel
