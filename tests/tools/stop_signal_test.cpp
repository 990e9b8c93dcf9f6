#include "tools/run/stop_signal.hpp"

#include <atomic>
#include <csignal>
#include <utility>

#include <gtest/gtest.h>

#include "core/scene/tactile_model.hpp"
#include "drivers/probes/open_probe.hpp"

namespace merkel {
namespace {

TEST(StopSignal, OfAnEarlierRunDoesNotStopTheNextOne) {
  std::atomic<bool> first_flag{false};
  {
    const StopSignal first(first_flag);
    EXPECT_FALSE(first.requested());
    std::raise(SIGTERM);
    EXPECT_TRUE(first.requested());
    EXPECT_TRUE(first_flag);
  }
  std::atomic<bool> flag{false};
  const StopSignal second(flag);
  EXPECT_FALSE(second.requested());
  EXPECT_FALSE(flag);
  std::raise(SIGTERM);
  EXPECT_TRUE(second.requested());
  EXPECT_TRUE(flag);
}

TEST(StopSignal, ThatArrivesBeforeThePipelineEndsItAsWell) {
  StopSignal stop;
  std::raise(SIGTERM);
  auto model = TactileModel::create({});
  ASSERT_TRUE(model);
  auto probe = open_probe("sim:ramp");
  ASSERT_TRUE(probe);
  Pipeline pipeline(*model, {.fast = true});
  pipeline.add_probe(std::move(*probe), {});
  stop.reach(pipeline);
  const auto report = pipeline.run();
  // The probe may have been faster.
  if (report) {
    EXPECT_TRUE(report->interrupted);
    EXPECT_EQ(report->ticks, 0U);
  } else {
    EXPECT_EQ(report.error().sentence,
              "stopped before the probe sim:ramp delivered a sample: nothing was simulated");
  }
}

}  // namespace
}  // namespace merkel
