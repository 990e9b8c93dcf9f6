#include "drivers/sessions/session_samples.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

namespace merkel {

bool SessionSamples::is_session(const std::string& path) {
  std::array<char, 4> magic{};
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return false;  // a pipe is read once
  std::ifstream file(path, std::ios::binary);
  return file.read(magic.data(), magic.size()) && std::string_view(magic.data(), 4) == "XDF:";
}

Expected<std::unique_ptr<SampleSource>, SetupError> SessionSamples::open(const std::string& path,
                                                                         std::uint32_t probe) {
  auto session = SessionReader::open(path);
  if (!session) return Unexpected<SetupError>(session.error());
  const auto origin = session_origin(*session);
  if (!origin) return Unexpected<SetupError>(origin.error());
  const auto start = session_start(*session);
  if (!start) return Unexpected<SetupError>(start.error());
  std::unique_ptr<SessionSamples> samples(new SessionSamples(
      std::move(*session), probe, {.start = *start, .zero = origin->start, .utc = origin->utc}));
  const auto found = samples->refill();
  if (!found) return Unexpected<SetupError>(found.error());
  if (!*found) {
    return bad_input(path + " has no samples of probe " + std::to_string(probe) +
                     ": select another probe with ?probe=N, counted from 0");
  }
  samples->channels_ = samples->waiting_.front().channels;
  return samples;
}

/// Reads on to a chunk with samples of the probe. False at the end.
Expected<bool, SetupError> SessionSamples::refill() {
  waiting_.clear();
  next_ = 0;
  while (waiting_.empty()) {
    const auto more = session_.next(chunk_);
    if (!more || !*more) return more;
    for (const DeliveredSample& item : chunk_.samples) {
      if (item.probe != probe_ || (last_ && item.sample.time <= *last_)) continue;
      last_ = item.sample.time;
      waiting_.push_back(item.sample);
    }
  }
  return true;
}

Expected<std::size_t, SetupError> SessionSamples::read(std::span<ProbeSample> samples) {
  std::size_t count = 0;
  while (count < samples.size()) {
    if (next_ == waiting_.size()) {
      const auto more = refill();
      if (!more) return Unexpected<SetupError>(more.error());
      if (!*more) break;
    }
    const std::size_t part = std::min(samples.size() - count, waiting_.size() - next_);
    const auto first = waiting_.begin() + static_cast<std::ptrdiff_t>(next_);
    std::copy_n(first, part, samples.begin() + static_cast<std::ptrdiff_t>(count));
    next_ += part;
    count += part;
  }
  // A recording has arrived when it was made; a replay has its samples at once.
  for (ProbeSample& sample : samples.first(count)) {
    sample.arrival = sample.time;
    sample.channels = channels_;
  }
  return count;
}

}  // namespace merkel
