#include "core/encoding/stimulation_limiter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/encoding/encoding_parameters.hpp"
#include "core/math/random.hpp"
#include "tests/core/encoding/command_auditor.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using Kind = StimulationCommand::Kind;
using Stop = StimulationCommand::Stop;
using Limits = StimulationLimiter::Limits;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr Limits kWide{.max_total_uA = 1e6};

std::vector<StimulationCommand> update_of(nanoseconds time, const std::vector<double>& amplitudes,
                                          double frequency_Hz = 100.0) {
  std::vector<StimulationCommand> update;
  for (std::size_t e = 0; e < amplitudes.size(); ++e) {
    update.push_back({.time = time,
                      .amplitude_uA = amplitudes[e],
                      .frequency_Hz = frequency_Hz,
                      .electrode = static_cast<std::uint16_t>(e)});
  }
  return update;
}

std::vector<double> limited(StimulationLimiter& limiter, nanoseconds time,
                            const std::vector<double>& amplitudes) {
  auto update = update_of(time, amplitudes);
  limiter.limit_update(update);
  std::vector<double> result;
  for (const auto& command : update) result.push_back(command.amplitude_uA);
  return result;
}

StimulationCommand pulse(nanoseconds time, double amplitude_uA, std::uint16_t electrode = 0) {
  return {.time = time, .amplitude_uA = amplitude_uA, .electrode = electrode, .kind = Kind::kPulse};
}

TEST(StimulationLimiter, LeavesValidCommandsUnchanged) {
  // 16 nC are 80 µA for 200 µs.
  StimulationLimiter limiter(kWide, {{80.0, 200.0, microseconds{200}, 16.0}, {60.0, 200.0}});
  limiter.reset(nanoseconds{0});
  EXPECT_EQ(limited(limiter, milliseconds{10}, {80.0, 33.3}), (std::vector{80.0, 33.3}));
  auto weak = update_of(milliseconds{20}, {0.5, 0.0});
  limiter.limit_update(weak);
  EXPECT_EQ(weak[0].frequency_Hz, 100.0);
  EXPECT_EQ(weak[1].frequency_Hz, 0.0);
  EXPECT_EQ(limiter.clippings(), StimulationLimiter::Clippings{});
}

TEST(StimulationLimiter, TheChargeIsKeptBelowAMicroampereToo) {
  const nanoseconds phase = microseconds{200};
  int rounded_up = 0;
  for (int k = 1; k <= 1000; ++k) {
    const double most_nC = 1e-4 * k;
    StimulationLimiter limiter(kWide, {{80.0, 200.0, phase, most_nC}});
    limiter.reset(nanoseconds{0});
    const double amplitude_uA = limited(limiter, milliseconds{10}, {80.0})[0];
    const double quotient_uA = most_nC * 1e3 / 200.0;
    rounded_up += charge_nC(quotient_uA, phase) > most_nC ? 1 : 0;
    ASSERT_LE(charge_nC(amplitude_uA, phase), most_nC);
    ASSERT_NEAR(amplitude_uA, quotient_uA, 1e-15);
  }
  EXPECT_GT(rounded_up, 0);
}

TEST(StimulationLimiter, PulsesBelowAMicroampereAreKept) {
  StimulationLimiter limiter(kWide, {{80.0, 200.0}});
  limiter.reset(nanoseconds{0});
  std::vector pulses = {pulse(milliseconds{1}, 0.5)};
  ASSERT_EQ(limiter.limit_pulses(pulses, nanoseconds{0}), 1U);
  EXPECT_EQ(pulses[0].amplitude_uA, 0.5);
  std::vector off = {pulse(milliseconds{9}, 0.0), pulse(milliseconds{10}, kNan)};
  EXPECT_EQ(limiter.limit_pulses(off, milliseconds{8}), 0U);
}

TEST(StimulationLimiter, APulseRisesFromTheLastOneAcrossUpdates) {
  StimulationLimiter limiter(kWide,
                             {{.max_uA = 80.0, .max_Hz = 200.0, .max_slope_uA_per_s = 1000.0}});
  limiter.reset(nanoseconds{0});
  std::vector pulses = {pulse(milliseconds{10}, 80.0)};
  ASSERT_EQ(limiter.limit_pulses(pulses, milliseconds{9}), 1U);
  EXPECT_DOUBLE_EQ(pulses[0].amplitude_uA, 10.0);
  limited(limiter, milliseconds{11}, {0.0});
  pulses = {pulse(milliseconds{20}, 80.0)};
  ASSERT_EQ(limiter.limit_pulses(pulses, milliseconds{19}), 1U);
  EXPECT_DOUBLE_EQ(pulses[0].amplitude_uA, 20.0);
}

TEST(StimulationLimiter, TwoWeakPulsesOfATickAreOfOneElectrode) {
  StimulationLimiter limiter({.max_total_uA = 1e6, .max_electrodes = 1},
                             {{80.0, 1e4}, {80.0, 1e4}});
  limiter.reset(nanoseconds{0});
  std::vector pulses = {pulse(microseconds{200}, 0.5), pulse(microseconds{400}, 0.5, 1),
                        pulse(microseconds{600}, 0.5)};
  ASSERT_EQ(limiter.limit_pulses(pulses, nanoseconds{0}), 2U);
  EXPECT_EQ(pulses[1].electrode, 0);
  EXPECT_EQ(limiter.clippings().electrodes, 1U);
}

TEST(StimulationLimiter, AmplitudesRiseFromTheTimeOfAReset) {
  StimulationLimiter limiter(kWide,
                             {{.max_uA = 80.0, .max_Hz = 200.0, .max_slope_uA_per_s = 1000.0}});
  limiter.reset(milliseconds{1000});
  EXPECT_NEAR(limited(limiter, milliseconds{1010}, {80.0})[0], 10.0, 1e-9);
  limiter.reset(milliseconds{2000});
  EXPECT_NEAR(limited(limiter, milliseconds{2010}, {80.0})[0], 10.0, 1e-9);
}

TEST(StimulationLimiter, PulsesMayReachTheTotal) {
  StimulationLimiter limiter({.max_total_uA = 100.0}, {{80.0, 200.0}, {80.0, 200.0}});
  limiter.reset(nanoseconds{0});
  std::vector pulses = {pulse(milliseconds{1}, 60.0), pulse(milliseconds{1}, 40.0, 1)};
  ASSERT_EQ(limiter.limit_pulses(pulses, nanoseconds{0}), 2U);
  EXPECT_EQ(pulses[0].amplitude_uA, 60.0);
  EXPECT_EQ(limiter.clippings().all(), 0U);
}

TEST(StimulationLimiter, TrainsBelowAMicroampereShareTheTotalWithPulses) {
  const auto scaled = [](double train_uA, StimulationLimiter::Clippings& clippings) {
    StimulationLimiter limiter({.max_total_uA = 100.0},
                               {{80.0, 200.0}, {80.0, 200.0}, {80.0, 200.0}});
    limiter.reset(nanoseconds{0});
    std::vector pulses = {pulse(milliseconds{1}, 80.0), pulse(milliseconds{1}, 80.0, 1)};
    EXPECT_EQ(limiter.limit_pulses(pulses, nanoseconds{0}), 2U);
    const double left_uA = limited(limiter, milliseconds{10}, {0.0, 0.0, train_uA})[2];
    clippings = limiter.clippings();
    return left_uA;
  };
  StimulationLimiter::Clippings clippings;
  EXPECT_NEAR(scaled(0.5, clippings), 0.5 * 100.0 / 160.5, 1e-9);
  EXPECT_EQ(clippings.total, 2U);  // the pulses, and the trains
  EXPECT_EQ(scaled(0.0, clippings), 0.0);
  EXPECT_EQ(clippings.total, 1U);
}

TEST(StimulationLimiter, ClipsAmplitudeChargeAndFrequency) {
  const nanoseconds phase = microseconds{200};
  StimulationLimiter limiter(kWide, {{80.0, 200.0, phase, 10.0}, {40.0, 200.0, phase, 10.0}});
  limiter.reset(nanoseconds{0});
  auto update = update_of(milliseconds{10}, {90.0, 90.0}, 300.0);
  limiter.limit_update(update);
  EXPECT_EQ(update[0].amplitude_uA, 50.0);  // 10 nC in 200 µs
  EXPECT_EQ(update[1].amplitude_uA, 40.0);
  EXPECT_EQ(update[0].frequency_Hz, 200.0);
  EXPECT_EQ(limiter.clippings().amplitude, 2U);
  EXPECT_EQ(limiter.clippings().charge, 1U);
  EXPECT_EQ(limiter.clippings().frequency, 2U);
}

TEST(StimulationLimiter, SwitchesOffNonFiniteValues) {
  StimulationLimiter limiter(kWide, {{80.0, 200.0}});
  limiter.reset(nanoseconds{0});
  for (const double bad : {kNan, kInfinity, -kInfinity, -1.0}) {
    EXPECT_EQ(limited(limiter, milliseconds{10}, {bad}), std::vector{0.0});
    auto update = update_of(milliseconds{10}, {10.0}, bad);
    limiter.limit_update(update);
    EXPECT_EQ(update[0].amplitude_uA, 0.0);
    EXPECT_EQ(update[0].frequency_Hz, 0.0);
  }
  EXPECT_EQ(limiter.clippings().invalid, 8U);
}

TEST(StimulationLimiter, LimitsRisesButNotFalls) {
  StimulationLimiter limiter(kWide,
                             {{.max_uA = 80.0, .max_Hz = 200.0, .max_slope_uA_per_s = 2000.0}});
  limiter.reset(nanoseconds{0});
  EXPECT_EQ(limited(limiter, milliseconds{10}, {80.0}), std::vector{20.0});
  EXPECT_EQ(limited(limiter, milliseconds{20}, {80.0}), std::vector{40.0});
  EXPECT_EQ(limited(limiter, milliseconds{30}, {0.0}), std::vector{0.0});
  EXPECT_EQ(limited(limiter, milliseconds{35}, {80.0}), std::vector{10.0});
  EXPECT_EQ(limiter.clippings().slope, 3U);
}

TEST(StimulationLimiter, EachElectrodeHasItsOwnLimits) {
  StimulationLimiter limiter(
      kWide, {{80.0, 200.0, microseconds{200}, 10.0}, {80.0, 200.0, microseconds{400}, 10.0, 1e4}});
  limiter.reset(nanoseconds{0});
  EXPECT_EQ(limited(limiter, milliseconds{1}, {80.0, 80.0}), (std::vector{50.0, 10.0}));
  EXPECT_EQ(limited(limiter, milliseconds{10}, {80.0, 80.0}), (std::vector{50.0, 25.0}));
  EXPECT_EQ(limiter.clippings().slope, 1U);
  EXPECT_EQ(limiter.clippings().charge, 4U);
}

TEST(StimulationLimiter, ScalesAllByOneFactorToTheBudget) {
  Limits limits = kWide;
  limits.max_total_uA = 90.0;
  StimulationLimiter limiter(limits, {{80.0, 200.0}, {80.0, 200.0}, {80.0, 200.0}});
  limiter.reset(nanoseconds{0});
  const auto out = limited(limiter, milliseconds{10}, {60.0, 40.0, 20.0});
  EXPECT_NEAR(out[0], 45.0, 1e-9);
  EXPECT_NEAR(out[1], 30.0, 1e-9);
  EXPECT_NEAR(out[2], 15.0, 1e-9);
  EXPECT_LE(out[0] + out[1] + out[2], 90.0);
  EXPECT_EQ(limiter.clippings().total, 1U);
}

TEST(StimulationLimiter, KeepsTheStrongestElectrodes) {
  Limits limits = kWide;
  limits.max_electrodes = 2;
  StimulationLimiter limiter(limits,
                             std::vector<StimulationLimiter::OfElectrode>(4, {80.0, 200.0}));
  limiter.reset(nanoseconds{0});
  EXPECT_EQ(limited(limiter, milliseconds{10}, {10.0, 30.0, 30.0, 30.0}),
            (std::vector{0.0, 30.0, 30.0, 0.0}));
  EXPECT_EQ(limiter.clippings().electrodes, 2U);
}

TEST(StimulationLimiter, ElectrodesThatAreOffAreNoneOfThem) {
  Limits limits = kWide;
  limits.max_electrodes = 1;
  StimulationLimiter limiter(limits, {{80.0, 200.0}, {80.0, 200.0}, {80.0, 200.0}});
  limiter.reset(nanoseconds{0});
  EXPECT_EQ(limited(limiter, milliseconds{1}, {0.0, 30.0, 0.0}), (std::vector{0.0, 30.0, 0.0}));
  EXPECT_EQ(limiter.clippings().all(), 0U);
}

TEST(StimulationLimiter, APulseInProgressIsOneOfTheElectrodesAtOnce) {
  Limits limits = kWide;
  limits.max_electrodes = 2;
  StimulationLimiter limiter(limits,
                             std::vector<StimulationLimiter::OfElectrode>(3, {80.0, 200.0}));
  limiter.reset(nanoseconds{0});
  std::vector pulses = {pulse(microseconds{900}, 50.0, 2)};
  ASSERT_EQ(limiter.limit_pulses(pulses, nanoseconds{0}), 1U);
  EXPECT_EQ(limited(limiter, milliseconds{1}, {10.0, 20.0, 0.0}), (std::vector{0.0, 20.0, 0.0}));
  // It ends after 400 µs.
  EXPECT_EQ(limited(limiter, microseconds{1300}, {10.0, 20.0, 0.0}),
            (std::vector{10.0, 20.0, 0.0}));
}

TEST(StimulationLimiter, TrainsLeaveRoomForAPulseInProgress) {
  Limits limits = kWide;
  limits.max_total_uA = 100.0;
  StimulationLimiter limiter(limits, {{80.0, 200.0}, {80.0, 200.0}});
  limiter.reset(nanoseconds{0});
  std::vector pulses = {pulse(microseconds{900}, 60.0, 1)};
  ASSERT_EQ(limiter.limit_pulses(pulses, nanoseconds{0}), 1U);
  limited(limiter, microseconds{950}, {0.0, 0.0});  // no pulse is expected any more
  EXPECT_NEAR(limited(limiter, milliseconds{1}, {80.0, 0.0})[0], 40.0, 1e-9);
  EXPECT_EQ(limiter.clippings().total, 1U);
}

TEST(StimulationLimiter, AStrongElectrodeIsNotSwitchedOffForAPulseOfItsOwn) {
  Limits limits = kWide;
  limits.max_electrodes = 1;
  StimulationLimiter limiter(limits, {{80.0, 500.0}, {80.0, 500.0}});
  limiter.reset(nanoseconds{0});
  // The second pulse of the tick is of the same electrode, and counts no more; the third does.
  std::vector pulses = {pulse(microseconds{100}, 50.0, 0), pulse(microseconds{2200}, 60.0, 0),
                        pulse(microseconds{2300}, 60.0, 1)};
  ASSERT_EQ(limiter.limit_pulses(pulses, nanoseconds{0}), 2U);
  EXPECT_EQ(pulses[1].electrode, 0);
  EXPECT_EQ(limiter.clippings().electrodes, 1U);
  // In the next tick, whose beginning finds it still in progress.
  std::vector next = {pulse(microseconds{4200}, 60.0, 0)};
  EXPECT_EQ(limiter.limit_pulses(next, microseconds{2500}), 1U);
}

TEST(StimulationLimiter, DropsPulsesThatFindNoBudget) {
  Limits limits = kWide;
  limits.max_total_uA = 80.0;
  StimulationLimiter limiter(limits, {{80.0, 200.0}, {80.0, 200.0}});
  limiter.reset(nanoseconds{0});
  EXPECT_EQ(limited(limiter, milliseconds{1}, {80.0, 0.0})[0], 80.0);
  std::vector pulses = {pulse(microseconds{1500}, 40.0, 1)};
  EXPECT_EQ(limiter.limit_pulses(pulses, milliseconds{1}), 0U);
  EXPECT_EQ(limiter.clippings().total, 1U);
  // The next update makes room for it: 80 µA for 80 and 40 µA. It is not in progress.
  EXPECT_NEAR(limited(limiter, microseconds{1600}, {80.0, 0.0})[0], 80.0 * 80.0 / 120.0, 1e-9);
}

TEST(StimulationLimiter, DropsPulsesForWhichHardlyAnyBudgetIsLeft) {
  for (const auto& [left_uA, kept] : {std::pair{5e-5, 0U}, {2e-4, 1U}}) {  // a millionth of 80 µA
    Limits limits = kWide;
    limits.max_total_uA = 80.0;
    StimulationLimiter limiter(limits, {{80.0, 200.0}, {80.0, 200.0}});
    limiter.reset(nanoseconds{0});
    limited(limiter, milliseconds{1}, {80.0 - left_uA, 0.0});
    std::vector pulses = {pulse(microseconds{1500}, 40.0, 1)};
    EXPECT_EQ(limiter.limit_pulses(pulses, milliseconds{1}), kept) << left_uA;
  }
}

TEST(StimulationLimiter, AScaledPulseIsWhereTheNextOneRisesFrom) {
  Limits limits = kWide;
  limits.max_total_uA = 50.0;
  const StimulationLimiter::OfElectrode slow{
      .max_uA = 80.0, .max_Hz = 500.0, .max_slope_uA_per_s = 10'000.0};
  StimulationLimiter limiter(limits, {slow, slow});
  limiter.reset(nanoseconds{0});
  // Both have risen to 50 µA after 5 ms, and share 50 µA.
  std::vector pulses = {pulse(milliseconds{5}, 80.0, 0), pulse(milliseconds{5}, 80.0, 1)};
  ASSERT_EQ(limiter.limit_pulses(pulses, microseconds{4500}), 2U);
  EXPECT_NEAR(pulses[0].amplitude_uA, 25.0, 1e-9);
  std::vector next = {pulse(milliseconds{7}, 80.0, 0)};
  ASSERT_EQ(limiter.limit_pulses(next, microseconds{6500}), 1U);
  EXPECT_NEAR(next[0].amplitude_uA, 45.0, 1e-9);
  EXPECT_EQ(limiter.clippings().slope, 3U);
}

TEST(StimulationLimiter, AStopLetsPulsesRiseFromZeroAgain) {
  StimulationLimiter limiter(kWide,
                             {{.max_uA = 80.0, .max_Hz = 500.0, .max_slope_uA_per_s = 10'000.0}});
  limiter.reset(nanoseconds{0});
  std::vector pulses = {pulse(milliseconds{8}, 80.0)};
  ASSERT_EQ(limiter.limit_pulses(pulses, milliseconds{7}), 1U);
  EXPECT_DOUBLE_EQ(pulses[0].amplitude_uA, 80.0);
  auto stop = update_of(milliseconds{10}, {0.0});
  stop[0].stop = Stop::kGap;
  limiter.limit_update(stop);
  pulses = {pulse(milliseconds{13}, 80.0)};
  ASSERT_EQ(limiter.limit_pulses(pulses, milliseconds{12}), 1U);
  EXPECT_DOUBLE_EQ(pulses[0].amplitude_uA, 30.0);
  // A reset too, and a pulse may follow at once.
  limiter.reset(milliseconds{14});
  pulses = {pulse(microseconds{14'500}, 80.0)};
  ASSERT_EQ(limiter.limit_pulses(pulses, milliseconds{14}), 1U);
  EXPECT_DOUBLE_EQ(pulses[0].amplitude_uA, 5.0);
}

TEST(StimulationLimiter, DropsPulsesThatComeTooSoon) {
  StimulationLimiter limiter(kWide, {{80.0, 200.0}});
  limiter.reset(nanoseconds{0});
  std::vector pulses = {pulse(milliseconds{1}, 80.0), pulse(microseconds{5999}, 80.0),
                        pulse(milliseconds{6}, 80.0)};
  ASSERT_EQ(limiter.limit_pulses(pulses, nanoseconds{0}), 2U);
  EXPECT_EQ(pulses[0].time, milliseconds{1});
  EXPECT_EQ(pulses[1].time, milliseconds{6});
  EXPECT_EQ(limiter.clippings().frequency, 1U);
}

TEST(StimulationLimiter, PulsesOfATickShareTheBudgetThatTrainsLeave) {
  Limits limits = kWide;
  limits.max_total_uA = 100.0;
  StimulationLimiter limiter(limits, {{80.0, 200.0}, {80.0, 200.0}, {80.0, 200.0}});
  limiter.reset(nanoseconds{0});
  EXPECT_EQ(limited(limiter, milliseconds{1}, {40.0, 0.0, 0.0})[0], 40.0);
  std::vector pulses = {pulse(microseconds{1200}, 80.0, 1), pulse(microseconds{1700}, 40.0, 2)};
  ASSERT_EQ(limiter.limit_pulses(pulses, milliseconds{1}), 2U);
  EXPECT_NEAR(pulses[0].amplitude_uA, 40.0, 1e-9);
  EXPECT_NEAR(pulses[1].amplitude_uA, 20.0, 1e-9);
  // At the next update the train leaves room for pulses of the requested strength.
  EXPECT_NEAR(limited(limiter, milliseconds{11}, {40.0, 0.0, 0.0})[0], 25.0, 1e-9);
  // No pulse has followed, so the train after it has the whole budget.
  EXPECT_EQ(limited(limiter, milliseconds{21}, {40.0, 0.0, 0.0})[0], 40.0);
}

TEST(StimulationLimiter, RoundsTheIntervalBetweenPulsesUp) {
  StimulationLimiter limiter(kWide, {{80.0, 300.0}});  // 3333333 1/3 ns
  limiter.reset(nanoseconds{0});
  std::vector pulses = {pulse(milliseconds{1}, 80.0), pulse(nanoseconds{4'333'333}, 80.0),
                        pulse(nanoseconds{4'333'334}, 80.0)};
  ASSERT_EQ(limiter.limit_pulses(pulses, nanoseconds{0}), 2U);
  EXPECT_EQ(pulses[1].time, nanoseconds{4'333'334});
}

/// One random run of the limiter, checked by the auditor.
class RandomRun {
 public:
  explicit RandomRun(std::uint64_t seed) : random_(seed) {
    const auto maybe = [&](double value, double none) {
      return random_.uniform() < 0.5 ? value : none;
    };
    limits_ = {.max_total_uA = random_.uniform(20.0, 400.0)};
    const auto electrodes = 1 + random_.next() % 20;
    if (random_.uniform() < 0.5) limits_.max_electrodes = 1 + random_.next() % electrodes;
    for (std::size_t e = 0; e < electrodes; ++e) {
      electrodes_.push_back(
          {.max_uA = random_.uniform(5.0, 150.0),
           .max_Hz = random_.uniform(5.0, 900.0),
           .phase = nanoseconds{static_cast<std::int64_t>(random_.uniform(5e4, 5e5))},
           .max_charge_nC = random_.uniform(1.0, 20.0),
           .max_slope_uA_per_s = maybe(random_.uniform(100.0, 1e5), StimulationLimiter::kNone)});
      electrodes_.back().pulse = 2 * electrodes_.back().phase +
                                 nanoseconds{static_cast<std::int64_t>(random_.uniform(0.0, 2e5))};
      pulses_.push_back(random_.uniform() < 0.5);
    }
  }

  /// \param omitted  a limit withheld from the limiter but not from the auditor
  /// \return the limit exceeded, or an empty string
  std::string run(const std::string& omitted = "") {
    StimulationLimiter limiter = make_limiter(omitted);
    limiter.reset(nanoseconds{0});
    CommandAuditor auditor(limits_, electrodes_, nanoseconds{0});
    for (int tick = 0; tick < 300 && auditor.fault().empty(); ++tick) {
      const nanoseconds begin = tick * milliseconds{1};
      std::vector<StimulationCommand> commands = pulses(begin);
      commands.resize(limiter.limit_pulses(commands, begin));
      if (random_.uniform() < 0.2) {
        auto last = update(begin + milliseconds{1});
        limiter.limit_update(last);
        commands.insert(commands.end(), last.begin(), last.end());
      }
      auditor.take(commands);
    }
    return auditor.fault();
  }

 private:
  [[nodiscard]] StimulationLimiter make_limiter(const std::string& omitted) const {
    Limits limits = limits_;
    auto electrodes = electrodes_;
    if (omitted == "total") limits.max_total_uA = 1e9;
    if (omitted == "electrodes") limits.max_electrodes = Limits{}.max_electrodes;
    for (auto& electrode : electrodes) {
      if (omitted == "amplitude") electrode.max_uA = 1e9;
      if (omitted == "frequency") electrode.max_Hz = 1e9;
      if (omitted == "charge") electrode.max_charge_nC = 1e9;
      if (omitted == "slope") electrode.max_slope_uA_per_s = StimulationLimiter::kNone;
      if (omitted == "pulse") electrode.pulse /= 10;
    }
    return {limits, electrodes};
  }
  double value(double most) {
    const double kind = random_.uniform();
    if (kind < 0.03) return kNan;
    if (kind < 0.06) return random_.uniform() < 0.5 ? kInfinity : -kInfinity;
    if (kind < 0.09) return -random_.uniform(0.0, most);
    if (kind < 0.2) return 0.0;
    return random_.uniform(0.0, 1.5 * most);
  }
  std::vector<StimulationCommand> pulses(nanoseconds begin) {
    std::vector<StimulationCommand> pulses;
    for (std::size_t e = 0; e < electrodes_.size(); ++e) {
      for (int k = 0; pulses_[e] && random_.uniform() < 0.4 && k < 4; ++k) {
        const auto after = static_cast<std::int64_t>(1 + random_.next() % 1'000'000);
        pulses.push_back(pulse(begin + nanoseconds{after}, value(electrodes_[e].max_uA),
                               static_cast<std::uint16_t>(e)));
      }
    }
    std::sort(pulses.begin(), pulses.end(),
              [](const auto& a, const auto& b) { return a.time < b.time; });
    return pulses;
  }
  std::vector<StimulationCommand> update(nanoseconds time) {
    std::vector<StimulationCommand> update;
    for (std::size_t e = 0; e < electrodes_.size(); ++e) {
      const bool stopped = random_.uniform() < 0.05;
      const bool off = stopped || pulses_[e];
      update.push_back({.time = time,
                        .amplitude_uA = off ? 0.0 : value(electrodes_[e].max_uA),
                        .frequency_Hz = value(electrodes_[e].max_Hz),
                        .electrode = static_cast<std::uint16_t>(e),
                        .stop = stopped ? Stop::kGap : Stop::kNone});
    }
    return update;
  }

  Random random_;
  Limits limits_;
  std::vector<StimulationLimiter::OfElectrode> electrodes_;
  std::vector<bool> pulses_;
};

TEST(StimulationLimiter, NoOutputExceedsALimit) {
  for (std::uint64_t seed = 1; seed <= 1000; ++seed) {
    ASSERT_EQ(RandomRun(seed).run(), "") << "seed " << seed;
  }
}

TEST(StimulationLimiter, EveryLimitIsNeeded) {
  for (const std::string limit :
       {"charge", "total", "slope", "electrodes", "amplitude", "frequency", "pulse"}) {
    int broken = 0;
    for (std::uint64_t seed = 1; seed <= 50; ++seed) {
      broken += RandomRun(seed).run(limit).empty() ? 0 : 1;
    }
    EXPECT_GT(broken, 5) << "without " << limit << ", no limit is exceeded";
  }
}

}  // namespace
}  // namespace merkel
