#include "drivers/probes/replay_probe.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/probes/sample_meter.hpp"
#include "drivers/protocols/trace_file.hpp"
#include "drivers/sessions/session_samples.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr std::size_t kFirst = 256;      ///< samples from which regularity is determined
constexpr std::size_t kMinSamples = 20;  ///< fewer samples: written by hand
constexpr double kRegular = 0.9;         ///< share of steps within a factor of two of the median
constexpr nanoseconds kSparse{50'000'000};
constexpr nanoseconds kLongGap = std::chrono::minutes{1};

/// The median time step, which dropouts and jitter do not affect.
std::optional<nanoseconds> median_period(std::span<const ReadingHead> samples) {
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
nanoseconds validity_of(std::span<const ReadingHead> samples, std::optional<nanoseconds> period) {
  if (!period || samples.size() < kMinSamples || *period > kSparse) return nanoseconds{0};
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

Expected<std::unique_ptr<SampleSource>, SetupError> open_source(const std::string& path,
                                                                std::int64_t probe,
                                                                UnitFactors factors) {
  if (SessionSamples::is_session(path)) {
    if (!factors.empty()) {
      return bad_input(path +
                       " is a session, whose samples are in N and mm: remove its calibration and "
                       "keys such as force_N_per_V");
    }
    return SessionSamples::open(path, static_cast<std::uint32_t>(probe));
  }
  if (probe > 0) {
    return bad_input(path + " is a trace, which contains only one probe: remove the option probe=" +
                     std::to_string(probe));
  }
  auto reader = TraceReader::open(path, std::move(factors));
  if (!reader) return Unexpected<SetupError>(reader.error());
  return std::make_unique<TraceReader>(std::move(*reader));
}

}  // namespace

ReplayProbe::ReplayProbe(std::unique_ptr<SampleSource> source, Readings first, ProbeInfo info,
                         std::size_t chunk)
    : source_(std::move(source)), first_(std::move(first)), info_(std::move(info)), chunk_(chunk) {}

Expected<std::unique_ptr<Probe>, SetupError> ReplayProbe::open(const Uri& uri) {
  UriOptions options(uri);
  const auto chunk = options.whole("chunk", 256, 1, 1'000'000);
  const std::string use = options.word("use", "all", "all|depth|force");
  const auto probe = options.whole("probe", 0, 0, UINT16_MAX);
  auto factors = UnitFactors::from(options);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (!factors) return Unexpected<SetupError>(factors.error());
  auto source = open_source(uri.path, probe, std::move(*factors));
  if (!source) return Unexpected<SetupError>(source.error());
  const std::uint32_t excluded = use == "depth"   ? std::uint32_t{ProbeSample::kForce}
                                 : use == "force" ? std::uint32_t{ProbeSample::kDepth}
                                                  : 0U;
  constexpr std::uint32_t kPress = ProbeSample::kDepth | ProbeSample::kForce;
  if (use != "all" && ((*source)->channels() & ~excluded & kPress) == 0U) {
    return bad_input(uri.path + " has no " + use + ": remove the option use=" + use);
  }
  return play(std::move(*source), {.uri = uri.text,
                                   .name = "recorded trace " + uri.path,
                                   .use = ~excluded,
                                   .chunk = static_cast<std::size_t>(chunk)});
}

Expected<std::unique_ptr<Probe>, SetupError> ReplayProbe::play(std::unique_ptr<SampleSource> source,
                                                               const Playback& playback) {
  const ProbeColumns columns = source->columns();
  Readings first(ReadingColumns(columns), kFirst);
  const auto count = source->read(first, kFirst);
  if (!count) return Unexpected<SetupError>(count.error());
  if (*count == 0) {
    return bad_input(playback.name + " has no samples: there is nothing below its header");
  }
  ProbeInfo info{.uri = playback.uri,
                 .name = playback.name,
                 .serial_number = {},
                 .channels = source->channels() & playback.use,
                 .period = median_period(first.heads()),
                 .replayed = true};
  info.extra_columns = source->extra_columns();
  info.run = source->run();
  info.taxels = columns.taxels;
  std::unique_ptr<ReplayProbe> probe(
      new ReplayProbe(std::move(source), std::move(first), std::move(info), playback.chunk));
  probe->valid_for_ = validity_of(probe->first_.heads(), probe->info_.period);
  probe->take_over(probe->first_, 0);
  return probe;
}

/// Converts readings of the recording, from one on, to those of the probe; collects its notices.
void ReplayProbe::take_over(Readings& readings, std::size_t from) {
  const ProbeColumns own = columns_of(info_);
  for (std::size_t i = from; i < readings.size(); ++i) {
    ReadingHead& head = readings.head(i);
    if (head.valid_for == SampleSource::kNotStated) head.valid_for = valid_for_;
    ProbeSample sample = own.sample(head, readings.row(i));
    const auto doubts = sample.doubts();
    sample.channels &= info_.channels;
    sample.set_doubts(doubts);
    if (!sample.has(ProbeSample::kForce)) sample.force_mN = 0.0;
    if (!sample.has(ProbeSample::kDepth)) sample.depth_mm = 0.0;
    own.put(sample, readings.row(i));
  }
  std::vector<std::string> notices = source_->take_notices();
  if (auto gap = gap_in(readings.heads().subspan(from)); !gap.empty())
    notices.push_back(std::move(gap));
  const std::lock_guard lock(mutex_);
  for (std::string& notice : notices) notices_.push_back(std::move(notice));
}

/// The first long gap in time, as a notice: all of it is simulated, and often it is a wrong unit.
std::string ReplayProbe::gap_in(std::span<const ReadingHead> heads) {
  for (const ReadingHead& sample : heads) {
    const auto before = std::exchange(last_time_, sample.time);
    if (gap_noted_ || !before || sample.time - *before <= kLongGap) continue;
    gap_noted_ = true;
    return info_.name + " has no sample from " + shortest_decimal(units::s_from(*before)) +
           " s to " + shortest_decimal(units::s_from(sample.time)) +
           " s, and all of this time is simulated: is its unit s?";
  }
  return {};
}

std::vector<std::string> ReplayProbe::take_notices() {
  const std::lock_guard lock(mutex_);
  return std::exchange(notices_, {});
}

Expected<std::size_t, ProbeError> ReplayProbe::read(Readings& readings,
                                                    std::chrono::milliseconds /*patience*/) {
  readings.clear();
  const std::size_t wanted = std::min(readings.room(), chunk_);
  const std::size_t before = std::min(wanted, first_.size() - next_of_first_);
  readings.add(first_, next_of_first_, before);
  readings.take_beside(first_);
  next_of_first_ += before;
  if (before < wanted && error_message_.empty()) {
    const auto more = source_->read(readings, wanted - before);
    take_over(readings, before);
    if (!more) error_message_ = more.error().sentence;  // reported after the samples before it
  }
  if (!readings.empty() || !readings.edges().empty()) return readings.size();
  return Unexpected<ProbeError>(error_message_.empty() ? ProbeError::kEndOfStream
                                                       : ProbeError::kBadData);
}

}  // namespace merkel
