#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/units.hpp"
#include "drivers/probes/sim_probe.hpp"

namespace merkel {
namespace {

constexpr double kMaxPad_s = 1e6;
constexpr int kPointsAcross = 3;  ///< of a taxel

}  // namespace

Expected<std::unique_ptr<Probe>, SetupError> SimProbe::open_pad(const Uri& uri) {
  UriOptions options(uri);
  const auto columns = static_cast<int>(options.whole("columns", 16, 1, 1024));
  const auto rows = static_cast<int>(options.whole("rows", 16, 1, 1024));
  const double pitch_mm = options.number("pitch_mm", 1.0, 0.01, 100.0);
  const double largest_mN = units::mN_from_N(options.number("force_N", 1.0, 1e-6, 1e3));
  // The radius of the contact at that force, and the way of the ball to each side, along x.
  const double contact_mm = options.number("contact_mm", 4.0, 0.01, 100.0);
  const double roll_mm = options.number("roll_mm", 3.0, 0.0, 100.0);
  const auto count = static_cast<int>(options.whole("count", 6, 1, 1'000'000));
  const double press_s = options.number("tap_s", 0.9, 1e-3, kMaxPad_s);
  const double interval_s = options.number("interval_s", 1.2, 1e-3, kMaxPad_s);
  const double wait_s = options.number("wait_s", 0.2, 0.0, kMaxPad_s);
  const double tail_s = options.number("tail_s", 0.5, 0.0, kMaxPad_s);
  const double rate_Hz = options.number("rate_hz", 1000.0, 1.0, 1e4);
  const double noise_kPa = options.number("noise_kPa", 0.0, 0.0, 1e3);
  const auto seed = static_cast<std::uint64_t>(options.whole("seed", 1, 0, INT64_MAX));
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (columns * rows > 1024) {
    return bad_input("\"" + uri.text + "\" has more than 1024 taxels: reduce columns or rows");
  }
  const double samples = (wait_s + (count - 1) * interval_s + press_s + tail_s) * rate_Hz;
  if (samples > 4e9) {
    return bad_input("\"" + uri.text + "\" makes more than 4e9 samples: reduce its count or rate");
  }
  ProbeInfo info{.uri = uri.text,
                 .name = "simulated pad",
                 .serial_number = {},
                 .channels = ProbeSample::kForce,
                 .period = units::nanoseconds_from_s(1.0 / rate_Hz),
                 .replayed = true};
  info.taxels = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  // A raised cosine of the force; the ball rolls once to each side meanwhile.
  auto take = [=, random = Random(seed)](double time_s, ProbeSample& sample,
                                         std::span<double> kPa) mutable {
    const double since = time_s - wait_s;
    const double number = std::clamp(std::floor(since / interval_s), 0.0, count - 1.0);
    const double phase = std::clamp((since - number * interval_s) / press_s, 0.0, 1.0);
    const double turn = 2.0 * std::numbers::pi * phase;
    const double force_mN = largest_mN * (0.5 - 0.5 * std::cos(turn));
    const double radius = contact_mm * std::cbrt(force_mN / largest_mN);
    const double peak_kPa =
        radius > 0.0 ? 1.5 * force_mN / (std::numbers::pi * radius * radius) : 0.0;
    const double ball_x = roll_mm * std::sin(turn);
    double sum_kPa = 0.0;
    for (int i = 0; i < columns * rows; ++i) {
      const int column = i % columns;
      const int row = i / columns;
      double mean = 0.0;
      for (int a = 0; a < kPointsAcross * kPointsAcross && radius > 0.0; ++a) {
        const auto within = [](int k) { return (k + 0.5) / kPointsAcross - 0.5; };
        const double x =
            pitch_mm * (column - 0.5 * (columns - 1) + within(a % kPointsAcross)) - ball_x;
        const double y = pitch_mm * (row - 0.5 * (rows - 1) + within(a / kPointsAcross));
        const double inside = 1.0 - (x * x + y * y) / (radius * radius);
        if (inside > 0.0) mean += peak_kPa * std::sqrt(inside) / (kPointsAcross * kPointsAcross);
      }
      if (noise_kPa > 0.0) mean = std::max(0.0, mean + noise_kPa * irwin_hall(random));
      // In single precision, as the records of pressures are.
      kPa[static_cast<std::size_t>(i)] = static_cast<double>(static_cast<float>(mean));
      sum_kPa += mean;
    }
    sample.time = units::nanoseconds_from_s(time_s);
    sample.force_mN = sum_kPa * pitch_mm * pitch_mm;
    return true;
  };
  return std::unique_ptr<Probe>(
      new SimProbe(std::move(info), std::move(take), rate_Hz, std::floor(samples) + 1.0));
}

}  // namespace merkel
