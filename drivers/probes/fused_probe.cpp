#include "drivers/probes/fused_probe.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/probes/open_probe.hpp"
#include "drivers/sample_channels.hpp"
#include "drivers/take_part.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr std::size_t kMaxWaiting = 100'000;
constexpr std::size_t kLinesOfMember = 16;
constexpr std::string_view kScheme = "fused:";

}  // namespace

Expected<std::unique_ptr<Probe>, SetupError> FusedProbe::open(std::string_view text,
                                                              bool allow_remote) {
  std::vector<std::unique_ptr<Probe>> members;
  for (const std::string_view uri : members_of(text)) {
    if (uri.starts_with(kScheme))
      return bad_input("a fused probe cannot be a member of another one");
    auto member = open_probe(uri, allow_remote);
    if (!member) return member;
    members.push_back(std::move(*member));
  }
  return fuse(text, std::move(members));
}

std::vector<std::string_view> FusedProbe::members_of(std::string_view uri) {
  if (!uri.starts_with(kScheme)) return {uri};
  std::vector<std::string_view> members;
  for (std::string_view rest = uri.substr(kScheme.size()); !rest.empty();) {
    members.push_back(take_part(rest, '|'));
  }
  return members;
}

Expected<std::unique_ptr<Probe>, SetupError> FusedProbe::fuse(
    std::string_view uri, std::vector<std::unique_ptr<Probe>> members) {
  const std::string name(uri);
  if (members.size() < 2) {
    return bad_input("\"" + name +
                     "\" has fewer than two members: separate two probes by |, for example "
                     "fused:serial:/dev/ttyUSB0?protocol=mark10|serial:/dev/ttyACM0?protocol=grbl");
  }
  ProbeInfo info{.uri = name,
                 .name = "",
                 .serial_number = {},
                 .channels = 0,
                 .period = members[0]->info().period};
  std::vector<Member> parts(members.size());
  for (std::size_t i = 0; i < members.size(); ++i) {
    const ProbeInfo& of = members[i]->info();
    if (of.replayed) {
      return bad_input(
          "\"" + of.uri +
          "\" is a recording or simulation: only devices share the host's clock and can be fused");
    }
    parts[i].fills = of.channels & ~info.channels;
    if (parts[i].fills == 0U) {
      return bad_input("\"" + of.uri + "\" adds no channel to the earlier members: remove it");
    }
    info.channels |= parts[i].fills;
    info.name += (i == 0 ? "" : " and ") + of.name;
    info.calibration_file +=
        (info.calibration_file.empty() || of.calibration_file.empty() ? "" : "+") +
        of.calibration_file;
    info.calibrated |= of.calibrated & parts[i].fills;
    info.calibration += of.calibration;
    info.serial_number += (i == 0 || of.serial_number.empty() ? "" : "+") + of.serial_number;
    parts[i].probe = std::move(members[i]);
  }
  return std::unique_ptr<Probe>(new FusedProbe(std::move(info), std::move(parts)));
}

FusedProbe::FusedProbe(ProbeInfo info, std::vector<Member> members)
    : info_(std::move(info)), members_(std::move(members)) {
  for (Member& member : members_) {
    threads_.emplace_back(
        [this, &member](const std::stop_token& stop) { read_member(member, stop); });
  }
}

FusedProbe::~FusedProbe() {
  for (std::jthread& thread : threads_) thread.request_stop();
  for (std::jthread& thread : threads_) thread.join();
}

void FusedProbe::read_member(Member& member, const std::stop_token& stop) {
  Readings readings = member.probe->readings(256);
  while (!stop.stop_requested()) {
    const auto count = member.probe->read(readings, milliseconds{20});
    const std::scoped_lock lock(mutex_);
    if (!count) {
      member.ended = true;
      member.error_message = member.probe->error_message();
      more_.notify_one();
      return;
    }
    // Without a reader, the oldest samples are dropped.
    for (std::size_t i = 0; i < *count; ++i) {
      if (const auto sample = readings.sample(i)) member.samples.push_back(*sample);
    }
    if (member.edges.size() < kMaxWaiting) {
      member.edges.insert(member.edges.end(), readings.edges().begin(), readings.edges().end());
    }
    while (member.samples.size() > kMaxWaiting) drop_oldest(member);
    if (*count > 0) more_.notify_one();
  }
}

void FusedProbe::drop_oldest(Member& member) {
  tared_ = tared_ || member.samples.front().touch == Touch::kTared;
  member.samples.pop_front();
}

/// Interpolates the other members to the time of a sample.
FusedProbe::Fill FusedProbe::fill(ProbeSample& sample) {
  const nanoseconds now = std::chrono::steady_clock::now().time_since_epoch();
  const bool patient = now - sample.arrival < nanoseconds{kPatience};
  for (std::size_t i = 1; i < members_.size(); ++i) {
    Member& member = members_[i];
    auto& waiting = member.samples;
    while (waiting.size() > 1 && waiting[1].time <= sample.time) drop_oldest(member);
    if (waiting.empty() || waiting.front().time > sample.time) {
      // No earlier sample: the member starts later, or it is silent.
      if (!waiting.empty() || member.ended) return Fill::kNever;
      return patient ? Fill::kWait : Fill::kNever;
    }
    ProbeSample& before = waiting.front();
    const bool exact = before.time == sample.time;
    if (!exact && waiting.size() < 2) {
      if (!member.ended && patient) return Fill::kWait;
      if (sample.time - before.time > nanoseconds{kPatience}) return Fill::kNever;
    }
    const ProbeSample& after = waiting.size() > 1 ? waiting[1] : before;
    // Across a tare, no value lies between its neighbours.
    const bool holds = exact || waiting.size() < 2 || after.touch == Touch::kTared;
    const double fraction = holds ? 0.0
                                  : static_cast<double>((sample.time - before.time).count()) /
                                        static_cast<double>((after.time - before.time).count());
    if (std::exchange(before.touch, Touch::kUndecided) == Touch::kTared) tared_ = true;
    sample.set_doubts(sample.doubts() | before.doubts() | (holds ? 0U : after.doubts()));
    for (const SampleChannel& channel : kProbeChannels) {
      if (!channel.in(member.fills)) continue;
      const double from = before.*channel.member;
      sample.*channel.member = from + (after.*channel.member - from) * fraction;
      sample.channels |= channel.bit;
    }
  }
  return Fill::kFilled;
}

Expected<std::size_t, ProbeError> FusedProbe::read(Readings& readings, milliseconds patience) {
  readings.clear();
  std::unique_lock lock(mutex_);
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (true) {
    auto& first = members_[0].samples;
    while (readings.room() > 0 && !first.empty()) {
      ProbeSample sample = first.front();
      const Fill filled = fill(sample);
      if (filled == Fill::kWait) break;
      drop_oldest(members_[0]);
      if (filled != Fill::kFilled) continue;
      if (std::exchange(tared_, false)) sample.touch = Touch::kTared;
      sample.arrival = std::chrono::steady_clock::now().time_since_epoch();
      readings.add_sample(sample);
    }
    for (std::size_t i = 0; i < members_.size(); ++i) {
      for (SyncEdge edge : std::exchange(members_[i].edges, {})) {
        // Each member numbers its lines from 1.
        edge.line = static_cast<std::uint16_t>(edge.line + i * kLinesOfMember);
        readings.edges().push_back(edge);
      }
    }
    if (!readings.empty() || !readings.edges().empty()) return readings.size();
    if (members_[0].ended && first.empty()) {
      return Unexpected<ProbeError>(members_[0].error_message.empty() ? ProbeError::kEndOfStream
                                                                      : ProbeError::kDisconnected);
    }
    if (more_.wait_until(lock, deadline) == std::cv_status::timeout) return std::size_t{0};
  }
}

std::string FusedProbe::error_message() const {
  const std::scoped_lock lock(mutex_);
  for (const Member& member : members_) {
    if (!member.error_message.empty()) return member.error_message;
  }
  return {};
}

ProbeStatus FusedProbe::status() const {
  ProbeStatus status;
  std::optional<DeviceCounts>& sum = status.device;
  for (const Member& member : members_) {
    const ProbeStatus of_member = member.probe->status();
    status.connected = status.connected && of_member.connected;
    for (const OutputFaults& faults : of_member.faults) {
      OutputFaults& all = status.faults.empty() ? status.faults.emplace_back() : status.faults[0];
      if (all.lack.empty()) all.lack = faults.lack;
      all.saturated += faults.saturated;
      all.outside_calibration += faults.outside_calibration;
    }
    const auto& counts = of_member.device;
    if (!counts) continue;
    if (!sum) {
      sum = counts;
      continue;
    }
    sum->port += (sum->port.empty() || counts->port.empty() ? "" : " and ") + counts->port;
    merge(*sum, *counts);
    if (sum->unexpected.empty()) sum->unexpected = counts->unexpected;
    sum->age_ms = std::max(sum->age_ms, counts->age_ms);
    sum->clock_mistrusted = sum->clock_mistrusted || counts->clock_mistrusted;
    if (std::abs(counts->clock_rate - 1.0) > std::abs(sum->clock_rate - 1.0)) {
      sum->clock_rate = counts->clock_rate;
    }
    if (counts->uncertainty_us) {
      sum->uncertainty_us = std::max(sum->uncertainty_us.value_or(0.0), *counts->uncertainty_us);
    }
  }
  return status;
}

bool FusedProbe::request_tare(std::size_t /*output*/) noexcept {
  const auto measures_force = [](const Member& member) {
    return (member.fills & ProbeSample::kForce) != 0U;
  };
  const bool any = std::any_of(members_.begin(), members_.end(), measures_force);
  bool accepted = false;
  for (const Member& member : members_) {
    if (!any || measures_force(member)) accepted = member.probe->request_tare(0) || accepted;
  }
  return accepted;
}

std::vector<std::string> FusedProbe::take_notices() {
  std::vector<std::string> all;
  for (const Member& member : members_) {
    for (std::string& notice : member.probe->take_notices()) all.push_back(std::move(notice));
  }
  return all;
}

}  // namespace merkel
