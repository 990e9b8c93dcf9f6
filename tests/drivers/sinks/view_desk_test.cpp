#include "drivers/sinks/view/view_desk.hpp"

#include <cstdint>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/run_control.hpp"

namespace merkel {
namespace {

class WatchedRun final : public RunControl {
 public:
  void watch(std::span<const std::uint32_t> neurons) noexcept override {
    watched.emplace_back(neurons.begin(), neurons.end());
  }
  [[nodiscard]] bool tare(std::size_t /*probe*/) override { return false; }
  void mark(const Mark& /*mark*/) override {}
  [[nodiscard]] Link link(std::size_t /*probe*/) const override { return Link::kConnected; }

  std::vector<std::vector<std::uint32_t>> watched;
};

ViewRequest watch(std::vector<std::uint32_t> neurons) {
  return {.kind = ViewRequest::Kind::kWatch, .neurons = std::move(neurons)};
}

// The page is served before the run can be steered, and a browser may be that quick.
TEST(ViewDesk, NeuronsChosenBeforeTheRunExistsAreWatched) {
  ViewDesk desk(SinkSetup{}, false);
  desk.carry_out(watch({1, 2}));
  desk.carry_out(watch({8, 13}));
  WatchedRun run;
  desk.attach(run);
  EXPECT_EQ(run.watched, (std::vector<std::vector<std::uint32_t>>{{8, 13}}));
  desk.carry_out(watch({}));
  EXPECT_EQ(run.watched.back(), std::vector<std::uint32_t>{});
}

TEST(ViewDesk, WatchesNothingUnasked) {
  ViewDesk desk(SinkSetup{}, false);
  WatchedRun run;
  desk.attach(run);
  EXPECT_TRUE(run.watched.empty());
}

}  // namespace
}  // namespace merkel
