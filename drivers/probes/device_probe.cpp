#include "drivers/probes/device_probe.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "core/printed.hpp"
#include "core/units.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/probes/channel_selection.hpp"
#include "drivers/probes/device_opening.hpp"
#include "drivers/probes/sample_meter.hpp"
#include "drivers/probes/taxel_readings.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr milliseconds kBoot{3000};
constexpr milliseconds kFirstBackoff{50};
constexpr milliseconds kMaxBackoff{400};
constexpr milliseconds kUnknownPeriod{1000};
constexpr std::size_t kHeardBytes = 8192;
constexpr std::uint64_t kAgeReadings = 10'000;  ///< window of their mean age
constexpr milliseconds kReaderPause{100};       ///< a longer pause of its thread is the host's

}  // namespace

DeviceProbe::Settings DeviceProbe::settings_from(UriOptions& options, const Uri& uri,
                                                 const DeviceUri& device) {
  Settings settings{.uri = uri.text};
  settings.parts = device.parts;
  settings.calibrations = device.calibrations;
  const std::string times = options.word("clock", "mapped", "mapped|device|arrival");
  settings.times = times == "mapped"   ? ReadingTimes::Rule::kMapped
                   : times == "device" ? ReadingTimes::Rule::kDevice
                                       : ReadingTimes::Rule::kArrival;
  // Only these wait until they are read.
  const bool waits = uri.scheme == "tcp" || uri.scheme == "serial";
  settings.live = !waits || options.whole("live", 1, 0, 1) == 1;
  if (!settings.live) settings.times = ReadingTimes::Rule::kUnmapped;
  settings.calibration = options.text("calibration", "");
  settings.sync = options.text("sync", "");
  // A board that resets when its port is opened is silent until it has booted.
  const bool boots = uri.scheme == "serial" && !options.given("timeout_ms");
  settings.silence = milliseconds{options.whole("timeout_ms", 2000, 100, 60'000)};
  settings.quality.share = options.number("bad_share", settings.quality.share, 0.01, 1.01);
  settings.quality.window =
      milliseconds{options.whole("bad_window_ms", settings.quality.window.count(), 10, 60'000)};
  settings.boot = boots ? kBoot : milliseconds{0};
  return settings;
}

DeviceProbe::DeviceProbe(std::unique_ptr<Transport> transport, std::unique_ptr<Protocol> protocol,
                         Settings settings)
    : settings_(std::move(settings)),
      transport_(std::move(transport)),
      protocol_(std::move(protocol)),
      times_(settings_.times),
      quality_(settings_.quality),
      buffer_(4096) {}

DeviceProbe::~DeviceProbe() {
  if (!connected_) return;
  stream_.outgoing.clear();
  protocol_->end(stream_);
  static_cast<void>(send());
}

Expected<std::unique_ptr<Probe>, SetupError> DeviceProbe::open(std::unique_ptr<Transport> transport,
                                                               std::unique_ptr<Protocol> protocol,
                                                               Settings settings) {
  std::unique_ptr<DeviceProbe> probe(
      new DeviceProbe(std::move(transport), std::move(protocol), std::move(settings)));
  if (auto heard = probe->listen(); !heard) return Unexpected<SetupError>(heard.error());
  if (auto done = probe->make_outputs(); !done) return Unexpected<SetupError>(done.error());
  return probe;
}

Expected<void, SetupError> DeviceProbe::listen() {
  const Time started = now();
  stream_.from_start = !settings_.live && settings_.uri.starts_with("tcp:");
  protocol_->begin(started, stream_);
  log_.opened(started);
  const auto heard = [&] {
    return protocol_->ready() && quality_.trusted() &&
           (protocol_->describes_itself() || stream_.counts.readings > 0);
  };
  Time deadline = started + settings_.silence + settings_.boot;
  bool silent = true;
  while (!heard()) {
    if (silent && stream_.counts.bytes > 0) {
      silent = false;
      deadline = std::min(deadline, now() + settings_.silence);
    }
    if (now() >= deadline || !protocol_->error_message().empty()) {
      return Unexpected<SetupError>(
          no_valid_data({.name = transport_->info().name,
                         .scheme = settings_.uri.substr(0, settings_.uri.find(':')),
                         .protocol = settings_.protocol,
                         .hint = settings_.hint,
                         .waited = std::chrono::duration_cast<milliseconds>(now() - started),
                         .protocol_error = protocol_->error_message(),
                         .counts = stream_.counts,
                         .heard = heard_,
                         .rejected = stream_.rejected,
                         .expected = expected(),
                         .notices = stream_.notices}));
    }
    if (!exchange(std::min(deadline, now() + milliseconds{20}))) {
      return closed_while_opening({.name = settings_.uri,
                                   .scheme = settings_.uri.substr(0, settings_.uri.find(':')),
                                   .protocol = settings_.protocol,
                                   .counts = stream_.counts,
                                   .heard = heard_});
    }
    // One that describes itself sends no readings yet: its HELLO is the evidence.
    if (!protocol_->describes_itself()) judge_quality();
    if (settings_.live) {
      stream_.readings.clear();
      stream_.edges.clear();
    }
    times_.set_wrap(protocol_->clock_wrap());
    times_.observe(std::exchange(stream_.exchanges, {}));
  }
  if (!stream_.readings.empty() && !stream_.readings.front().device_time) {
    return bad_input("\"" + settings_.uri +
                     "\": live=0 reads a device on its own times, but it sends none: add a time "
                     "column, such as time_s, or remove live=0");
  }
  // What was sent to be recognised is no sign of life any more.
  if (settings_.live) stream_.counts.bytes = 0;
  name_ = settings_.protocol + " at " + transport_->info().name;
  counts_.port = transport_->info().note;
  opened_serial_number_ = protocol_->serial_number();
  return {};
}

Expected<void, SetupError> DeviceProbe::make_outputs() {
  const ProbeInfo device{.uri = settings_.uri,
                         .name = name_,
                         .serial_number = printable_text(protocol_->serial_number().empty()
                                                             ? transport_->info().serial_number
                                                             : protocol_->serial_number()),
                         .channels = 0,
                         .period = protocol_->period(),
                         .replayed = !settings_.live,
                         .calibration_file = settings_.calibration};
  const std::vector<ChannelName> names = protocol_->channel_names();
  const auto refuse = [&](const std::string& why) {
    return bad_input("\"" + settings_.uri + "\": " + why);
  };
  auto lines = SyncLines::choose(settings_.sync, names);
  if (!lines) return refuse(lines.error());
  sync_lines_ = std::move(*lines);
  const std::vector<ChannelSelection> parts =
      settings_.parts.empty() ? std::vector<ChannelSelection>(1) : settings_.parts;
  std::vector<std::string> files = settings_.calibrations;
  files.resize(parts.size());
  const bool in_scene = std::any_of(files.begin(), files.end(),
                                    [](const std::string& file) { return !file.empty(); });
  if ((parts.size() > 1 || in_scene) && !settings_.calibration.empty()) {
    return refuse(
        "the option calibration is for a device with one probe: remove it, and give each probe its "
        "own by the key calibration of [[probe]]");
  }
  if (!in_scene) files.front() = settings_.calibration;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const ChannelSelection& wanted = parts[i];
    if (wanted.taxels) {
      // The factors of its columns are in effect already.
      const auto file = files[i].empty() ? ProbeCalibration{} : read_calibration(files[i]);
      if (!file) return Unexpected<SetupError>(file.error());
      if (file->has_channels()) {
        return refuse("a tactile array measures its zero itself: remove its calibration");
      }
      auto channels = taxel_channels(names, wanted.taxels->prefix);
      if (const std::string why = wrong_taxels(channels.size(), *wanted.taxels); !why.empty()) {
        return refuse(why);
      }
      ProbeInfo info = device;
      info.uri += "#" + wanted.text();
      info.name += ", " + std::to_string(channels.size()) + " taxels";
      info.channels = ProbeSample::kForce;
      info.taxels = channels.size();
      outputs_.emplace_back(std::move(info), std::move(channels), *wanted.taxels);
      continue;
    }
    const auto chosen = wanted.among(names);
    if (!chosen) return refuse(chosen.error());
    auto calibration = read_calibration_of_device(
        files[i], device.serial_number, protocol_->channels(), wanted.empty() ? nullptr : &*chosen);
    if (!calibration) return Unexpected<SetupError>(calibration.error());
    ProbeInfo info = device;
    if (!wanted.empty()) {
      info.uri += "#" + wanted.text();
      info.name += ", " + names_of_channels(*chosen);
    }
    info.calibration_file = files[i];
    info.calibrated = calibration->channels_of_file();
    info.channels = calibration->sample_channels();
    info.calibration = calibration_text(*calibration, "of " + info.name);
    std::vector<DeviceChannel> further;
    for (const ChannelName& each : names) {
      if (!wanted.empty() || !is_named(each.channel)) continue;
      info.device_channels.push_back(printable_text(in_unit_of_readings(each)));
      if (further.size() == ProbeColumns::kMaxFurther) continue;
      further.push_back(each.channel);
      info.extra_columns.push_back(info.device_channels.back());
    }
    const std::size_t named = info.device_channels.size();
    if (named > further.size()) {
      const std::size_t taxels = taxel_channels(names, "").size();
      notice(name_ + " has " + std::to_string(named) + " channels, of which only the first " +
             std::to_string(further.size()) + " are kept" +
             (taxels == 0 ? ""
                          : ": a tactile array is read with tip = \"taxels\" in a scene, or with "
                            "#taxels=" +
                                std::to_string(taxels) + " at the end of its URI"));
    }
    outputs_.emplace_back(std::move(info), std::move(*calibration), std::move(further));
  }
  for (const DeviceOutput& each : outputs_) infos_.push_back(each.info());
  faults_.resize(outputs_.size());
  ready_ = readings();
  return {};
}

bool DeviceProbe::send() {
  if (stream_.outgoing.empty()) return true;
  const Bytes bytes = std::exchange(stream_.outgoing, {});
  log_.sent(bytes, now());
  return transport_->write(bytes).has_value();
}

bool DeviceProbe::exchange(Time until) {
  const Time started = now();
  if (started - last_exchange_ > kReaderPause) held_up_until_ = started;
  const auto wake = protocol_->poll(started, stream_);
  if (!send()) return false;
  const Time end = wake ? std::min(until, *wake) : until;
  const auto count = transport_->read(buffer_, std::max(end - now(), Time{0}));
  const Time arrival = now();
  if (arrival - std::max(started, end) > kReaderPause) held_up_until_ = arrival;
  last_exchange_ = arrival;
  follow_restarts(arrival);
  if (!count) return false;
  if (*count > 0) {
    end_outage(arrival);
    const auto bytes = std::span<const std::uint8_t>(buffer_).first(*count);
    if (heard_.size() < kHeardBytes && !started_)
      heard_.insert(heard_.end(), bytes.begin(), bytes.end());
    const std::uint64_t bad = stream_.counts.bad();
    stream_.answer.clear();
    protocol_->take(bytes, arrival, stream_);
    if (stream_.answer.empty()) {  // a protocol without lines, or no line is complete
      stream_.answer.assign(bytes.begin(), bytes.end());
      if (stream_.counts.bad() > bad) stream_.rejected = stream_.answer;
    }
    log_.received(bytes, arrival, stream_.counts);
  }
  if (const TransportInfo& port = transport_->info(); port.rejected != rejected_datagrams_) {
    rejected_datagrams_ = port.rejected;
    stream_.counts.bytes += port.newest_rejected.size();
    stream_.rejected = port.newest_rejected;
  }
  return send();
}

/// A port whose buffer was full has lost data and begins anew.
void DeviceProbe::follow_restarts(Time time) {
  const std::uint64_t restarts = transport_->info().restarts;
  if (restarts == counts_.overruns) return;
  counts_.overruns = restarts;
  overran_ = true;
  protocol_->begin(time, stream_);
  log_.opened(time);
  notice(name_ +
         " has lost readings: its buffer was full, because this machine did not read it in time; "
         "it is started anew");
}

std::string DeviceProbe::expected() const {
  return protocol_->expected(stream_.rejected.empty() ? stream_.answer : stream_.rejected);
}

std::string DeviceProbe::to_check() const {
  return what_to_check(stream_.rejected, settings_.uri.substr(0, settings_.uri.find(':')),
                       settings_.hint);
}

Expected<std::size_t, ProbeError> DeviceProbe::read(Readings& readings, milliseconds patience) {
  const Time until = now() + patience;
  if (!started_) start();
  do {
    if (!connected_ && (!settings_.live || !connect_again(until))) break;
    if (!exchange(until)) {
      disconnected(now());
      continue;
    }
    take_readings();
  } while (ready_->empty() && now() < until);
  publish();
  readings.clear();
  std::swap(readings.edges(), edges_);
  std::swap(readings.zeros(), zeros_);
  const std::size_t count = std::min(readings.room(), ready_->size() - next_ready_);
  readings.add(*ready_, next_ready_, count);
  next_ready_ += count;
  if (next_ready_ == ready_->size()) clear_ready();
  if (count == 0 && !connected_ && !settings_.live) {
    return Unexpected<ProbeError>(ProbeError::kEndOfStream);
  }
  return count;
}

void DeviceProbe::clear_ready() {
  ready_->clear();
  next_ready_ = 0;
}

void DeviceProbe::start() {
  if (settings_.live) discard_old_input();
  judged_ = stream_.counts;
  protocol_->start(now(), stream_);
  log_.started(now(), stream_.counts);
  started_ = true;
  last_sense_ = now();
  frames_at_last_sense_ = stream_.counts.frames;
  bytes_at_last_sense_ = stream_.counts.bytes;
}

/// Input from the time without a reader is out of date.
void DeviceProbe::discard_old_input() {
  constexpr milliseconds kSlowDiscard{10};
  constexpr std::chrono::microseconds kSlowRead{500};  ///< on average
  const Time begun = now();
  // On a network, each read returns one datagram: read as many as a socket can hold.
  for (std::size_t reads = 0; reads < 4096; ++reads) {
    const auto bytes = stream_.counts.bytes;
    if (!exchange(Time{0})) {
      disconnected(now());
      break;
    }
    if (stream_.counts.bytes == bytes) break;
    // Reads so slow that each finds input that came meanwhile would never end.
    const Time elapsed = now() - begun;
    const bool whole = stream_.counts.bytes - bytes >= buffer_.size();
    const auto slow = kSlowRead * static_cast<std::int64_t>(reads + 1);
    if (!whole && elapsed > kSlowDiscard && elapsed > slow) break;
  }
  stream_.readings.clear();
  stream_.edges.clear();
  stream_.counts.lost = stream_.counts.damaged = stream_.counts.refused = 0;
  stream_.counts.without_value = stream_.counts.reordered = 0;
  stream_.rejected.clear();
}

void DeviceProbe::disconnected(Time time) {
  connected_ = false;
  if (!settings_.live) {
    take_readings();
    return;
  }
  if (std::exchange(away_, true)) {  // its port opens, and closes again
    backoff_ = std::min<Time>(2 * backoff_, kMaxBackoff);
  } else {
    lost_since_ = time;
    backoff_ = kFirstBackoff;
    ++counts_.outages;
    notice(name_ + " is disconnected: the press is released until it returns");
  }
  try_again_ = time + backoff_;
  // Readings from before the disconnection are still valid.
  take_readings();
}

bool DeviceProbe::connect_again(Time until) {
  const Time next = std::min(until, try_again_);
  if (now() < next) settings_.clock->sleep_for(next - now());
  if (now() < try_again_) return false;
  if (transport_->reopen()) {
    const Time time = now();
    connected_ = true;
    stream_.outgoing.clear();
    protocol_->begin(time, stream_);
    log_.opened(time);
    last_sense_ = time;
    return true;
  }
  backoff_ = std::min<Time>(2 * backoff_, kMaxBackoff);
  try_again_ = now() + backoff_;
  return false;
}

/// A port that opens has not sent anything yet.
void DeviceProbe::end_outage(Time time) {
  if (!std::exchange(away_, false)) return;
  counts_.outage_ns += static_cast<std::uint64_t>((time - lost_since_).count());
  const std::chrono::duration<double> outage = time - lost_since_;
  notice(name_ + printed(" is back after %.3g s", outage.count()));
}

void DeviceProbe::take_readings() {
  for (std::string& sentence : std::exchange(stream_.notices, {})) {
    notice(name_ + ": " + sentence);
  }
  if (const std::uint64_t count = stream_.take_dropped_notices()) notices_.dropped(count);
  times_.set_wrap(protocol_->clock_wrap());
  times_.observe(std::exchange(stream_.exchanges, {}));
  std::vector<DeviceReading> readings = std::exchange(stream_.readings, {});
  if (std::exchange(stream_.columns_changed, false)) {
    const std::vector<ChannelName> channels = protocol_->channel_names();
    for (DeviceOutput& output : outputs_) {
      if (const auto sentence = output.take_channels(channels)) notice(*sentence);
    }
  }
  judge_quality();
  if (!quality_.trusted()) {
    counts_.withheld += readings.size();
    readings.clear();
  }
  if (!readings.empty() && !same_device()) {
    stream_.counts.refused += readings.size();
    judged_.refused += readings.size();  // valid, but of another device
    readings.clear();
  }
  counts_.largest_batch = std::max<std::uint64_t>(counts_.largest_batch, readings.size());
  const std::vector<Time> times = times_.of(readings);
  if (!settings_.live) {
    for (std::size_t i = 0; i < readings.size(); ++i) readings[i].arrival = times[i];
  }
  for (const std::string& sentence : times_.take_notices()) notice(name_ + ": " + sentence);
  const auto period = protocol_->period();
  if (overran_ && period && !readings.empty()) {
    const std::int64_t missed = (times.front() - last_time_ - *period / 2) / *period;
    readings.front().lost +=
        static_cast<std::uint32_t>(std::clamp<std::int64_t>(missed, 0, 1U << 31U));
    stream_.counts.lost += readings.front().lost;
    overran_ = false;
  }
  for (std::size_t i = 0; i < readings.size(); ++i) {
    sync_lines_.take(readings[i], times[i], edges_);
    deliver(readings[i], times[i]);
  }
  for (const DeviceEdge& edge : std::exchange(stream_.edges, {})) {
    if (!started_ || other_device_reported_) continue;
    edges_.push_back({.time = times_.of_edge(edge.device_time, edge.arrival),
                      .line = edge.line,
                      .level = static_cast<std::uint16_t>(edge.high ? 1 : 0)});
  }
  if (edges_.size() > 1) {
    std::stable_sort(edges_.begin(), edges_.end(),
                     [](const SyncEdge& a, const SyncEdge& b) { return a.time < b.time; });
  }
  const Time time = now();
  if (stream_.counts.frames != frames_at_last_sense_) {
    frames_at_last_sense_ = stream_.counts.frames;
    bytes_at_last_sense_ = stream_.counts.bytes;
    last_sense_ = time;
    if (std::exchange(silence_reported_, false)) notice(name_ + " sends again");
  } else if (time - last_sense_ > settings_.silence && !silence_reported_) {
    notice(name_ + (stream_.counts.bytes == bytes_at_last_sense_
                        ? " has stopped sending: check that it is switched on and streaming"
                        : " no longer sends valid data, but " +
                              answer_and_expected(
                                  stream_.rejected.empty() ? stream_.answer : stream_.rejected,
                                  expected()) +
                              "; check " + to_check()));
    silence_reported_ = true;
  }
}

/// Judges what has arrived since the last call.
void DeviceProbe::judge_quality() {
  const ProtocolCounts& counts = stream_.counts;
  const bool changed =
      quality_.add(counts.readings - judged_.readings, counts.bad() - judged_.bad(), now());
  judged_ = counts;
  if (!changed || !started_) return;
  if (quality_.trusted()) {
    notice(name_ + " sends valid data again: its readings are used again");
    return;
  }
  ++counts_.distrusted;
  clear_ready();
  notice(name_ + ": " + std::to_string(std::lround(100.0 * quality_.bad_share())) +
         " % of what it sends is damaged, impossible or out of order: the press is released until "
         "its data is clean; " +
         (stream_.rejected.empty()
              ? ""
              : "it sent " + answer_and_expected(stream_.rejected, expected()) + "; ") +
         "check " + to_check());
}

/// Whether the connected device is the one that was opened: calibration and scene belong to that
/// device, and after an unplug another may be at its port.
bool DeviceProbe::same_device() {
  const std::string serial_number = protocol_->serial_number();
  const bool other = serial_number != opened_serial_number_;
  if (other && !other_device_reported_) {
    notice("another device is connected at " + transport_->info().name + ", with serial number " +
           serial_number + " instead of " + opened_serial_number_ +
           ": the press is released; plug in the original device, or start a new run");
  }
  other_device_reported_ = other;
  return !other;
}

void DeviceProbe::deliver(const DeviceReading& reading, Time time) {
  sequence_ += reading.lost;
  const std::uint32_t sequence = sequence_++;
  if (last_time_.count() != 0) time = std::max(time, last_time_ + Time{1});
  std::uint64_t refused = 0;
  std::uint64_t absent = 0;
  bool measured = false;
  bool saturated = false;
  bool outside = false;
  // Of a live device, it follows from the measured timing.
  const Time step =
      last_time_.count() != 0 ? time - last_time_ : protocol_->period().value_or(kUnknownPeriod);
  const std::span<double> row =
      ready_->add({.time = time,
                   .arrival = reading.arrival,
                   .valid_for = settings_.live ? Time{0} : SampleMeter::stale_after(step),
                   .sequence = sequence});
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    const ProbeColumns& columns = ready_->columns().of(i);
    const DeviceOutput::Result result = outputs_[i].take(reading, columns, row);
    for (const std::string& sentence : result.notices) notice(sentence);
    for (TaxelZeros zeros : result.zeros) {
      zeros.time = time;
      zeros.probe = static_cast<std::uint32_t>(i);
      zeros_.push_back(zeros);
    }
    if (!result.measured) columns.put_nothing(row);
    if (!result.measured && !result.waiting) ++refused;
    if (result.absent) ++absent;
    measured = measured || result.measured;
    faults_[i].saturated += result.saturated ? 1 : 0;
    faults_[i].outside_calibration += result.outside ? 1 : 0;
    saturated = saturated || result.saturated;
    outside = outside || result.outside;
  }
  if (!measured) ready_->resize(ready_->size() - 1);
  stream_.counts.refused += refused;
  stream_.counts.without_value += absent;
  if (refused > 0) stream_.rejected = stream_.answer;
  if (refused == outputs_.size()) return;
  judged_.refused += refused;  // one sensor of several without a value is no damaged stream
  judged_.without_value += absent;
  last_time_ = time;
  if (saturated) ++counts_.saturated;
  if (outside) ++counts_.outside_calibration;
  if (first_reading_.count() == 0) first_reading_ = reading.arrival;
  ++counts_.readings;
  if (time >= held_up_until_) {
    counts_.age_ms += (units::ms_from(reading.arrival - time) - counts_.age_ms) /
                      static_cast<double>(std::min(counts_.readings, kAgeReadings));
  }
  if (reading.arrival > first_reading_) {
    counts_.rate_Hz =
        static_cast<double>(counts_.readings - 1) / units::s_from(reading.arrival - first_reading_);
  }
}

void DeviceProbe::notice(const std::string& sentence) { notices_.add(sentence, now()); }

void DeviceProbe::publish() {
  const ProtocolCounts& protocol = stream_.counts;
  counts_.port = transport_->info().note;
  counts_.lost = protocol.lost;
  counts_.damaged = protocol.damaged;
  counts_.refused = protocol.refused;
  counts_.bytes = protocol.bytes;
  counts_.duplicates = protocol.duplicates;
  counts_.reordered = protocol.reordered;
  counts_.reboots = protocol.reboots;
  times_.describe(counts_);
  if (counts_.unexpected.empty() && !stream_.rejected.empty()) {
    counts_.unexpected = answer_and_expected(stream_.rejected, expected());
  }
  const Time present_outage = away_ ? now() - lost_since_ : Time{0};
  const std::scoped_lock lock(mutex_);
  published_ = counts_;
  published_faults_ = faults_;
  for (std::size_t i = 0; i < outputs_.size(); ++i) published_faults_[i].lack = outputs_[i].lack();
  published_.outage_ns += static_cast<std::uint64_t>(present_outage.count());
}

ProbeStatus DeviceProbe::status() const {
  ProbeStatus status{.connected = connected_.load(std::memory_order_relaxed),
                     .calibration = &outputs_.front().calibration()};
  const std::scoped_lock lock(mutex_);
  status.device = published_;
  status.faults = published_faults_;
  return status;
}

std::vector<std::string> DeviceProbe::take_notices() { return notices_.take(); }

}  // namespace merkel
