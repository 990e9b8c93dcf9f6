#include "drivers/probes/replay_probe.hpp"

#include <algorithm>
#include <optional>
#include <utility>

namespace merkel {
namespace {

/// The median distance in time: dropouts and jitter leave it alone.
std::optional<std::chrono::nanoseconds> median_period(std::span<const ProbeSample> samples) {
  if (samples.size() < 2) return std::nullopt;
  std::vector<std::chrono::nanoseconds> distances;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    distances.push_back(samples[i].time - samples[i - 1].time);
  }
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

}  // namespace

ReplayProbe::ReplayProbe(TraceReader reader, std::vector<ProbeSample> first, ProbeInfo info,
                         std::size_t chunk)
    : reader_(std::move(reader)), first_(std::move(first)), info_(std::move(info)), chunk_(chunk) {}

Expected<std::unique_ptr<Probe>, SetupError> ReplayProbe::open(const Uri& uri) {
  UriOptions options(uri);
  const auto chunk = options.whole("chunk", 256, 1, 1'000'000);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());

  auto reader = TraceReader::open(uri.path);
  if (!reader) return Unexpected<SetupError>(reader.error());
  std::vector<ProbeSample> first(64);
  const auto count = reader->read(first);
  if (!count) return Unexpected<SetupError>(count.error());
  if (*count == 0) {
    return bad_input(uri.path + " holds no samples: there is nothing below its header");
  }
  first.resize(*count);
  ProbeInfo info{.uri = uri.text,
                 .name = "recorded trace " + uri.path,
                 .serial_number = {},
                 .channels = reader->channels(),
                 .period = median_period(first),
                 .replayed = true};
  return std::unique_ptr<Probe>(new ReplayProbe(std::move(*reader), std::move(first),
                                                std::move(info), static_cast<std::size_t>(chunk)));
}

Expected<std::size_t, ProbeError> ReplayProbe::read(std::span<ProbeSample> samples,
                                                    std::chrono::milliseconds /*patience*/) {
  const auto wanted = samples.first(std::min(samples.size(), chunk_));
  std::size_t count = std::min(wanted.size(), first_.size() - next_of_first_);
  std::copy_n(first_.begin() + static_cast<std::ptrdiff_t>(next_of_first_), count, wanted.begin());
  next_of_first_ += count;
  if (count < wanted.size() && trouble_.empty()) {
    const auto more = reader_.read(wanted.subspan(count));
    if (more) {
      count += *more;
    } else {
      trouble_ = more.error().sentence;  // told once the samples before it are handed over
    }
  }
  if (count > 0) return count;
  return Unexpected<ProbeError>(trouble_.empty() ? ProbeError::kEndOfStream : ProbeError::kBadData);
}

}  // namespace merkel
