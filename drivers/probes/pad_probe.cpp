#include "drivers/probes/pad_probe.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/units.hpp"
#include "drivers/probes/sample_meter.hpp"

namespace merkel {
namespace {

constexpr double kMaxPad_s = 1e6;
constexpr int kPointsAcross = 3;  ///< of a taxel

}  // namespace

double PadProbe::Options::samples() const noexcept {
  return (wait_s + (count - 1) * interval_s + press_s + tail_s) * rate_Hz;
}

PadProbe::PadProbe(ProbeInfo info, const Options& options)
    : info_(std::move(info)),
      options_(options),
      random_(options.seed),
      count_(static_cast<std::uint32_t>(options.samples()) + 1) {}

Expected<std::unique_ptr<Probe>, SetupError> PadProbe::open(const Uri& uri) {
  UriOptions given(uri);
  Options options;
  options.columns = static_cast<int>(given.whole("columns", 16, 1, 1024));
  options.rows = static_cast<int>(given.whole("rows", 16, 1, 1024));
  options.pitch_mm = given.number("pitch_mm", 1.0, 0.01, 100.0);
  options.force_mN = units::mN_from_N(given.number("force_N", 1.0, 1e-6, 1e3));
  options.contact_mm = given.number("contact_mm", 4.0, 0.01, 100.0);
  options.roll_mm = given.number("roll_mm", 3.0, 0.0, 100.0);
  options.count = static_cast<int>(given.whole("count", 6, 1, 1'000'000));
  options.press_s = given.number("tap_s", 0.9, 1e-3, kMaxPad_s);
  options.interval_s = given.number("interval_s", 1.2, 1e-3, kMaxPad_s);
  options.wait_s = given.number("wait_s", 0.2, 0.0, kMaxPad_s);
  options.tail_s = given.number("tail_s", 0.5, 0.0, kMaxPad_s);
  options.rate_Hz = given.number("rate_hz", 1000.0, 1.0, 1e4);
  options.noise_kPa = given.number("noise_kPa", 0.0, 0.0, 1e3);
  options.seed = static_cast<std::uint64_t>(given.whole("seed", 1, 0, INT64_MAX));
  if (auto done = given.finish(); !done) return Unexpected<SetupError>(done.error());
  if (options.columns * options.rows > 1024) {
    return bad_input("\"" + uri.text + "\" has more than 1024 taxels: reduce columns or rows");
  }
  if (options.samples() > 4e9) {
    return bad_input("\"" + uri.text + "\" makes more than 4e9 samples: reduce its count or rate");
  }
  ProbeInfo info{.uri = uri.text,
                 .name = "simulated pad",
                 .serial_number = {},
                 .channels = ProbeSample::kForce,
                 .period = units::nanoseconds_from_s(1.0 / options.rate_Hz),
                 .replayed = true};
  info.taxels = static_cast<std::size_t>(options.columns) * static_cast<std::size_t>(options.rows);
  return std::unique_ptr<Probe>(new PadProbe(std::move(info), options));
}

/// A raised cosine of the force; the ball rolls once to each side meanwhile.
double PadProbe::press(double time_s, std::span<double> kPa) {
  const double since = time_s - options_.wait_s;
  const double number =
      std::clamp(std::floor(since / options_.interval_s), 0.0, options_.count - 1.0);
  const double phase =
      std::clamp((since - number * options_.interval_s) / options_.press_s, 0.0, 1.0);
  const double turn = 2.0 * std::numbers::pi * phase;
  const double force_mN = options_.force_mN * (0.5 - 0.5 * std::cos(turn));
  const double radius = options_.contact_mm * std::cbrt(force_mN / options_.force_mN);
  const double peak_kPa =
      radius > 0.0 ? 1.5 * force_mN / (std::numbers::pi * radius * radius) : 0.0;
  const double ball_x = options_.roll_mm * std::sin(turn);
  double sum_kPa = 0.0;
  for (int r = 0; r < options_.rows; ++r) {
    for (int c = 0; c < options_.columns; ++c) {
      double mean = 0.0;
      for (int a = 0; a < kPointsAcross * kPointsAcross && radius > 0.0; ++a) {
        const auto within = [](int k) { return (k + 0.5) / kPointsAcross - 0.5; };
        const double x =
            options_.pitch_mm * (c - 0.5 * (options_.columns - 1) + within(a % kPointsAcross)) -
            ball_x;
        const double y =
            options_.pitch_mm * (r - 0.5 * (options_.rows - 1) + within(a / kPointsAcross));
        const double inside = 1.0 - (x * x + y * y) / (radius * radius);
        if (inside > 0.0) mean += peak_kPa * std::sqrt(inside) / (kPointsAcross * kPointsAcross);
      }
      // The sum of twelve uniform numbers minus its mean is nearly normal.
      double noise = -6.0;
      for (int k = 0; k < 12 && options_.noise_kPa > 0.0; ++k) noise += random_.uniform();
      if (options_.noise_kPa > 0.0) mean = std::max(0.0, mean + options_.noise_kPa * noise);
      // In single precision, as the records of pressures are.
      kPa[static_cast<std::size_t>(r * options_.columns + c)] =
          static_cast<double>(static_cast<float>(mean));
      sum_kPa += mean;
    }
  }
  return sum_kPa * options_.pitch_mm * options_.pitch_mm;
}

Expected<std::size_t, ProbeError> PadProbe::read(Readings& readings,
                                                 std::chrono::milliseconds /*patience*/) {
  constexpr std::size_t kAtOnce = 256;
  readings.clear();
  const ProbeColumns& columns = readings.columns().of(0);
  for (std::size_t left = std::min({readings.room(), kAtOnce, std::size_t{count_ - next_}});
       left > 0; --left) {
    const double time_s = next_ / options_.rate_Hz;
    ProbeSample sample{.time = units::nanoseconds_from_s(time_s),
                       .arrival = units::nanoseconds_from_s(time_s),
                       .sequence = next_++,
                       .channels = info_.channels,
                       .valid_for = SampleMeter::stale_after(*info_.period)};
    const std::span<double> row = readings.add(head_of(sample));
    sample.force_mN = press(time_s, columns.taxels_in(row));
    columns.put(sample, row);
  }
  if (!readings.empty() || readings.room() == 0) return readings.size();
  return Unexpected<ProbeError>(ProbeError::kEndOfStream);
}

}  // namespace merkel
