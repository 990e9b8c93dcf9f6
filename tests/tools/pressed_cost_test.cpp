#include "tools/scene/pressed_cost.hpp"

#include <gtest/gtest.h>

#include "core/units.hpp"
#include "tests/text_has.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::nanoseconds;

/// A clock on which every tick takes the same time.
struct SlowedClock {
  nanoseconds tick;
  nanoseconds time{0};
  int looks = 0;

  nanoseconds operator()() {
    if (++looks % 2 == 0) time += tick;
    return time;
  }
};

TEST(PressedCost, IsThatOfATickOnTheGivenClock) {
  TactileModel model = *TactileModel::create(preset_scene("goodwin")->model);
  SlowedClock clock{microseconds{400}};
  EXPECT_EQ(pressed_cost(model, {{.x_mm = 15.0, .y_mm = 10.0}}, std::ref(clock)),
            microseconds{400});
  EXPECT_EQ(clock.looks, 2 * 60);
}

TEST(PressedCost, OfAnOverloadedMachineIsMeasuredBriefly) {
  TactileModel model = *TactileModel::create(preset_scene("paper")->model);
  SlowedClock clock{std::chrono::milliseconds{20}};
  static_cast<void>(pressed_cost(model, {{.x_mm = 15.0, .y_mm = 10.0}}, std::ref(clock)));
  EXPECT_EQ(clock.looks, 2 * 13);
}

TEST(PressedCost, LeavesTheModelAtRest) {
  const auto parameters = preset_scene("goodwin")->model;
  TactileModel used = *TactileModel::create(parameters);
  TactileModel fresh = *TactileModel::create(parameters);
  SlowedClock clock{microseconds{1}};
  static_cast<void>(pressed_cost(used, {{.x_mm = 15.0, .y_mm = 10.0}}, std::ref(clock)));
  EXPECT_FALSE(used.deepest().front().touching());
  std::size_t spikes = 0;
  for (int k = 0; k < 100; ++k) {
    const std::vector<ContactInput> press{
        {.depth_mm = 0.01 * k, .force_mN = 10.0 * k, .x_mm = 15.0, .y_mm = 10.0}};
    const auto start = k * parameters.tick;
    const auto expected = fresh.step(press, start);
    const auto made = used.step(press, start);
    ASSERT_TRUE(std::equal(made.begin(), made.end(), expected.begin(), expected.end())) << k;
    spikes += made.size();
  }
  EXPECT_GT(spikes, 0U);
}

TEST(PressedCost, IsNamedWhereATickIsTooShort) {
  EXPECT_EQ(cost_warning(microseconds{700}, microseconds{1000}), "");
  EXPECT_TRUE(has(cost_warning(microseconds{900}, microseconds{1000}),
                  "a tick takes about 0.9 ms on this machine, and it lasts 1 ms: the simulation "
                  "will barely keep up"));
  EXPECT_TRUE(has(cost_warning(microseconds{1500}, microseconds{1000}), "will skip ticks"));
}

}  // namespace
}  // namespace merkel
