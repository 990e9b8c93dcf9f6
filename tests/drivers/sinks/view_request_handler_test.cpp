#include "drivers/sinks/view/view_request_handler.hpp"

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
  void notice(const std::string& /*sentence*/) override {}
  [[nodiscard]] StimulationSwitch& stimulation() noexcept override { return stimulation_switch; }
  [[nodiscard]] Link link(std::size_t /*probe*/) const override { return Link::kConnected; }

  std::vector<std::vector<std::uint32_t>> watched;
  StimulationSwitch stimulation_switch;
};

ViewRequest watch(std::vector<std::uint32_t> neurons) {
  return {.kind = ViewRequest::Kind::kWatch, .neurons = std::move(neurons)};
}

// The page is served before the run can be steered, and a browser may be that quick.
TEST(ViewRequestHandler, NeuronsChosenBeforeTheRunExistsAreWatched) {
  ViewRequestHandler requests(SinkSetup{}, false);
  requests.carry_out(watch({1, 2}));
  requests.carry_out(watch({8, 13}));
  WatchedRun run;
  requests.attach(run);
  EXPECT_EQ(run.watched, (std::vector<std::vector<std::uint32_t>>{{8, 13}}));
  requests.carry_out(watch({}));
  EXPECT_EQ(run.watched.back(), std::vector<std::uint32_t>{});
}

TEST(ViewRequestHandler, AnyPageStopsStimulationAndOnlyOneWithTheTokenStartsIt) {
  const auto stop = *ViewRequest::parse("stop");
  const auto start = *ViewRequest::parse("start");
  EXPECT_FALSE(stop.steers());
  EXPECT_TRUE(start.steers());
  ViewRequestHandler requests(SinkSetup{}, false);
  EXPECT_FALSE(requests.stopped());
  WatchedRun run;
  requests.attach(run);
  requests.carry_out(stop);
  EXPECT_TRUE(requests.stopped());
  EXPECT_EQ(run.stimulation_switch.stopped(), StimulationSwitch::By::kPage);
  requests.carry_out(start);
  EXPECT_FALSE(requests.stopped());
  EXPECT_EQ(run.stimulation_switch.stopped(), StimulationSwitch::By::kNone);
}

TEST(ViewRequestHandler, AStopInAPlayedSessionStopsThePlayedCommands) {
  SinkSetup setup;
  setup.session = std::make_shared<SessionPosition>();
  ViewRequestHandler requests(setup, false);
  requests.carry_out({.kind = ViewRequest::Kind::kStop});
  EXPECT_EQ(setup.session->stimulation.stopped(), StimulationSwitch::By::kPage);
  EXPECT_TRUE(requests.stopped());
}

TEST(ViewRequestHandler, WatchesNothingUnasked) {
  ViewRequestHandler requests(SinkSetup{}, false);
  WatchedRun run;
  requests.attach(run);
  EXPECT_TRUE(run.watched.empty());
}

}  // namespace
}  // namespace merkel
