#include "tools/scene/sample_stream.hpp"

#include <algorithm>
#include <utility>

#include "core/units.hpp"
#include "drivers/probes/limited_probe.hpp"
#include "drivers/sample_limits.hpp"
#include "realtime/input/probe_queue.hpp"

namespace merkel {
namespace {

constexpr std::uint64_t kTicksToInterrupt = 64;
constexpr std::size_t kMaxWaiting = 4096;  ///< samples of one probe while another is behind

}  // namespace

struct SampleStream::Line {
  Line(std::string the_name, const ProbeInput::Parameters& parameters)
      : name(std::move(the_name)),
        channel(kMaxWaiting),
        contact(parameters.contact, true),
        input(channel, parameters) {}

  std::string name;
  ProbeQueue channel;
  ContactDecision contact;
  ProbeInput input;
  std::optional<std::chrono::nanoseconds> last;  ///< time of the last pushed sample
};

SampleStream::SampleStream(Scene scene, Simulation simulation)
    : scene_(std::move(scene)),
      model_(std::move(simulation.model)),
      encoder_(std::move(simulation.encoder)),
      team_(std::move(simulation.team)),
      step_(std::make_unique<SimulationStep>(*model_, encoder_.get())),
      records_(scene_.probes.size()) {
  for (std::size_t i = 0; i < scene_.probes.size(); ++i) {
    lines_.push_back(
        std::make_unique<Line>("the probe " + std::to_string(i), scene_.probes[i].input));
  }
}

SampleStream::SampleStream(SampleStream&&) noexcept = default;
SampleStream& SampleStream::operator=(SampleStream&&) noexcept = default;
SampleStream::~SampleStream() = default;

Expected<SampleStream, SetupError> SampleStream::create(
    Scene scene, const std::vector<std::uint32_t>& channels) {
  if (channels.size() != scene.probes.size()) {
    return bad_input("the scene has " + std::to_string(scene.probes.size()) +
                     " probes, but samples of " + std::to_string(channels.size()) +
                     " were passed: pass the channels of every probe");
  }
  std::vector<ProbeInfo> probes;
  for (const std::uint32_t of_probe : channels) {
    probes.push_back(
        {.uri = "of the stream", .name = {}, .serial_number = {}, .channels = of_probe});
  }
  auto simulation = make_simulation(scene, probes, RealtimeSettings{.fifo = false});
  if (!simulation) return Unexpected<SetupError>(simulation.error());
  return SampleStream(std::move(scene), std::move(*simulation));
}

std::string SampleStream::fault_of(std::size_t probe, const ProbeSample& sample) const {
  const Line& line = *lines_[probe];
  if (line.channel.ended.load(std::memory_order_relaxed)) {
    return "the stream is finished: make a new one for further samples";
  }
  if (line.last && sample.time <= *line.last) {
    return line.name + " received a sample of " + shortest_decimal(units::s_from(sample.time)) +
           " s after one of " + shortest_decimal(units::s_from(*line.last)) +
           " s: push samples in order of time";
  }
  if (!plausible(sample)) {
    return line.name +
           " received a value that is not finite or too large for a finger: check its unit";
  }
  return press_excess(sample, scene_.probes[probe].limits, line.name);
}

Expected<std::span<const SpikeEvent>, SetupError> SampleStream::push(std::size_t probe,
                                                                     const ProbeSample& sample) {
  if (probe >= lines_.size()) {
    return bad_input("there is no probe " + std::to_string(probe) + ": the scene has " +
                     std::to_string(lines_.size()) + ", counted from 0");
  }
  Line& line = *lines_[probe];
  if (std::string fault = fault_of(probe, sample); !fault.empty()) {
    return bad_input(std::move(fault));
  }
  begin_call();
  if (line.channel.ring->size_approx() >= kMaxWaiting) {
    return bad_input(line.name + " is " + std::to_string(kMaxWaiting) +
                     " samples ahead of another probe: push the samples of all probes in turn");
  }
  ProbeSample decided = sample;
  line.contact.decide(decided);
  static_cast<void>(line.channel.try_push(decided));  // there is room
  line.last = sample.time;
  while (may_go_on()) simulate();
  return std::span<const SpikeEvent>(spikes_);
}

std::span<const SpikeEvent> SampleStream::finish() {
  begin_call();
  for (const auto& line : lines_) line->channel.ended.store(true, std::memory_order_release);
  while (!exhausted() && may_go_on()) simulate();
  if (!interrupted_) {
    const auto last = step_->finish();
    commands_.insert(commands_.end(), last.begin(), last.end());
  }
  return spikes_;
}

Expected<void, SetupError> SampleStream::set_drive(const std::string& electrode, double amplitude,
                                                   double frequency) {
  const auto drive = scene_.encoding.own_drive(electrode, amplitude, frequency);
  if (!drive) return bad_input(drive.error());
  drives_.push_back(*drive);
  return {};
}

std::optional<std::chrono::nanoseconds> SampleStream::time() const noexcept {
  return ticks_ > 0 ? next_ : std::nullopt;
}

/// True if no sample lies in the next tick or after it. A sample at the end of a tick is already
/// consumed then, although it waits for the next one: the queues do not show it.
bool SampleStream::exhausted() const {
  return ticks_ > 0 && std::all_of(lines_.begin(), lines_.end(), [this](const auto& line) {
           return !line->last || *line->last <= *next_;
         });
}

bool SampleStream::ready() {
  if (!next_) {
    for (const auto& line : lines_) {
      const auto first = line->input.first_time();
      if (!first) {
        next_.reset();
        return false;
      }
      next_ = std::min(next_.value_or(*first), *first);
    }
  }
  const auto end = *next_ + model_->parameters().tick;
  return std::all_of(lines_.begin(), lines_.end(),
                     [end](const auto& line) { return line->input.ready_for(end); });
}

void SampleStream::begin_call() {
  if (!std::exchange(interrupted_, false)) {
    spikes_.clear();
    commands_.clear();
  }
}

bool SampleStream::may_go_on() {
  if (!ready()) return false;
  if (interrupt_ && ticks_ % kTicksToInterrupt == 0) interrupted_ = interrupt_();
  return !interrupted_;
}

void SampleStream::simulate() {
  const auto begin = *next_;
  next_ = begin + model_->parameters().tick;
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    const ProbeInput::Reading reading = lines_[i]->input.at(*next_);
    records_[i] = {.time = *next_,
                   .contact = reading.contact,
                   .number = ticks_ + 1,
                   .probe = static_cast<std::uint32_t>(i),
                   .state = reading.state,
                   .doubts = reading.doubts,
                   .touch = reading.touch};
  }
  for (GivenDrive& drive : drives_) {
    drive.time = *next_;
    encoder_->set_drive(drive);
  }
  drives_.clear();
  const SimulationStep::Output made = step_->step(records_);
  spikes_.insert(spikes_.end(), made.spikes.begin(), made.spikes.end());
  commands_.insert(commands_.end(), made.commands.begin(), made.commands.end());
  ++ticks_;
}

}  // namespace merkel
