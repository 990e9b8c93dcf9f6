// Stimulation commands through the whole pipeline: probe, loop, model, encoder, limiter, sinks.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <semaphore>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/encoding/encoded_model.hpp"
#include "core/encoding/stimulation_encoder.hpp"
#include "core/encoding/stimulation_outlet.hpp"
#include "core/math/random.hpp"
#include "core/scene/tactile_model.hpp"
#include "realtime/input/drive_input.hpp"
#include "realtime/pipeline.hpp"
#include "realtime/threads/host_time.hpp"
#include "tests/core/encoding/command_auditor.hpp"
#include "tests/core/encoding/random_encoding.hpp"
#include "tests/realtime/memory_probe.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using Kind = StimulationCommand::Kind;
using State = TickRecord::State;
using Stop = StimulationCommand::Stop;

constexpr milliseconds kTick{1};

/// The commands that a receiver gets.
struct Received {
  std::vector<StimulationCommand> commands;
  std::vector<TickRecord> ticks;
  bool spikes = false;
};

/// Stores commands; fails after a given number.
class CommandSink final : public Sink {
 public:
  explicit CommandSink(Received& received, std::size_t limit = SIZE_MAX)
      : received_(received), limit_(limit) {}
  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kKinds<StimulationCommand, TickRecord>;
  }
  Expected<void, SinkError> write(const RecordBatch& batch) override {
    received_.spikes = received_.spikes || !batch.spikes.empty();
    const auto commands = batch.commands;
    received_.commands.insert(received_.commands.end(), commands.begin(), commands.end());
    received_.ticks.insert(received_.ticks.end(), batch.ticks.begin(), batch.ticks.end());
    if (received_.commands.size() < limit_) return {};
    return Unexpected<SinkError>({"the receiver is gone"});
  }
  Expected<void, SinkError> close() override { return {}; }

 private:
  Received& received_;
  std::size_t limit_;
  std::string uri_ = "memory:";
};

/// One second of random taps, with outages, NaN values and presses that are far too deep.
std::vector<ProbeSample> random_touch(Random& random) {
  std::vector<ProbeSample> samples;
  double depth_mm = 0.0;
  for (int k = 0; k < 1000; ++k) {
    if (random.uniform() < 0.01) k += static_cast<int>(random.next() % 120);
    if (random.uniform() < 0.02)
      depth_mm = random.uniform() < 0.4 ? -0.1 : random.uniform(0.0, 2.0);
    double value = depth_mm;
    if (random.uniform() < 0.002) value = std::numeric_limits<double>::quiet_NaN();
    if (random.uniform() < 0.002) value = std::numeric_limits<double>::infinity();
    if (random.uniform() < 0.002) value = 1e300;
    samples.push_back({.time = k * kTick, .depth_mm = value, .channels = ProbeSample::kDepth});
  }
  return samples;
}

struct StimulationOutcome {
  RunReport report;
  Received received;
};

/// \param failing_after  commands after which a second sink fails
StimulationOutcome run(const EncodingParameters& parameters, std::vector<ProbeSample> samples,
                       std::size_t chunk = 64, std::size_t failing_after = SIZE_MAX) {
  TactileModel model = *TactileModel::create({});
  auto encoder = StimulationEncoder::create(parameters, encoded_model(model));
  EXPECT_TRUE(encoder) << encoder.error().key << " " << encoder.error().reason;
  Pipeline pipeline(model, {.fast = true, .encoder = &*encoder});
  pipeline.add_probe(std::make_unique<MemoryProbe>(std::move(samples), chunk),
                     {.stale_after = milliseconds{50}, .x_mm = 15.0, .y_mm = 10.0});
  StimulationOutcome outcome;
  Received of_failing;
  pipeline.add_sink(std::make_unique<CommandSink>(outcome.received));
  if (failing_after != SIZE_MAX) {
    pipeline.add_sink(std::make_unique<CommandSink>(of_failing, failing_after));
  }
  auto report = pipeline.run();
  EXPECT_TRUE(report) << report.error().sentence;
  outcome.report = *report;
  return outcome;
}

/// Checks every command of a run against the limits, and the response to every fault. \return the
/// error, or an empty string
std::string audit(const EncodingParameters& limits, const StimulationOutcome& outcome) {
  CommandAuditor auditor = auditor_of(limits);
  const std::size_t electrodes = limits.electrodes.size();
  const auto& commands = outcome.received.commands;
  if (outcome.received.spikes) return "a sink that takes no spikes received some";
  if (commands.size() < electrodes) return "the last update is missing";
  const auto last_update = commands.end() - static_cast<std::ptrdiff_t>(electrodes);
  auto next = commands.begin();
  std::uint32_t heartbeat = 0;
  bool failed = false;
  std::vector<StimulationCommand> of_tick;
  const auto take = [&](bool fault) -> std::string {
    auditor.take(of_tick);
    if (!auditor.fault().empty()) return auditor.fault();
    for (const auto& command : of_tick) {
      if (command.kind == Kind::kUpdate && command.electrode == 0) ++heartbeat;
      if (command.heartbeat != heartbeat && command.kind == Kind::kUpdate) {
        return "a heartbeat is missing";
      }
      failed = failed || command.stop == Stop::kSinkFailure;
      if (failed && command.amplitude_uA != 0.0) return "stimulation continues after a sink failed";
    }
    for (std::size_t e = 0; fault && e < electrodes; ++e) {
      if (auditor.train_uA(e) != 0.0) return "a train continues after a fault";
    }
    return "";
  };
  for (const TickRecord& tick : outcome.received.ticks) {
    of_tick.clear();
    for (; next != last_update && next->time <= tick.time; ++next) of_tick.push_back(*next);
    const bool fault = tick.state == State::kReleased || tick.state == State::kEnded;
    if (auto wrong = take(fault); !wrong.empty()) return wrong;
  }
  if (next != last_update) return "there are commands beyond the last tick";
  of_tick.assign(last_update, commands.end());
  for (const auto& command : of_tick) {
    if (command.stop != Stop::kEnd || command.amplitude_uA != 0.0) return "the end is not off";
  }
  return take(true);
}

/// A scene without one of its limits.
EncodingParameters without(EncodingParameters parameters, const std::string& limit) {
  StimulationParameters& stimulation = parameters.stimulation;
  if (limit == "charge") stimulation.max_charge_nC = 1e6;
  if (limit == "total") stimulation.max_total_uA = 1e6;
  if (limit == "slope") stimulation.max_slope_uA_per_s.reset();
  if (limit == "electrodes") stimulation.max_electrodes.reset();
  for (Electrode& electrode : parameters.electrodes) {
    if (limit == "amplitude") electrode.amplitude_uA[1] += 50.0;
    if (limit == "frequency") electrode.frequency_Hz[1] += 1000.0;
  }
  if (limit == "amplitude") stimulation.max_charge_nC *= 2.0;
  return parameters;
}

TEST(Stimulation, NoOutputExceedsALimitAndEveryFaultSwitchesOff) {
  std::uint64_t on = 0;
  std::uint64_t stops = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    Random random(seed);
    const EncodingParameters parameters = random_encoding(random, 4.0);
    const std::size_t failing_after = seed % 4 == 0 ? random.next() % 500 : SIZE_MAX;
    const StimulationOutcome outcome =
        run(parameters, random_touch(random), 1 + random.next() % 300, failing_after);
    ASSERT_EQ(audit(parameters, outcome), "") << "seed " << seed;
    ASSERT_EQ(outcome.report.commands, outcome.received.commands.size());
    on += std::any_of(outcome.received.commands.begin(), outcome.received.commands.end(),
                      [](const auto& command) { return command.amplitude_uA > 0.0; })
              ? 1
              : 0;
    stops += outcome.report.stimulation_stops;
  }
  EXPECT_GT(on, 15U);
  EXPECT_GT(stops, 30U);
}

TEST(Stimulation, EveryLimitIsNeeded) {
  // Low limits, each of which a hard press exceeds.
  EncodingParameters parameters = encoding_of({});
  for (int e = 0; e < 4; ++e) {
    auto electrode = electrode_at("E" + std::to_string(e), EncoderKind::kLinear, 15.0, 10.0, 5.0);
    electrode.full_force_N = 0.05;
    electrode.amplitude_uA = {20.0, 60.0 + e};
    parameters.electrodes.push_back(electrode);
  }
  StimulationParameters& limits = parameters.stimulation;
  limits.max_total_uA = 100.0;
  limits.max_slope_uA_per_s = 400.0;
  limits.max_electrodes = 3;
  std::vector<ProbeSample> samples;
  for (int k = 0; k < 600; ++k) {
    samples.push_back({.time = k * kTick,
                       .depth_mm = (k / 150) % 2 == 1 ? 1.5 : -0.1,
                       .channels = ProbeSample::kDepth});
  }
  ASSERT_EQ(audit(parameters, run(parameters, samples)), "");
  for (const std::string limit : {"total", "slope", "electrodes"}) {
    EXPECT_NE(audit(parameters, run(without(parameters, limit), samples)), "") << limit;
  }
  // The total and the slope would hide these limits.
  limits.max_total_uA = 1e4;
  limits.max_slope_uA_per_s.reset();
  limits.max_electrodes.reset();
  ASSERT_EQ(audit(parameters, run(parameters, samples)), "");
  for (const std::string limit : {"amplitude", "frequency"}) {
    EXPECT_NE(audit(parameters, run(without(parameters, limit), samples)), "") << limit;
  }
  EncodingParameters half = parameters;
  half.stimulation.max_charge_nC /= 2.0;  // the scene itself would be refused
  EXPECT_NE(audit(half, run(without(parameters, "charge"), samples)), "");
}

TEST(Stimulation, ChunksOfAnySizeGiveTheSameCommands) {
  Random random(11);
  const EncodingParameters parameters = random_encoding(random, 5.0);
  const auto samples = random_touch(random);
  const auto one = run(parameters, samples, 1).received.commands;
  EXPECT_GT(one.size(), 100U);
  EXPECT_EQ(run(parameters, samples, 7).received.commands, one);
  EXPECT_EQ(run(parameters, samples, 1000).received.commands, one);
}

TEST(Stimulation, AGivenDriveIsTakenAtATickRecordedAndHoldsForTheWatchdog) {
  struct DriveSink final : public Sink {
    explicit DriveSink(std::vector<GivenDrive>& the_drives) : drives(the_drives) {}
    [[nodiscard]] const std::string& uri() const noexcept override { return name; }
    [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
      return kKinds<GivenDrive>;
    }
    Expected<void, SinkError> write(const RecordBatch& batch) override {
      drives.insert(drives.end(), batch.drives.begin(), batch.drives.end());
      return {};
    }
    Expected<void, SinkError> close() override { return {}; }
    std::vector<GivenDrive>& drives;
    std::string name = "drives:";
  };
  EncodingParameters parameters =
      encoding_of({electrode_at("E1", EncoderKind::kOwn, 15.0, 10.0, 3.0)});
  TactileModel model = *TactileModel::create({});
  auto encoder = StimulationEncoder::create(parameters, encoded_model(model));
  ASSERT_TRUE(encoder) << encoder.error().key << " " << encoder.error().reason;
  Pipeline pipeline(model, {.fast = true, .encoder = &*encoder});
  std::vector<ProbeSample> samples;
  for (int k = 0; k < 500; ++k) {
    samples.push_back({.time = k * kTick, .depth_mm = 0.0, .channels = ProbeSample::kDepth});
  }
  pipeline.add_probe(std::make_unique<MemoryProbe>(std::move(samples), 64), {});
  Received received;
  std::vector<GivenDrive> drives;
  pipeline.add_sink(std::make_unique<CommandSink>(received));
  pipeline.add_sink(std::make_unique<DriveSink>(drives));
  const GivenDrive given{.amplitude = 0.5, .frequency = 0.5};
  EXPECT_TRUE(pipeline.give_drive(given));
  ASSERT_TRUE(pipeline.run());
  ASSERT_EQ(drives.size(), 1U);
  GivenDrive taken = given;
  taken.time = kTick;  // the end of the first tick
  EXPECT_EQ(drives[0], taken);
  int on = 0;
  for (const StimulationCommand& command : received.commands) {
    if (command.electrode != 0 || command.stop == Stop::kEnd) continue;
    const bool holds = command.time < kTick + milliseconds{100};
    EXPECT_EQ(command.stop, holds ? Stop::kNone : Stop::kNoDrive);
    EXPECT_TRUE(holds || command.amplitude_uA == 0.0);
    on += command.amplitude_uA > 0.0;
  }
  EXPECT_GT(on, 0);
  // After the run no loop takes them.
  bool full = false;
  for (int i = 0; i < 10'000 && !full; ++i) full = !pipeline.give_drive(given);
  EXPECT_TRUE(full);
}

TEST(Stimulation, ADriveThatWaitedTooLongForTheLoopIsNotTaken) {
  DriveInput input;
  int taken = 0;
  const auto count = [&](const GivenDrive& drive) { taken += drive.time == kTick ? 1 : 0; };
  EXPECT_TRUE(input.give({.amplitude = 0.5}));
  input.take(kTick, host_now() + nanoseconds{1}, count);
  EXPECT_EQ(taken, 0);
  const nanoseconds before = host_now();
  EXPECT_TRUE(input.give({.amplitude = 0.5}));
  input.take(kTick, before, count);
  EXPECT_EQ(taken, 1);
  input.take(kTick, before, count);
  EXPECT_EQ(taken, 1);
}

TEST(Stimulation, AFailedSinkSwitchesEverythingOffForGood) {
  auto electrode = electrode_at("E1", EncoderKind::kLinear, 15.0, 10.0, 5.0);
  electrode.full_force_N = 0.05;
  std::vector<ProbeSample> samples;
  for (int k = 0; k < 20'000; ++k) {
    samples.push_back({.time = k * kTick, .depth_mm = 1.5, .channels = ProbeSample::kDepth});
  }
  const auto outcome = run(encoding_of({electrode}), samples, 64, 20);
  const auto& commands = outcome.received.commands;
  const auto stop = std::find_if(commands.begin(), commands.end(), [](const auto& command) {
    return command.stop == Stop::kSinkFailure;
  });
  ASSERT_NE(stop, commands.end());
  EXPECT_GT(stop - commands.begin(), 19);
  EXPECT_TRUE(std::all_of(stop, commands.end(),
                          [](const auto& command) { return command.amplitude_uA == 0.0; }));
  EXPECT_EQ(outcome.report.stimulation_stops, 1U);
  EXPECT_NE(outcome.report.sinks[1].error_message, "");
}

TEST(Stimulation, ADoubtedProbeSuspendsItsElectrodesAndTheyRiseFromZeroAfterwards) {
  auto electrode = electrode_at("E1", EncoderKind::kLinear, 15.0, 10.0, 5.0);
  electrode.full_force_N = 0.05;
  EncodingParameters parameters = encoding_of({electrode});
  parameters.stimulation.max_slope_uA_per_s = 1000.0;
  std::vector<ProbeSample> samples;
  for (int k = 0; k < 1000; ++k) {
    samples.push_back({.time = k * kTick, .depth_mm = 1.5, .channels = ProbeSample::kDepth});
    if (k >= 500 && k < 600) samples.back().set_doubts(ProbeSample::kOutsideCalibration);
  }
  const auto outcome = run(parameters, samples);
  EXPECT_EQ(outcome.report.stimulation_stops, 1U);
  std::optional<nanoseconds> resumed;
  for (const StimulationCommand& command : outcome.received.commands) {
    // Interpolation towards a doubted sample rests on it.
    const bool doubted = command.time >= milliseconds{500} && command.time < milliseconds{600};
    EXPECT_EQ(command.stop == Stop::kOutsideCalibration, doubted) << command.time.count();
    EXPECT_TRUE(!doubted || command.amplitude_uA == 0.0) << command.time.count();
    if (command.time < milliseconds{600} || command.stop != Stop::kNone) continue;
    if (!resumed) resumed = command.time - milliseconds{10};
    EXPECT_LE(command.amplitude_uA,
              1e-6 * static_cast<double>((command.time - *resumed).count()) + 1e-9);
  }
  ASSERT_TRUE(resumed);
  EXPECT_LE(*resumed, milliseconds{601});
  const auto last =
      std::find_if(outcome.received.commands.rbegin(), outcome.received.commands.rend(),
                   [](const auto& each) { return each.stop == Stop::kNone; });
  EXPECT_EQ(last->amplitude_uA, 80.0);
  const auto ticks = outcome.received.ticks;
  EXPECT_EQ(
      std::count_if(ticks.begin(), ticks.end(), [](const auto& tick) { return tick.doubts != 0; }),
      100);
}

/// A device that presses, sends a backlog at first, and dies.
class DyingDevice final : public Probe {
 public:
  /// \param samples  the first 800 of them at once
  explicit DyingDevice(int samples = 1400) : left_(samples) {
    info_.uri = "dying:";
    info_.channels = ProbeSample::kDepth;
    info_.period = milliseconds{1};
  }
  [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override { return {&info_, 1}; }
  Expected<std::size_t, ProbeError> read(Readings& readings, milliseconds) override {
    readings.clear();
    std::this_thread::sleep_for(milliseconds{1});
    if (next_ == nanoseconds{0}) next_ = host_now() - milliseconds{800};
    for (; next_ <= host_now() && readings.room() > 0 && left_ > 0; next_ += kTick, --left_) {
      readings.add_sample(
          {.time = next_, .arrival = host_now(), .depth_mm = 1.5, .channels = ProbeSample::kDepth});
    }
    return readings.size();
  }
  [[nodiscard]] std::string error_message() const override { return {}; }

 private:
  ProbeInfo info_;
  nanoseconds next_{0};
  int left_;
};

/// Takes commands as a receiver that acts on them.
class ReceiverSink final : public Sink {
 public:
  explicit ReceiverSink(std::vector<StimulationCommand>& received) : received_(received) {}
  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kKinds<SentCommand>;
  }
  /// Calls a function once after so many commands of a kind.
  void after(int commands, std::function<bool(const StimulationCommand&)> of_kind,
             std::function<void()> call) {
    left_ = commands;
    of_kind_ = std::move(of_kind);
    call_ = std::move(call);
  }
  Expected<void, SinkError> write(const RecordBatch& batch) override {
    for (const SentCommand& sent : batch.sent) {
      const StimulationCommand& command = sent.command;
      EXPECT_EQ(sent.valid_until - sent.sent, milliseconds{100});
      received_.push_back(command);
      if (left_ > 0 && of_kind_(command) && --left_ == 0) call_();
    }
    return {};
  }
  Expected<void, SinkError> close() override { return {}; }

 private:
  std::vector<StimulationCommand>& received_;
  std::string uri_ = "receiver:";
  int left_ = 0;
  std::function<bool(const StimulationCommand&)> of_kind_;
  std::function<void()> call_;
};

TEST(Stimulation, AReceiverGetsNoBacklogAndAnOffWhenTheDeviceDies) {
  auto electrode = electrode_at("E1", EncoderKind::kLinear, 15.0, 10.0, 5.0);
  electrode.full_force_N = 0.05;
  EncodingParameters parameters = encoding_of({electrode});
  parameters.stimulation.max_slope_uA_per_s = 2000.0;
  TactileModel model = *TactileModel::create({});
  auto encoder = *StimulationEncoder::create(parameters, encoded_model(model));
  // Neither the loop's rule for a silent probe nor a short delay helps the watchdog here.
  Pipeline pipeline(
      model, {.delay = milliseconds{20}, .duration = milliseconds{2200}, .encoder = &encoder});
  pipeline.add_probe(std::make_unique<DyingDevice>(), {.stale_after = std::chrono::seconds{100}});
  Received recorded;
  std::vector<StimulationCommand> received;
  pipeline.add_sink(std::make_unique<CommandSink>(recorded));
  pipeline.add_sink(std::make_unique<ReceiverSink>(received));
  const auto report = pipeline.run();
  ASSERT_TRUE(report) << report.error().sentence;
  ASSERT_GT(received.size(), 3U);
  for (std::size_t k = 0; k < received.size(); ++k) EXPECT_EQ(received[k].heartbeat, k + 1);
  EXPECT_EQ(received.back().stop, Stop::kEnd);
  // The recording holds every command of the encoder; the backlog of 0.8 s has not left.
  EXPECT_GT(recorded.commands.size(), received.size() + 50);
  EXPECT_GT(report->commands_withheld, 50U);
  EXPECT_GT(received.front().time, recorded.commands.front().time + milliseconds{500});
  EXPECT_LE(received.front().amplitude_uA, 2000.0 * 0.012 + 1e-9);
  const auto stale = std::find_if(received.begin(), received.end(), [](const auto& command) {
    return command.stop == Stop::kStale && command.amplitude_uA == 0.0;
  });
  ASSERT_NE(stale, received.end());
  EXPECT_GT(report->stale_stops, 0U);
  EXPECT_EQ(received.at(received.size() - 2).amplitude_uA, 0.0);
  EXPECT_EQ(recorded.commands.at(recorded.commands.size() - 2).amplitude_uA, 80.0);
}

TEST(Stimulation, AStopByHandReachesEveryReceiverAndHoldsUntilTheEnd) {
  auto electrode = electrode_at("E1", EncoderKind::kLinear, 15.0, 10.0, 5.0);
  electrode.full_force_N = 0.05;
  TactileModel model = *TactileModel::create({});
  auto encoder = *StimulationEncoder::create(encoding_of({electrode}), encoded_model(model));
  std::vector<std::string> notices;
  Pipeline pipeline(model,
                    {.delay = milliseconds{20},
                     .encoder = &encoder,
                     .on_notice = [&](const std::string& notice) { notices.push_back(notice); }});
  pipeline.add_probe(std::make_unique<DyingDevice>(200'000),
                     {.stale_after = std::chrono::seconds{100}});
  std::vector<StimulationCommand> received;
  std::vector<StimulationCommand> also_received;
  auto stopper = std::make_unique<ReceiverSink>(received);
  stopper->after(
      20, [](const auto& command) { return command.amplitude_uA > 0.0; },
      [&pipeline] { pipeline.stimulation().stop(StimulationSwitch::By::kProgram); });
  pipeline.add_sink(std::move(stopper));
  // The run ends some commands after the stop, however slow the machine is.
  auto ender = std::make_unique<ReceiverSink>(also_received);
  ender->after(
      20, [](const auto& command) { return command.stop == Stop::kStopped; },
      [&pipeline] { pipeline.request_stop(); });
  pipeline.add_sink(std::move(ender));
  const auto report = pipeline.run();
  ASSERT_TRUE(report) << report.error().sentence;
  for (const auto* each : {&received, &also_received}) {
    const auto off = std::find_if(each->begin(), each->end(), [](const auto& command) {
      return command.stop == Stop::kStopped;
    });
    ASSERT_NE(off, each->end());
    EXPECT_GE(off - each->begin(), 15);
    EXPECT_TRUE(std::all_of(off, each->end(), [](const auto& command) {
      return command.amplitude_uA == 0.0 &&
             (command.stop == Stop::kStopped || command.stop == Stop::kEnd);
    }));
  }
  // At once: no update is on after the one that stopped it.
  const auto off = std::find_if(received.begin(), received.end(),
                                [](const auto& command) { return command.stop == Stop::kStopped; });
  EXPECT_LE(std::count_if(received.begin(), off,
                          [](const auto& each) { return each.amplitude_uA > 0.0; }),
            22);
  EXPECT_EQ(report->stimulation_stop.by, StimulationSwitch::By::kProgram);
  EXPECT_EQ(report->stimulation_stopped, StimulationSwitch::By::kProgram);
  EXPECT_TRUE(std::any_of(notices.begin(), notices.end(), [](const std::string& notice) {
    return notice.starts_with("stimulation stopped by the program: ");
  }));
}

/// Takes what left; its receiver is away for a number of commands that are on.
class AwaySink final : public Sink {
 public:
  AwaySink(std::vector<SentCommand>& received, int away) : received_(received), away_(away) {}
  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kKinds<SentCommand>;
  }
  Expected<void, SinkError> write(const RecordBatch& batch) override {
    for (const SentCommand& sent : batch.sent) {
      is_away_ = is_away_ || (away_ > 0 && sent.command.amplitude_uA > 0.0);
      if (!is_away_) received_.push_back(sent);
      if (is_away_) --away_;
    }
    was_away_ = was_away_ || is_away_;
    is_away_ = is_away_ && away_ > 0;
    return {};
  }
  [[nodiscard]] bool interrupted() override { return std::exchange(was_away_, is_away_); }
  Expected<void, SinkError> close() override { return {}; }

 private:
  std::vector<SentCommand>& received_;
  int away_;
  bool is_away_ = false;
  bool was_away_ = false;
  std::string uri_ = "away:";
};

/// Takes its first commands once the last ones have left, and all of them are too old.
class StuckSink final : public Sink {
 public:
  StuckSink(std::vector<SentCommand>& received, std::binary_semaphore& last_left)
      : received_(received), last_left_(last_left) {}
  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kKinds<SentCommand>;
  }
  Expected<void, SinkError> write(const RecordBatch& batch) override {
    received_.insert(received_.end(), batch.sent.begin(), batch.sent.end());
    if (!std::exchange(stuck_, true)) {
      last_left_.acquire();
      std::this_thread::sleep_for(2 * StimulationOutlet::kPatience);
    }
    return {};
  }
  Expected<void, SinkError> close() override { return {}; }

 private:
  std::vector<SentCommand>& received_;
  std::binary_semaphore& last_left_;
  bool stuck_ = false;
  std::string uri_ = "stuck:";
};

/// Records the commands of the encoder and what left.
class JournalSink final : public Sink {
 public:
  /// \param last_left  released once the last command has left
  explicit JournalSink(std::vector<SentCommand>& sent, std::binary_semaphore* last_left = nullptr)
      : sent_(sent), last_left_(last_left) {}
  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kKinds<StimulationCommand, SentCommand>;
  }
  Expected<void, SinkError> write(const RecordBatch& batch) override {
    sent_.insert(sent_.end(), batch.sent.begin(), batch.sent.end());
    if (last_left_ != nullptr && !batch.sent.empty() &&
        batch.sent.back().command.stop == Stop::kEnd) {
      std::exchange(last_left_, nullptr)->release();
    }
    return {};
  }
  Expected<void, SinkError> close() override { return {}; }

 private:
  std::vector<SentCommand>& sent_;
  std::binary_semaphore* last_left_;
  std::string uri_ = "journal:";
};

TEST(Stimulation, AStopThatIsOverBeforeAnyoneLooksIsReported) {
  TactileModel model = *TactileModel::create({});
  auto encoder = *StimulationEncoder::create(
      encoding_of({electrode_at("E1", EncoderKind::kLinear, 15.0, 10.0, 5.0)}),
      encoded_model(model));
  std::vector<std::string> notices;
  Pipeline pipeline(
      model, {.fast = true, .encoder = &encoder, .on_notice = [&](const std::string& notice) {
                notices.push_back(notice);
              }});
  Random random(3);
  pipeline.add_probe(std::make_unique<MemoryProbe>(random_touch(random), 64),
                     {.stale_after = milliseconds{50}, .x_mm = 15.0, .y_mm = 10.0});
  pipeline.stimulation().stop(StimulationSwitch::By::kPage);
  pipeline.stimulation().start();
  const auto report = pipeline.run();
  ASSERT_TRUE(report);
  EXPECT_EQ(report->stimulation_stop.by, StimulationSwitch::By::kPage);
  EXPECT_EQ(report->stimulation_stopped, StimulationSwitch::By::kNone);
  EXPECT_EQ(notices, (std::vector<std::string>{
                         "stimulation stopped by the live page: all electrodes are off until it is "
                         "started again",
                         "stimulation started again: amplitudes rise from 0 within the limits"}));
}

TEST(Stimulation, AllReceiversGetTheSameAndTheRecordHasWhatLeftAndWhatASinkRefused) {
  auto electrode = electrode_at("E1", EncoderKind::kLinear, 15.0, 10.0, 5.0);
  electrode.full_force_N = 0.05;
  TactileModel model = *TactileModel::create({});
  auto encoder = *StimulationEncoder::create(encoding_of({electrode}), encoded_model(model));
  Pipeline pipeline(
      model, {.delay = milliseconds{20}, .duration = milliseconds{2000}, .encoder = &encoder});
  pipeline.add_probe(std::make_unique<DyingDevice>(), {.stale_after = std::chrono::seconds{100}});
  std::vector<SentCommand> one;
  std::vector<SentCommand> away;
  std::vector<SentCommand> journal;
  pipeline.add_sink(std::make_unique<AwaySink>(one, 0));
  pipeline.add_sink(std::make_unique<AwaySink>(away, 5));
  pipeline.add_sink(std::make_unique<JournalSink>(journal));
  const auto report = pipeline.run();
  ASSERT_TRUE(report) << report.error().sentence;
  std::vector<SentCommand> left;
  std::vector<SentCommand> refused;
  for (const SentCommand& each : journal) (each.refused_by == 0 ? left : refused).push_back(each);
  // A sink that a busy machine delays has an off of its own.
  const auto late = std::count_if(refused.begin(), refused.end(),
                                  [](const SentCommand& each) { return each.refused_by == 1; });
  ASSERT_GT(left.size(), 15U);
  EXPECT_TRUE(late > 0 || one == left);
  std::map<std::uint32_t, SentCommand> sent;
  for (const SentCommand& each : left) sent[each.command.heartbeat] = each;
  ASSERT_EQ(sent.size(), left.size());
  for (const auto* receiver : {&one, &away}) {
    for (const SentCommand& each : *receiver) {
      EXPECT_EQ(each.sent, sent.at(each.command.heartbeat).sent);
      EXPECT_EQ(each.valid_until, sent.at(each.command.heartbeat).valid_until);
      EXPECT_LE(each.command.amplitude_uA, sent.at(each.command.heartbeat).command.amplitude_uA);
    }
  }
  EXPECT_EQ(report->commands_refused, refused.size());
  EXPECT_GT(std::count_if(refused.begin(), refused.end(),
                          [](const SentCommand& each) { return each.refused_by == 2; }),
            3);
  // After it was away, an off came first.
  const auto off = std::find_if(away.begin(), away.end(), [](const SentCommand& each) {
    return each.command.stop == Stop::kSinkFailure;
  });
  ASSERT_NE(off, away.end());
  EXPECT_EQ(off->command.amplitude_uA, 0.0);
  EXPECT_TRUE(std::all_of(
      away.begin(), off, [](const SentCommand& each) { return each.command.amplitude_uA == 0.0; }));
}

TEST(Stimulation, WhatASinkRefusesAfterTheLastCommandIsCountedAndRecorded) {
  TactileModel model = *TactileModel::create({});
  auto encoder = *StimulationEncoder::create(
      encoding_of({electrode_at("E1", EncoderKind::kLinear, 15.0, 10.0, 5.0)}),
      encoded_model(model));
  Pipeline pipeline(
      model, {.delay = milliseconds{20}, .duration = milliseconds{1500}, .encoder = &encoder});
  pipeline.add_probe(std::make_unique<DyingDevice>(), {.stale_after = std::chrono::seconds{100}});
  std::vector<SentCommand> received;
  std::vector<SentCommand> journal;
  std::binary_semaphore last_left{0};
  pipeline.add_sink(std::make_unique<StuckSink>(received, last_left));
  pipeline.add_sink(std::make_unique<JournalSink>(journal, &last_left));
  const auto report = pipeline.run();
  ASSERT_TRUE(report) << report.error().sentence;
  const auto refused = std::count_if(journal.begin(), journal.end(),
                                     [](const SentCommand& each) { return each.refused_by == 1; });
  EXPECT_GT(refused, 0);
  EXPECT_EQ(report->commands_refused, static_cast<std::uint64_t>(refused));
  EXPECT_EQ(journal.size() - static_cast<std::size_t>(refused),
            received.size() + static_cast<std::size_t>(refused));
}

}  // namespace
}  // namespace merkel
