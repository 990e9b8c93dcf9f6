#include "drivers/probes/sim_probe.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>

#include "core/units.hpp"
#include "drivers/probes/sample_meter.hpp"
#include "drivers/sample_limits.hpp"

namespace merkel {
namespace {

constexpr double kMax_s = 1e6;
constexpr double kPosition = SampleLimits::kPosition_mm;

/// 0 before `begin`, 1 after `begin + length`, linear in between.
double ramp(double t, double begin, double length) {
  return std::clamp((t - begin) / length, 0.0, 1.0);
}

/// The press at a time in seconds, as a multiple of the amplitude, and its position.
struct PlacedPress {
  double level = 0.0;
  double x_mm = 0.0;
  double y_mm = 0.0;
};

struct PressFaults {
  double jitter_s = 0.0;
  double noise = 0.0;  ///< mm or mN
  double dropouts_per_s = 0.0;
  double dropout_s = 0.0;
  std::uint64_t seed = 1;
};

/// A shape of the press over time.
struct PressShape {
  std::function<PlacedPress(double)> press;
  double length_s = 0.0;
};

/// One of several presses, in a further column.
struct Finger {
  std::string_view name;
  double share;  ///< of the amplitude
};
constexpr std::array<Finger, 6> kHand = {{{"thumb", 1.0},
                                          {"index", 1.0},
                                          {"middle", 0.9},
                                          {"ring", 0.8},
                                          {"little", 0.7},
                                          {"palm", 2.0}}};

PressShape taps_of(UriOptions& options, double wait_s, PlacedPress place, bool grasp) {
  const double tap_s = options.number("tap_s", grasp ? 0.9 : 0.1, 1e-3, kMax_s);
  const double interval_s = options.number("interval_s", grasp ? 1.2 : 0.4, 1e-3, kMax_s);
  const auto count = static_cast<double>(options.whole("count", 6, 1, 1'000'000));
  return {.press =
              [=](double t) {
                const double since = t - wait_s;
                const double tap = std::clamp(std::floor(since / interval_s), 0.0, count - 1.0);
                const double phase = (since - tap * interval_s) / tap_s;
                const bool touching = phase > 0.0 && phase < 1.0;
                const double level = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * phase);
                return PlacedPress{
                    .level = touching ? level : 0.0, .x_mm = place.x_mm, .y_mm = place.y_mm};
              },
          .length_s = (count - 1.0) * interval_s + tap_s};
}

/// A ramp, a sine or a slide. \param amplitude  in mm, or in mN if `force`
PressShape held_press(UriOptions& options, const std::string& shape, double wait_s,
                      PlacedPress place, double amplitude, bool force) {
  const double ramp_s = options.number("ramp_s", shape == "ramp" ? 0.02 : 0.15, 1e-6, kMax_s);
  double hold_s = 0.0;
  double to_x = place.x_mm;
  double to_y = place.y_mm;
  double relative = 0.0;
  double angular = 0.0;
  if (shape == "slide") {
    to_x = options.number("to_x_mm", 27.0, -kPosition, kPosition);
    to_y = options.number("to_y_mm", place.y_mm, -kPosition, kPosition);
    const double speed = options.number("speed_mm_per_s", 12.0, 1e-3, 1e4);
    hold_s = std::hypot(to_x - place.x_mm, to_y - place.y_mm) / speed;
  } else {
    hold_s = options.number("hold_s", 2.0, 0.0, kMax_s);
  }
  if (shape == "sine") {
    const char* const key = force ? "amplitude_N" : "amplitude_mm";
    const double swing = options.number(key, force ? 0.03 : 0.3, 0.0, 1e3);
    angular = 2.0 * std::numbers::pi * options.number("frequency_hz", 5.0, 1e-3, 1e4);
    relative = amplitude > 0.0 ? (force ? units::mN_from_N(swing) : swing) / amplitude : 0.0;
  }
  return {.press =
              [=](double t) {
                const double held = t - wait_s - ramp_s;
                const double level =
                    ramp(t, wait_s, ramp_s) - ramp(t, wait_s + ramp_s + hold_s, ramp_s);
                const bool holding = held > 0.0 && held < hold_s;
                const double moved = hold_s > 0.0 ? ramp(held, 0.0, hold_s) : 0.0;
                return PlacedPress{
                    .level = level + (holding ? relative * std::sin(angular * held) : 0.0),
                    .x_mm = place.x_mm + moved * (to_x - place.x_mm),
                    .y_mm = place.y_mm + moved * (to_y - place.y_mm)};
              },
          .length_s = ramp_s + hold_s + ramp_s};
}

PressShape scan_of(UriOptions& options, double wait_s, PlacedPress place) {
  const double ramp_s = options.number("ramp_s", 0.15, 1e-6, kMax_s);
  const double length_mm = options.number("length_mm", 24.0, 1e-3, 2.0 * kPosition);
  const double speed = options.number("speed_mm_per_s", 40.0, 1e-3, 1e4);
  const double direction =
      options.number("direction_deg", 0.0, -360.0, 360.0) * std::numbers::pi / 180.0;
  const auto passes = static_cast<double>(options.whole("passes", 1, 1, 1'000'000));
  const double step_mm = options.number("step_mm", 0.2, -kPosition, kPosition);
  const double return_s = options.number("return_s", 0.1, 1e-6, kMax_s);
  const double slide_s = length_mm / speed;
  const double pass_s = slide_s + 2.0 * ramp_s;
  const double along_x = std::cos(direction);
  const double along_y = std::sin(direction);
  return {.press =
              [=](double t) {
                const double since = t - wait_s;
                const double pass =
                    std::clamp(std::floor(since / (pass_s + return_s)), 0.0, passes - 1.0);
                const double begin = wait_s + pass * (pass_s + return_s);
                const double level =
                    ramp(t, begin, ramp_s) - ramp(t, begin + ramp_s + slide_s, ramp_s);
                // Back to the next pass while it is lifted.
                const double back = pass + 1.0 < passes ? ramp(t, begin + pass_s, return_s) : 0.0;
                const double moved = ramp(t, begin + ramp_s, slide_s) - back - 0.5;
                const double aside = pass + back - 0.5 * (passes - 1.0);
                return PlacedPress{
                    .level = level,
                    .x_mm = place.x_mm + moved * length_mm * along_x - aside * step_mm * along_y,
                    .y_mm = place.y_mm + moved * length_mm * along_y + aside * step_mm * along_x};
              },
          .length_s = passes * pass_s + (passes - 1.0) * return_s};
}

PressFaults read_faults(UriOptions& options, bool force, double rate_hz) {
  return {.jitter_s = options.number("jitter_us", 0.0, 0.0, 0.45e6 / rate_hz) * 1e-6,
          .noise = force ? options.number("noise_mN", 0.0, 0.0, 1e6)
                         : units::mm_from_um(options.number("noise_um", 0.0, 0.0, 1e4)),
          .dropouts_per_s = options.number("dropouts_per_s", 0.0, 0.0, 1e3),
          .dropout_s = options.number("dropout_ms", 100.0, 0.0, 1e6) * 1e-3,
          .seed = static_cast<std::uint64_t>(options.whole("seed", 1, 0, INT64_MAX))};
}

/// Takes the samples of a press, with its faults.
struct PressSampler {
  std::function<PlacedPress(double)> press;
  double amplitude;                      ///< mm, or mN when force-controlled
  std::optional<double> finger_delay_s;  ///< of a grasp
  std::optional<double> force_mN;        ///< at the amplitude, for a press with depth and force
  double rate_hz;
  PressFaults faults;
  Random random{faults.seed};
  double dropped_until_s = 0.0;

  double noise() { return faults.noise > 0.0 ? faults.noise * irwin_hall(random) : 0.0; }

  bool operator()(double nominal_s, ProbeSample& sample, std::span<double> others) {
    const bool falls = random.uniform() * rate_hz < faults.dropouts_per_s;
    const double jitter_s = faults.jitter_s * random.uniform(-1.0, 1.0);
    const double its_noise = noise();
    if (falls) dropped_until_s = nominal_s + faults.dropout_s;
    if (nominal_s < dropped_until_s) return false;

    const double taken_s = nominal_s + jitter_s;
    const PlacedPress taken = press(taken_s);
    const double value = amplitude * taken.level + its_noise;
    sample.time = units::nanoseconds_from_s(taken_s);
    // Each finger presses a little later than the one before it.
    for (std::size_t i = 0; finger_delay_s && i < kHand.size(); ++i) {
      const PlacedPress its_press = press(taken_s - static_cast<double>(i) * *finger_delay_s);
      const double finger_noise = noise();
      others[i] = amplitude * kHand[i].share * its_press.level + finger_noise;
    }
    if (!finger_delay_s) {
      (sample.has(ProbeSample::kDepth) ? sample.depth_mm : sample.force_mN) = value;
    }
    if (force_mN) {
      const double relative = amplitude > 0.0 ? std::max(value / amplitude, 0.0) : 0.0;
      sample.force_mN = *force_mN * relative * std::sqrt(relative);  // Hertz: power 1.5
    }
    if (sample.has(ProbeSample::kX)) {
      sample.x_mm = taken.x_mm;
      sample.y_mm = taken.y_mm;
    }
    return true;
  }
};

}  // namespace

Expected<std::unique_ptr<Probe>, SetupError> SimProbe::open(const Uri& uri) {
  if (uri.path == "pad") return open_pad(uri);
  const bool grasp = uri.path == "grasp";
  if (!grasp && uri.path != "ramp" && uri.path != "taps" && uri.path != "sine" &&
      uri.path != "slide" && uri.path != "scan") {
    return bad_input(
        "\"" + uri.text + "\": there is no simulated press \"" + uri.path +
        "\"; write sim:ramp, sim:taps, sim:sine, sim:slide, sim:scan, sim:grasp or sim:pad");
  }
  UriOptions options(uri);
  const bool both = !grasp && options.given("force_N") && options.given("depth_mm");
  const bool force = options.given("force_N") && !both;
  const double rate_hz = options.number("rate_hz", 1000.0, 1.0, 1e5);
  const double wait_s = options.number("wait_s", 0.2, 0.0, kMax_s);
  const double tail_s = options.number("tail_s", 0.5, 0.0, kMax_s);
  const double force_mN = both
                              ? units::mN_from_N(options.number(
                                    "force_N", 0.0, 0.0, units::N_from_mN(SampleLimits::kForce_mN)))
                              : 0.0;
  const double amplitude =
      force ? units::mN_from_N(
                  options.number("force_N", 0.1, 0.0, units::N_from_mN(SampleLimits::kForce_mN)))
            : options.number("depth_mm", 1.5, 0.0, SampleLimits::kDepth_mm);
  const double delay_s = grasp ? 1e-3 * options.number("delay_ms", 60.0, 0.0, 1e6) : 0.0;
  const bool positioned =
      options.given("x_mm") || options.given("y_mm") || uri.path == "slide" || uri.path == "scan";
  const bool slide = uri.path == "slide";
  const double x = options.number("x_mm", slide ? 3.0 : 15.0, -kPosition, kPosition);
  const double y = options.number("y_mm", 10.0, -kPosition, kPosition);

  const PlacedPress place{.x_mm = x, .y_mm = y};
  PressShape shape = grasp || uri.path == "taps" ? taps_of(options, wait_s, place, grasp)
                     : uri.path == "scan"
                         ? scan_of(options, wait_s, place)
                         : held_press(options, uri.path, wait_s, place, amplitude, force);
  PressFaults faults = read_faults(options, force, rate_hz);
  // The values of further columns are in their unit.
  if (grasp && force) faults.noise = units::N_from_mN(faults.noise);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  const double duration_s =
      wait_s + shape.length_s + tail_s + static_cast<double>(kHand.size() - 1) * delay_s;
  if (duration_s * rate_hz > 4e9) {
    return bad_input("\"" + uri.text +
                     "\" makes more than 4e9 samples: reduce its duration or rate");
  }
  const std::uint32_t positions = positioned ? ProbeSample::kX | ProbeSample::kY : 0U;
  ProbeInfo info{.uri = uri.text,
                 .name = "simulated " + uri.path,
                 .serial_number = {},
                 .channels = (grasp   ? 0U
                              : force ? std::uint32_t{ProbeSample::kForce}
                                      : std::uint32_t{ProbeSample::kDepth}) |
                             (both ? std::uint32_t{ProbeSample::kForce} : 0U) | positions,
                 .period = units::nanoseconds_from_s(1.0 / rate_hz),
                 .replayed = true};
  for (std::size_t i = 0; grasp && i < kHand.size(); ++i) {
    info.extra_columns.push_back(std::string(kHand[i].name) + (force ? "_N" : "_mm"));
  }
  PressSampler sampler{.press = std::move(shape.press),
                       .amplitude = grasp && force ? units::N_from_mN(amplitude) : amplitude,
                       .finger_delay_s = grasp ? std::optional(delay_s) : std::nullopt,
                       .force_mN = both ? std::optional(force_mN) : std::nullopt,
                       .rate_hz = rate_hz,
                       .faults = faults};
  return std::unique_ptr<Probe>(new SimProbe(std::move(info), std::move(sampler), rate_hz,
                                             std::floor(duration_s * rate_hz + 1e-9) + 1.0));
}

double irwin_hall(Random& random) noexcept {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) sum += random.uniform();
  return sum;
}

Expected<std::size_t, ProbeError> SimProbe::read(Readings& readings,
                                                 std::chrono::milliseconds /*patience*/) {
  readings.clear();
  const ProbeColumns& columns = readings.columns().of(0);
  constexpr std::size_t kMostOfPad = 256;  // samples: each takes long to compute
  const std::size_t most =
      columns.taxels > 0 ? std::min(readings.room(), kMostOfPad) : readings.room();
  while (readings.size() < most && next_ < count_) {
    ProbeSample sample{.sequence = next_++,
                       .channels = info_.channels,
                       .valid_for = SampleMeter::stale_after(*info_.period)};
    const std::span<double> row = readings.add({});
    const std::size_t place = readings.size() - 1;
    if (!take_(sample.sequence / rate_hz_, sample, row.subspan(ProbeColumns::kPress))) {
      readings.resize(place);
      continue;
    }
    sample.arrival = sample.time;
    readings.head(place) = head_of(sample);
    columns.put(sample, row);
  }
  if (!readings.empty()) return readings.size();
  return Unexpected<ProbeError>(ProbeError::kEndOfStream);
}

}  // namespace merkel
