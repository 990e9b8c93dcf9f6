#include "core/encoding/stimulation_encoder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "core/records/probe_sample.hpp"
#include "tests/core/encoding/command_auditor.hpp"
#include "tests/core/encoding/random_encoding.hpp"
#include "tests/core/encoding/tick_feed.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using Kind = StimulationCommand::Kind;
using State = TickRecord::State;
using Stop = StimulationCommand::Stop;

/// An active encoder: linear, under a press of 1 N.
class Pressed : public testing::Test {
 protected:
  Pressed()
      : encoder_(*StimulationEncoder::create(
            encoding_of({electrode_at("E1", EncoderKind::kLinear, 15.0, 10.0, 3.0)}),
            grid_model())),
        feed_(encoder_, kTick) {
    feed_.press = {.contact = {.depth_mm = 0.5, .force_mN = 1000.0, .contact_radius_mm = 1.0},
                   .x_mm = 15.0,
                   .y_mm = 10.0};
    for (int k = 0; k < 15; ++k) step();
    EXPECT_EQ(last_.amplitude_uA, 80.0);
  }
  /// \return the tick's only command, if any
  std::optional<StimulationCommand> step() {
    const auto commands = feed_.step();
    if (commands.empty()) return std::nullopt;
    EXPECT_EQ(commands.size(), 1U);
    EXPECT_EQ(commands[0].heartbeat, last_.heartbeat + 1);
    return last_ = commands[0];
  }

  StimulationEncoder encoder_;
  TickFeed feed_;
  StimulationCommand last_;
};

TEST_F(Pressed, UpdatesOnItsGrid) {
  std::vector<std::int64_t> times_ms;
  for (int k = 0; k < 30; ++k) {
    if (const auto command = step()) times_ms.push_back(command->time / milliseconds{1});
  }
  EXPECT_EQ(times_ms, (std::vector<std::int64_t>{21, 31, 41}));
}

TEST_F(Pressed, ReleaseStopsItWithinTheTickUntilTheProbeIsBack) {
  feed_.state = State::kReleased;
  auto command = step();
  ASSERT_TRUE(command);
  EXPECT_EQ(command->amplitude_uA, 0.0);
  EXPECT_EQ(command->stop, Stop::kReleased);
  for (int k = 0; k < 20; ++k) {
    command = step();
    EXPECT_TRUE(!command || command->stop == Stop::kReleased);
  }
  feed_.state = State::kFollowing;
  for (int k = 0; k < 10; ++k) step();
  EXPECT_EQ(last_.amplitude_uA, 80.0);
  EXPECT_EQ(last_.stop, Stop::kNone);
  EXPECT_EQ(encoder_.stops(), 1U);
}

TEST_F(Pressed, ADoubtSuspendsItWithItsReasonWithinTheTick) {
  const std::pair<std::uint8_t, Stop> reasons[] = {
      {ProbeSample::kZeroUncertain, Stop::kZeroUncertain},
      {ProbeSample::kOutsideCalibration, Stop::kOutsideCalibration},
      {ProbeSample::kAllDoubts, Stop::kZeroUncertain}};
  for (const auto& [doubts, reason] : reasons) {
    feed_.doubts = doubts;
    const auto command = step();
    ASSERT_TRUE(command);
    EXPECT_EQ(command->amplitude_uA, 0.0);
    EXPECT_EQ(command->stop, reason);
    for (int k = 0; k < 20; ++k) step();
    EXPECT_EQ(last_.stop, reason);
    EXPECT_EQ(last_.amplitude_uA, 0.0);
    feed_.doubts = 0;
    for (int k = 0; k < 10; ++k) step();
    EXPECT_EQ(last_.amplitude_uA, 80.0);
    EXPECT_EQ(last_.stop, Stop::kNone);
  }
}

TEST_F(Pressed, ASilentProbeIsReleasedAlsoIfItIsDoubted) {
  feed_.doubts = ProbeSample::kZeroUncertain;
  feed_.state = State::kReleased;
  ASSERT_TRUE(step());
  EXPECT_EQ(last_.stop, Stop::kReleased);
}

TEST_F(Pressed, AfterAResetAReleaseIsAStopAgain) {
  feed_.state = State::kReleased;
  ASSERT_TRUE(step());
  EXPECT_EQ(encoder_.stops(), 1U);
  encoder_.reset();
  EXPECT_EQ(encoder_.stops(), 0U);
  TickFeed again(encoder_, kTick);
  again.state = State::kReleased;
  EXPECT_EQ(again.step()[0].stop, Stop::kReleased);
  EXPECT_EQ(encoder_.stops(), 1U);
}

TEST_F(Pressed, AHeldSampleDoesNotStopItButAnEndedRecordingDoes) {
  feed_.state = State::kHeld;
  for (int k = 0; k < 20; ++k) step();
  EXPECT_EQ(last_.amplitude_uA, 80.0);
  feed_.state = State::kEnded;
  ASSERT_TRUE(step());
  EXPECT_EQ(last_.amplitude_uA, 0.0);
  EXPECT_EQ(last_.stop, Stop::kReleased);
}

TEST_F(Pressed, AGapStopsItAndItsGridContinues) {
  feed_.skip(100);
  ASSERT_TRUE(step());
  EXPECT_EQ(last_.amplitude_uA, 0.0);
  EXPECT_EQ(last_.stop, Stop::kGap);
  EXPECT_EQ(last_.time, milliseconds{116});
  std::vector<std::int64_t> times_ms;
  for (int k = 0; k < 20; ++k) {
    if (const auto command = step()) times_ms.push_back(command->time / milliseconds{1});
  }
  EXPECT_EQ(times_ms, (std::vector<std::int64_t>{121, 131}));
  EXPECT_EQ(last_.amplitude_uA, 80.0);
}

TEST_F(Pressed, AResetNeuronStopsIt) {
  feed_.resets = {{.time = feed_.now(), .neuron = 17}};
  ASSERT_TRUE(step());
  EXPECT_EQ(last_.amplitude_uA, 0.0);
  EXPECT_EQ(last_.stop, Stop::kNeuronReset);
  for (int k = 0; k < 10; ++k) step();
  EXPECT_EQ(last_.amplitude_uA, 80.0);
}

TEST_F(Pressed, AFailedSinkStopsItForGood) {
  encoder_.fail_safe(Stop::kSinkFailure);
  ASSERT_TRUE(step());
  for (int k = 0; k < 50; ++k) {
    EXPECT_EQ(last_.amplitude_uA, 0.0);
    EXPECT_EQ(last_.stop, Stop::kSinkFailure);
    step();
  }
}

TEST_F(Pressed, EndsWithEverythingOff) {
  const auto commands = encoder_.finish();
  ASSERT_EQ(commands.size(), 1U);
  EXPECT_EQ(commands[0].amplitude_uA, 0.0);
  EXPECT_EQ(commands[0].stop, Stop::kEnd);
  EXPECT_EQ(commands[0].time, feed_.now());
  EXPECT_EQ(commands[0].heartbeat, last_.heartbeat + 1);
}

TEST(StimulationEncoder, EndsWithoutCommandsIfThereWasNoTick) {
  auto encoder = *StimulationEncoder::create(
      encoding_of({electrode_at("E1", EncoderKind::kLinear, 15.0, 10.0, 3.0)}), grid_model());
  EXPECT_TRUE(encoder.finish().empty());
}

TEST_F(Pressed, ResetStartsAgain) {
  encoder_.fail_safe(Stop::kSinkFailure);
  encoder_.reset();
  TickFeed again(encoder_, kTick);
  again.press = feed_.press;
  const auto commands = again.step();
  ASSERT_EQ(commands.size(), 1U);
  EXPECT_EQ(commands[0].heartbeat, 1U);
  EXPECT_EQ(commands[0].amplitude_uA, 80.0);
}

TEST(StimulationEncoder, StopsOnlyThePatchOfTheFault) {
  const EncodedModel model = two_patch_model();
  auto second = electrode_at("E2", EncoderKind::kLinear, 15.0, 10.0, 3.0);
  second.patch = 1;
  auto encoder = *StimulationEncoder::create(
      encoding_of({electrode_at("E1", EncoderKind::kLinear, 15.0, 10.0, 3.0), second}), model);
  const Press press{.contact = {.depth_mm = 0.5, .force_mN = 500.0}, .x_mm = 15.0, .y_mm = 10.0};
  const std::vector presses = {press, press};
  const std::vector<TickRecord> records = {{.time = kTick, .probe = 0, .state = State::kReleased},
                                           {.time = kTick, .probe = 1}};
  const auto commands = encoder.step({.records = records, .presses = presses});
  ASSERT_EQ(commands.size(), 2U);
  EXPECT_EQ(commands[0].stop, Stop::kReleased);
  EXPECT_EQ(commands[0].amplitude_uA, 0.0);
  EXPECT_EQ(commands[1].stop, Stop::kNone);
  EXPECT_EQ(commands[1].amplitude_uA, 50.0);
}

TEST(StimulationEncoder, ADoubtedProbeSuspendsItsPatchAndNoOther) {
  EncodedModel model = two_patch_model();
  model.patch_of_probe = {0, 0, 1};
  auto second = electrode_at("E2", EncoderKind::kLinear, 15.0, 10.0, 3.0);
  second.patch = 1;
  auto encoder = *StimulationEncoder::create(
      encoding_of({electrode_at("E1", EncoderKind::kLinear, 15.0, 10.0, 3.0), second}), model);
  const Press press{.contact = {.depth_mm = 0.5, .force_mN = 500.0}, .x_mm = 15.0, .y_mm = 10.0};
  const std::vector presses = {press, press, press};
  // The doubt of the first probe is not lifted by the second, which presses on the same patch.
  const std::vector<TickRecord> records = {
      {.time = kTick, .probe = 0, .doubts = ProbeSample::kOutsideCalibration},
      {.time = kTick, .probe = 1},
      {.time = kTick, .probe = 2}};
  const auto commands = encoder.step({.records = records, .presses = presses});
  ASSERT_EQ(commands.size(), 2U);
  EXPECT_EQ(commands[0].stop, Stop::kOutsideCalibration);
  EXPECT_EQ(commands[0].amplitude_uA, 0.0);
  EXPECT_EQ(commands[1].stop, Stop::kNone);
  EXPECT_EQ(commands[1].amplitude_uA, 50.0);
}

TEST(StimulationEncoder, ALowFrequencyIsOneToo) {
  auto slow = electrode_at("E1", EncoderKind::kLinear, 15.0, 10.0, 3.0);
  slow.frequency_Hz = {0.0, 2.0};
  auto encoder = *StimulationEncoder::create(encoding_of({slow}), grid_model());
  TickFeed feed(encoder, kTick);
  feed.press = {.contact = {.depth_mm = 0.5, .force_mN = 250.0, .contact_radius_mm = 1.0},
                .x_mm = 15.0,
                .y_mm = 10.0};
  const auto commands = feed.step();
  ASSERT_EQ(commands.size(), 1U);
  EXPECT_EQ(commands[0].frequency_Hz, 0.5);
  EXPECT_EQ(commands[0].amplitude_uA, 35.0);
}

TEST(StimulationEncoder, ADepthThatIsNotANumberWinsOverEveryOther) {
  EncodedModel model = grid_model();
  model.patch_of_probe = {0, 0};
  const auto press = [](double depth_mm) {
    return Press{.contact = {.depth_mm = depth_mm}, .x_mm = 15.0, .y_mm = 10.0};
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<TickRecord> records = {{.time = kTick, .probe = 0},
                                           {.time = kTick, .probe = 1}};
  for (const auto& presses : {std::vector{press(nan), press(1.0)}, {press(1.0), press(nan)}}) {
    auto encoder = *StimulationEncoder::create(
        encoding_of({electrode_at("E1", EncoderKind::kOkorokova, 15.0, 10.0, 3.0)}), model);
    const auto commands = encoder.step({.records = records, .presses = presses});
    ASSERT_EQ(commands.size(), 1U);
    EXPECT_EQ(commands[0].amplitude_uA, 0.0);
    EXPECT_EQ(encoder.clippings().invalid, 1U);
  }
}

TEST(StimulationEncoder, ARunThatStartsInTheMiddleOfAGraspCommandsNoOnset) {
  auto encoder = *StimulationEncoder::create(
      encoding_of({electrode_at("E1", EncoderKind::kOkorokova, 15.0, 10.0, 3.0)}), grid_model());
  TickFeed feed(encoder, kTick);
  feed.press = {.contact = {.depth_mm = 1.5}, .x_mm = 15.0, .y_mm = 10.0};
  std::vector<double> amplitudes_uA;
  for (int k = 0; k < 200; ++k) {
    for (const auto& command : feed.step()) amplitudes_uA.push_back(command.amplitude_uA);
  }
  ASSERT_EQ(amplitudes_uA.size(), 20U);
  for (const double amplitude_uA : amplitudes_uA) EXPECT_EQ(amplitude_uA, amplitudes_uA.back());
  // A press that begins later has one.
  feed.press.contact.depth_mm = 0.0;
  for (int k = 0; k < 200; ++k) feed.step();
  feed.press.contact.depth_mm = 1.5;
  double largest_uA = 0.0;
  for (int k = 0; k < 30; ++k) {
    for (const auto& command : feed.step()) largest_uA = std::max(largest_uA, command.amplitude_uA);
  }
  EXPECT_GT(largest_uA, 1.1 * amplitudes_uA.back());
}

TEST(StimulationEncoder, TheSpikesOfAGraspThatWasThereBeforeTheRunAreNoOnset) {
  for (const EncoderKind kind :
       {EncoderKind::kRate, EncoderKind::kRecruited, EncoderKind::kPulsePerSpike}) {
    for (const bool pressed : {true, false}) {
      auto encoder = *StimulationEncoder::create(
          encoding_of({electrode_at("E1", kind, 15.0, 10.0, 3.0)}), grid_model());
      TickFeed feed(encoder, kTick, milliseconds{1000});
      if (pressed) {
        feed.press = {
            .contact = {.depth_mm = 1.0, .contact_radius_mm = 1.0}, .x_mm = 15.0, .y_mm = 10.0};
      }
      double early_uA = 0.0;
      double late_uA = 0.0;
      for (int k = 0; k < 100; ++k) {
        for (std::uint32_t neuron = 1; neuron <= 600; ++neuron) feed.spike(nanoseconds{1}, neuron);
        for (const auto& command : feed.step()) {
          double& largest_uA = k < 50 ? early_uA : late_uA;
          largest_uA = std::max(largest_uA, command.amplitude_uA);
        }
      }
      EXPECT_EQ(early_uA > 0.0, !pressed);
      EXPECT_GT(late_uA, 0.0);
    }
  }
}

TEST(StimulationEncoder, OfSeveralGraspsThatWereThereBeforeTheRunNoneIsAnOnset) {
  const EncodedModel model = two_patch_model();
  auto of_second = electrode_at("E1", EncoderKind::kPulsePerSpike, 15.0, 10.0, 3.0);
  of_second.patch = 1;
  auto encoder = *StimulationEncoder::create(encoding_of({of_second}), model);
  const Press press{
      .contact = {.depth_mm = 1.0, .contact_radius_mm = 1.0}, .x_mm = 15.0, .y_mm = 10.0};
  const std::vector presses = {press, press};
  std::size_t early = 0;
  std::size_t late = 0;
  for (int k = 1; k <= 100; ++k) {
    const nanoseconds end = k * kTick;
    const std::vector<TickRecord> records = {{.time = end, .probe = 0}, {.time = end, .probe = 1}};
    std::vector<SpikeEvent> spikes;
    for (std::uint32_t neuron = 601; neuron <= 1200; ++neuron) {
      spikes.push_back({.time = end, .neuron = neuron, .patch = 1});
    }
    for (const auto& command :
         encoder.step({.records = records, .presses = presses, .spikes = spikes})) {
      (k <= 50 ? early : late) += command.kind == Kind::kPulse ? 1 : 0;
    }
  }
  EXPECT_EQ(early, 0U);
  EXPECT_GT(late, 0U);
}

TEST(StimulationEncoder, ClearsItsHistoryAtAFault) {
  for (const EncoderKind kind :
       {EncoderKind::kRate, EncoderKind::kRecruited, EncoderKind::kOkorokova}) {
    Electrode electrode = electrode_at("E1", kind, 15.0, 10.0, 3.0);
    electrode.window = std::chrono::seconds{1};
    auto encoder = *StimulationEncoder::create(encoding_of({electrode}), grid_model());
    TickFeed feed(encoder, kTick);
    double before_uA = 0.0;
    double after_uA = 0.0;
    for (int k = 0; k < 50; ++k) {
      for (std::uint32_t neuron = 1; neuron <= 600; ++neuron) feed.spike(nanoseconds{1}, neuron);
      feed.press = {.contact = {.depth_mm = k < 40 ? 0.0 : 1.0}, .x_mm = 15.0, .y_mm = 10.0};
      for (const auto& command : feed.step()) before_uA = command.amplitude_uA;
    }
    feed.skip(5);
    feed.press = {};
    for (int k = 0; k < 120; ++k) {
      for (const auto& command : feed.step()) after_uA = std::max(after_uA, command.amplitude_uA);
    }
    EXPECT_GT(before_uA, 20.0);
    EXPECT_EQ(after_uA, 0.0);
  }
}

TEST(StimulationEncoder, CountsTheSpikesOfItsOwnPatch) {
  TactileModel::Parameters parameters;
  parameters.patches.push_back(parameters.patches.front());
  parameters.indenters.push_back({.patch = 1});
  parameters.network.gain = 0.0;
  auto model = *TactileModel::create(parameters);
  auto first = electrode_at("E1", EncoderKind::kRate, 15.0, 10.0, 8.0);
  auto second = first;
  second.name = "E2";
  second.patch = 1;
  auto encoder = *StimulationEncoder::create(encoding_of({first, second}), encoded_model(model));
  std::vector<ContactInput> contacts(2, {.x_mm = 15.0, .y_mm = 10.0});
  contacts[1].depth_mm = 1.5;
  double first_uA = 0.0;
  double second_uA = 0.0;
  for (int k = 0; k < 300; ++k) {
    const auto spikes = model.step(contacts, k * kTick);
    const std::vector<TickRecord> records = {{.time = (k + 1) * kTick, .probe = 0},
                                             {.time = (k + 1) * kTick, .probe = 1}};
    for (const auto& command : encoder.step({.records = records,
                               .presses = model.presses(),
                               .spikes = spikes,
                               .resets = model.resets()})) {
      double& strongest = command.electrode == 0 ? first_uA : second_uA;
      strongest = std::max(strongest, command.amplitude_uA);
    }
  }
  EXPECT_EQ(first_uA, 0.0);
  EXPECT_GT(second_uA, 20.0);
}

/// A random scene with random ticks and every kind of fault, checked by the auditor.
class RandomScene {
 public:
  explicit RandomScene(std::uint64_t seed)
      : random_(seed), parameters_(random_encoding(random_, 1.0)) {}

  /// \return the error, or an empty string
  std::string run() {
    auto created = StimulationEncoder::create(parameters_, grid_model());
    if (!created) return created.error().key + " " + created.error().reason;
    StimulationEncoder& encoder = *created;
    TickFeed feed(encoder, kTick);
    CommandAuditor auditor = auditor_of(parameters_);
    nanoseconds last_update{0};
    bool latched = false;
    for (int tick = 0; tick < 250; ++tick) {
      bool fault = disturb(feed, tick > 0) || latched;
      if (tick == 200 && random_.uniform() < 0.3) {
        encoder.fail_safe(Stop::kSinkFailure);
        fault = latched = true;
      }
      const auto commands = feed.step();
      if (auto wrong = audit(commands, auditor, fault); !wrong.empty()) return wrong;
      if (!commands.empty() && commands.back().kind == Kind::kUpdate) {
        if (commands.back().heartbeat != ++heartbeat_) return "a heartbeat is missing";
        last_update = feed.now();
      }
      if (feed.now() - last_update >= parameters_.stimulation.update) return "an update is late";
    }
    on_ = auditor.most_total_uA() > 0.0;
    return audit(encoder.finish(), auditor, true);
  }
  /// Whether anything was ever switched on.
  [[nodiscard]] bool on() const { return on_; }

 private:
  /// Prepares the next tick's input.
  /// \return whether it contains a fault
  bool disturb(TickFeed& feed, bool running) {
    const auto happens = [&](double probability) { return random_.uniform() < probability; };
    if (happens(0.02)) released_ = !released_;
    feed.state = released_ ? State::kReleased : happens(0.05) ? State::kHeld : State::kFollowing;
    if (happens(0.05)) pressed_ = !pressed_;
    feed.press = {};
    if (pressed_ && !released_) {
      feed.press = {
          .contact = {.depth_mm = value(2.0), .force_mN = value(2000.0), .contact_radius_mm = 1.0},
          .x_mm = value(30.0),
          .y_mm = value(20.0)};
    }
    const bool gap = happens(0.02);
    if (gap) feed.skip(1 + static_cast<int>(random_.next() % 200));
    const bool reset = happens(0.02);
    if (reset) feed.resets.push_back({.time = feed.now(), .neuron = 1});
    for (std::uint32_t neuron = 1; neuron <= 600; ++neuron) {
      if (!happens(pressed_ ? 0.08 : 0.005)) continue;
      feed.spike(nanoseconds{static_cast<std::int64_t>(random_.next() % 1'000'000)}, neuron);
    }
    std::sort(feed.spikes.begin(), feed.spikes.end());
    return released_ || reset || (gap && running);
  }
  double value(double most) {
    const double kind = random_.uniform();
    if (kind < 0.02) return std::numeric_limits<double>::quiet_NaN();
    if (kind < 0.04) return std::numeric_limits<double>::infinity();
    if (kind < 0.05) return 1e300;
    return random_.uniform(0.0, most);
  }
  static std::string audit(std::span<const StimulationCommand> commands, CommandAuditor& auditor,
                           bool fault) {
    auditor.take(commands);
    if (!auditor.fault().empty()) return auditor.fault();
    if (!fault) return "";
    for (const auto& command : commands) {
      if (command.amplitude_uA != 0.0) return "an electrode is on in the tick of a fault";
      if (command.stop == Stop::kNone) return "a fault has no stop reason";
    }
    for (std::size_t e = 0; e < commands.size(); ++e) {
      if (auditor.train_uA(e) != 0.0) return "a train continues after a fault";
    }
    return "";
  }

  Random random_;
  EncodingParameters parameters_;
  bool released_ = false;
  bool pressed_ = false;
  bool on_ = false;
  std::uint32_t heartbeat_ = 0;
};

TEST(StimulationEncoder, KeepsEveryLimitAndStopsAtEveryFault) {
  int on = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    RandomScene scene(seed);
    ASSERT_EQ(scene.run(), "") << "seed " << seed;
    on += scene.on() ? 1 : 0;
  }
  EXPECT_GT(on, 190);
}

TEST(StimulationEncoder, AnOwnDriveStaysWithinTheRangesAndTheLimits) {
  auto parameters = encoding_of({electrode_at("E1", EncoderKind::kOwn, 15.0, 10.0, 3.0)});
  parameters.stimulation.max_slope_uA_per_s = 2000.0;
  auto encoder = *StimulationEncoder::create(parameters, grid_model());
  TickFeed feed(encoder, kTick);
  const auto next = [&] {
    StimulationCommand last;
    for (int k = 0; k < 10; ++k) {
      for (const auto& command : feed.step()) last = command;
    }
    return last;
  };
  const auto set_drive = [&](double amplitude, double frequency) {
    encoder.set_drive({.time = feed.now() + kTick, .amplitude = amplitude, .frequency = frequency});
  };
  EXPECT_EQ(next().stop, Stop::kNoDrive);
  set_drive(5.0, 0.5);
  EXPECT_DOUBLE_EQ(next().amplitude_uA, 20.0);  // 2000 µA/s for 10 ms
  EXPECT_DOUBLE_EQ(next().amplitude_uA, 40.0);
  next();
  const auto strongest = next();
  EXPECT_DOUBLE_EQ(strongest.amplitude_uA, 80.0);
  EXPECT_DOUBLE_EQ(strongest.frequency_Hz, 100.0);
  set_drive(std::nan(""), 0.5);
  EXPECT_EQ(next().amplitude_uA, 0.0);
  EXPECT_EQ(encoder.clippings().invalid, 1U);
  set_drive(-1.0, 1.0);
  EXPECT_EQ(next().amplitude_uA, 0.0);
  encoder.set_drive(
      {.time = feed.now() + kTick, .amplitude = 1.0, .electrode = 1});  // there is none
  EXPECT_EQ(next().amplitude_uA, 0.0);
  set_drive(1.0, 1.0);
  feed.state = State::kReleased;
  EXPECT_EQ(next().amplitude_uA, 0.0);
  encoder.reset();
  feed.state = State::kFollowing;
  EXPECT_EQ(next().stop, Stop::kNoDrive);
}

TEST(StimulationEncoder, ANegativeFrequencyOfAnOwnDriveIsTheWeakest) {
  auto parameters = encoding_of({electrode_at("E1", EncoderKind::kOwn, 15.0, 10.0, 3.0)});
  parameters.electrodes[0].frequency_Hz = {50.0, 200.0};
  auto encoder = *StimulationEncoder::create(parameters, grid_model());
  TickFeed feed(encoder, kTick);
  encoder.set_drive({.time = feed.now() + kTick, .amplitude = 1.0, .frequency = -0.2});
  EXPECT_DOUBLE_EQ(feed.step().back().frequency_Hz, 50.0);
}

TEST(StimulationEncoder, AnOwnDriveHoldsForTheWatchdogOnly) {
  auto encoder = *StimulationEncoder::create(
      encoding_of({electrode_at("E1", EncoderKind::kOwn, 15.0, 10.0, 3.0),
                   electrode_at("E2", EncoderKind::kOwn, 15.0, 10.0, 3.0),
                   electrode_at("E3", EncoderKind::kLinear, 15.0, 10.0, 3.0)}),
      grid_model());
  TickFeed feed(encoder, kTick);
  for (std::uint16_t electrode = 0; electrode < 2; ++electrode) {
    encoder.set_drive(
        {.time = feed.now() + kTick, .amplitude = 1.0, .frequency = 1.0, .electrode = electrode});
  }
  for (int ms = 1; ms <= 200; ++ms) {
    if (ms == 50) encoder.set_drive({.time = milliseconds{50}, .amplitude = 1.0, .frequency = 1.0});
    for (const StimulationCommand& command : feed.step()) {
      if (command.electrode == 2) {
        EXPECT_EQ(command.stop, Stop::kNone);  // it has no drive of this kind
        continue;
      }
      // A drive of 1 ms holds before 101 ms, that of 50 ms before 150 ms.
      const bool on = ms < (command.electrode == 0 ? 150 : 101);
      EXPECT_EQ(command.amplitude_uA > 0.0, on) << ms << " " << command.electrode;
      EXPECT_EQ(command.stop, on ? Stop::kNone : Stop::kNoDrive) << ms;
    }
  }
}

TEST(StimulationEncoder, WhatTheStimulatorCannotGiveIsRoundedAway) {
  auto parameters = encoding_of({electrode_at("E1", EncoderKind::kOwn, 15.0, 10.0, 3.0),
                                 electrode_at("E2", EncoderKind::kPulsePerSpike, 15.0, 10.0, 3.0)});
  parameters.electrodes[1].amplitude_uA = {0.0, 30.5};
  parameters.stimulator.name = "box";
  parameters.stimulator.amplitude_step_uA = 1.0;
  parameters.stimulator.frequency_step_Hz = 1.0;
  auto encoder = *StimulationEncoder::create(parameters, grid_model());
  TickFeed feed(encoder, kTick);
  encoder.set_drive({.time = kTick, .amplitude = 0.51, .frequency = 0.5025});
  feed.spike(nanoseconds{1}, 10 * 30 + 15);
  const auto commands = feed.step();
  ASSERT_EQ(commands.size(), 3U);
  EXPECT_EQ(commands[0].amplitude_uA, 30.0);
  EXPECT_EQ(commands[1].amplitude_uA, 50.0);   // 50.6
  EXPECT_EQ(commands[1].frequency_Hz, 100.0);  // 100.5
  EXPECT_EQ(encoder.rounding().rounded, 2U);
  EXPECT_NEAR(encoder.rounding().largest_uA, 0.6, 1e-9);
  EXPECT_NEAR(encoder.rounding().largest_Hz, 0.5, 1e-9);
  // A pulse below the weakest amplitude is none.
  parameters.stimulator.min_amplitude_uA = 31.0;
  auto none = *StimulationEncoder::create(parameters, grid_model());
  TickFeed again(none, kTick);
  again.spike(nanoseconds{1}, 10 * 30 + 15);
  EXPECT_EQ(again.step().size(), 2U);
}

TEST(StimulationEncoder, IsDeterministic) {
  const auto run = [] {
    auto encoder = *StimulationEncoder::create(
        encoding_of({electrode_at("E1", EncoderKind::kRate, 15.0, 10.0, 3.0),
                     electrode_at("E2", EncoderKind::kPulsePerSpike, 15.0, 10.0, 3.0)}),
        grid_model());
    TickFeed feed(encoder, kTick);
    Random random(3);
    std::vector<StimulationCommand> all;
    for (int k = 0; k < 200; ++k) {
      for (int i = 0; i < 20; ++i) {
        feed.spike(nanoseconds{i * 50'000}, static_cast<std::uint32_t>(1 + random.next() % 600));
      }
      const auto commands = feed.step();
      all.insert(all.end(), commands.begin(), commands.end());
    }
    return all;
  };
  EXPECT_EQ(run(), run());
}

}  // namespace
}  // namespace merkel
