#include "drivers/probes/replay_probe.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "drivers/probes/sample_meter.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr std::size_t kFirst = 256;  ///< samples from which regularity is determined
constexpr std::size_t kFewest = 20;  ///< fewer samples: written by hand
constexpr double kRegular = 0.9;     ///< share of steps within a factor of two of the median
constexpr nanoseconds kSparse{50'000'000};

/// The median time step, which dropouts and jitter do not affect.
std::optional<nanoseconds> median_period(std::span<const ProbeSample> samples) {
  if (samples.size() < 2) return std::nullopt;
  std::vector<nanoseconds> distances;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    distances.push_back(samples[i].time - samples[i - 1].time);
  }
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

/// Validity of the samples of a trace without valid_for_s. A regular recording has an outage where
/// it is silent for several periods; a sparse one is interpolated.
nanoseconds validity_of(std::span<const ProbeSample> samples, std::optional<nanoseconds> period) {
  if (!period || samples.size() < kFewest || *period > kSparse) return nanoseconds{0};
  std::size_t regular = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const nanoseconds distance = samples[i].time - samples[i - 1].time;
    if (2 * distance >= *period && distance <= 2 * *period) ++regular;
  }
  if (static_cast<double>(regular) < kRegular * static_cast<double>(samples.size() - 1)) {
    return nanoseconds{0};
  }
  return SampleMeter::stale_after(*period);
}

}  // namespace

ReplayProbe::ReplayProbe(TraceReader reader, std::vector<ProbeSample> first, ProbeInfo info,
                         std::size_t chunk)
    : reader_(std::move(reader)), first_(std::move(first)), info_(std::move(info)), chunk_(chunk) {}

Expected<std::unique_ptr<Probe>, SetupError> ReplayProbe::open(const Uri& uri) {
  UriOptions options(uri);
  const auto chunk = options.whole("chunk", 256, 1, 1'000'000);
  const std::string use = options.word("use", "all", "all|depth|force");
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());

  auto reader = TraceReader::open(uri.path);
  if (!reader) return Unexpected<SetupError>(reader.error());
  std::vector<ProbeSample> first(kFirst);
  const auto count = reader->read(first);
  if (!count) return Unexpected<SetupError>(count.error());
  if (*count == 0) {
    return bad_input(uri.path + " holds no samples, only a header: record it again");
  }
  first.resize(*count);
  const std::uint32_t left_out = use == "depth"   ? std::uint32_t{ProbeSample::kForce}
                                 : use == "force" ? std::uint32_t{ProbeSample::kDepth}
                                                  : 0U;
  const std::uint32_t channels = reader->channels() & ~left_out;
  if ((channels & (ProbeSample::kDepth | ProbeSample::kForce)) == 0U) {
    return bad_input(uri.path + " has no " + use + ": remove use=" + use);
  }
  ProbeInfo info{.uri = uri.text,
                 .name = "recorded trace " + uri.path,
                 .serial_number = {},
                 .channels = channels,
                 .period = median_period(first),
                 .replayed = true};
  const bool says = reader->says_validity();
  std::unique_ptr<ReplayProbe> probe(new ReplayProbe(
      std::move(*reader), std::move(first), std::move(info), static_cast<std::size_t>(chunk)));
  if (!says) probe->valid_for_ = validity_of(probe->first_, probe->info_.period);
  probe->left_out_ = left_out;
  probe->take_over(probe->first_);
  return probe;
}

/// Converts the trace's samples to the probe's.
void ReplayProbe::take_over(std::span<ProbeSample> samples) const noexcept {
  for (ProbeSample& sample : samples) {
    if (valid_for_) sample.valid_for = *valid_for_;
    sample.channels &= ~left_out_;
    if (!sample.has(ProbeSample::kForce)) sample.force_mN = 0.0;
    if (!sample.has(ProbeSample::kDepth)) sample.depth_mm = 0.0;
  }
}

Expected<std::size_t, ProbeError> ReplayProbe::read(std::span<ProbeSample> samples,
                                                    std::chrono::milliseconds /*patience*/) {
  const auto wanted = samples.first(std::min(samples.size(), chunk_));
  std::size_t count = std::min(wanted.size(), first_.size() - next_of_first_);
  std::copy_n(first_.begin() + static_cast<std::ptrdiff_t>(next_of_first_), count, wanted.begin());
  next_of_first_ += count;
  if (count < wanted.size() && error_message_.empty()) {
    const auto more = reader_.read(wanted.subspan(count));
    if (more) {
      take_over(wanted.subspan(count, *more));
      count += *more;
    } else {
      error_message_ = more.error().sentence;  // reported after the samples before it
    }
  }
  if (count > 0) return count;
  return Unexpected<ProbeError>(error_message_.empty() ? ProbeError::kEndOfStream
                                                       : ProbeError::kBadData);
}

}  // namespace merkel
