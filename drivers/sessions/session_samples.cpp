#include "drivers/sessions/session_samples.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>
#include <system_error>

#include "core/contact/taxel_array.hpp"

namespace merkel {

bool SessionSamples::is_session(const std::string& path) {
  std::array<char, 4> magic{};
  std::error_code ignored;
  const std::string name = split_rig(path).first;
  if (!std::filesystem::is_regular_file(name, ignored)) return false;  // a pipe is read once
  std::ifstream file(name, std::ios::binary);
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
  for (const std::string& fact : samples->session_.facts(kTaxelFact)) {
    const std::string_view text(fact);
    std::uint32_t number = 0;
    std::size_t taxels = 0;
    const auto [colon, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc{} || colon == text.data() + text.size() || number != probe) continue;
    std::from_chars(colon + 1, text.data() + text.size(), taxels);
    samples->taxels_ = std::min(taxels, TaxelArray::kMax);
    samples->pressures_.resize(samples->taxels_);
  }
  samples->waiting_ = Readings(ReadingColumns(samples->columns()));
  const auto found = samples->refill();
  if (!found) return Unexpected<SetupError>(found.error());
  if (!*found) {
    return bad_input(path + " has no samples of probe " + std::to_string(probe) +
                     ": select another probe with ?probe=N, counted from 0");
  }
  return samples;
}

/// Reads on to a chunk with samples of the probe. False at the end.
Expected<bool, SetupError> SessionSamples::refill() {
  waiting_.clear();
  next_ = 0;
  while (waiting_.empty()) {
    const auto more = session_.next(chunk_);
    if (!more || !*more) return more;
    for (const SyncEdge& edge : chunk_.edges) {
      if (edge.probe == probe_) edges_.push_back(edge);
    }
    for (TaxelZeros zeros : chunk_.zeros) {
      if (std::exchange(zeros.probe, 0) == probe_) zeros_.push_back(zeros);
    }
    if (taxels_ > 0) {
      blocks_.insert(blocks_.end(), chunk_.taxels.begin(), chunk_.taxels.end());
      for (const TickRecord& tick : chunk_.ticks) take_taxels(tick);
      continue;
    }
    for (const DeliveredSample& item : chunk_.samples) {
      if (item.probe != probe_ || (last_ && item.sample.time <= *last_)) continue;
      last_ = item.sample.time;
      ProbeSample sample = item.sample;
      if (!session_.has_validity()) sample.valid_for = kNotStated;
      if (!std::exchange(found_, true)) {
        channels_ = sample.channels;
        channels_ &= (1U << ProbeSample::kDoubtShift) - 1U;
      }
      sample.channels = channels_;
      sample.set_doubts(item.sample.doubts());
      const std::span<double> row = waiting_.add_sample(sample);
      const auto further = waiting_.columns().of(0).further_in(row);
      std::copy_n(item.further.begin(), std::min(item.further.size(), further.size()),
                  further.begin());
    }
  }
  return true;
}

/// A sample at the end of a tick.
void SessionSamples::take_taxels(const TickRecord& tick) {
  if (tick.probe != probe_ || (last_ && tick.time <= *last_)) return;
  for (auto block = blocks_.begin(); block != blocks_.end() && block->tick <= tick.number;) {
    const bool own = block->probe == probe_ && block->first + std::size_t{block->count} <= taxels_;
    if (own) {
      std::copy_n(block->pressure_kPa.begin(), block->count, pressures_.begin() + block->first);
    }
    const bool later = block->tick == tick.number && !own;
    block = later ? std::next(block) : blocks_.erase(block);
  }
  last_ = tick.time;
  channels_ = ProbeSample::kForce;
  ProbeSample sample{.time = tick.time,
                     .force_mN = tick.contact.force_mN,
                     .sequence = next_row_++,
                     .channels = channels_,
                     .touch = tick.touch};
  sample.set_doubts(tick.doubts);
  const std::span<double> row = waiting_.add_sample(sample);
  std::ranges::copy(pressures_, waiting_.columns().of(0).taxels_in(row).begin());
}

Expected<std::size_t, SetupError> SessionSamples::read(Readings& readings, std::size_t most) {
  std::size_t count = 0;
  while (count < most) {
    if (next_ == waiting_.size()) {
      const auto more = refill();
      if (!more) return Unexpected<SetupError>(more.error());
      if (!*more) break;
    }
    const std::size_t part = std::min(most - count, waiting_.size() - next_);
    readings.add(waiting_, next_, part);
    next_ += part;
    count += part;
  }
  readings.edges().insert(readings.edges().end(), edges_.begin(), edges_.end());
  edges_.clear();
  readings.zeros().insert(readings.zeros().end(), zeros_.begin(), zeros_.end());
  zeros_.clear();
  // A recording has arrived when it was made; a replay has its samples at once.
  for (ReadingHead& head : readings.heads().last(count)) head.arrival = head.time;
  return count;
}

}  // namespace merkel
