#include "drivers/simulation/device_simulator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <thread>
#include <utility>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/sample_channels.hpp"
#include "drivers/simulation/network_line.hpp"
#include "drivers/simulation/pty_master.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr milliseconds kMaxWait{5};
constexpr nanoseconds kUptime{std::chrono::seconds{3}};  ///< of a device that was already on

nanoseconds host_now() {
  return std::chrono::duration_cast<nanoseconds>(
      std::chrono::steady_clock::now().time_since_epoch());
}

/// Samples per second; 0 if unknown.
double rate_of(std::span<const ProbeSample> trace) {
  const double length_s = units::s_from(trace.back().time - trace.front().time);
  return length_s > 0.0 ? static_cast<double>(trace.size() - 1) / length_s : 0.0;
}

}  // namespace

DeviceSimulator::DeviceSimulator(Settings settings)
    : settings_(std::move(settings)), random_(settings_.faults.seed) {}

Expected<std::unique_ptr<DeviceSimulator>, SetupError> DeviceSimulator::create(Settings settings) {
  std::uint32_t channels = settings.trace.empty() ? 0 : settings.trace.front().channels;
  settings.others.resize((settings.extra_columns.size() + settings.taxels.size()) *
                         settings.trace.size());
  const std::string name(settings.protocol->name);
  const std::uint32_t plays = settings.protocol->plays;
  std::unique_ptr<DeviceSimulator> simulator(new DeviceSimulator(std::move(settings)));
  simulator->device_ = simulator->settings_.protocol->simulate(channels);
  const auto& further = simulator->settings_.extra_columns;
  const bool sends_further = simulator->device_->set_columns(further) && !further.empty();
  double largest_kPa = 0.0;
  for (std::size_t i = 0; i < simulator->settings_.trace.size(); ++i) {
    for (const double kPa : simulator->others_of(i).subspan(further.size())) {
      largest_kPa = std::max(largest_kPa, kPa);
    }
  }
  const bool sends_taxels =
      simulator->device_->set_taxels(simulator->settings_.taxels, largest_kPa);
  if (!sends_taxels) {
    return bad_input("devices of the protocol " + name + " cannot send the " +
                     std::to_string(simulator->settings_.taxels.size()) +
                     " taxels of the trace: use csv");
  }
  if ((channels & plays) == 0U && !sends_further && simulator->settings_.taxels.empty()) {
    return bad_input(
        "the trace has no " + std::string((plays & ProbeSample::kForce) != 0U ? "force" : "depth") +
        ", which devices of the protocol " + name + " measure" +
        (further.empty() ? "" : "; only those of csv and hbf1 send columns of other names"));
  }
  if (simulator->settings_.pulses &&
      !simulator->device_->set_pulses(*simulator->settings_.pulses)) {
    return bad_input("the protocol " + name +
                     " has no events of a sync line: remove --pulses, or use hbf1");
  }
  simulator->device_->set_rate(
      simulator->settings_.rate_Hz.value_or(rate_of(simulator->settings_.trace)));
  const Settings& own = simulator->settings_;
  if (own.trace.size() > 1) {
    simulator->mean_period_ = (own.trace.back().time - own.trace.front().time) /
                              static_cast<std::int64_t>(own.trace.size() - 1);
  }
  if (own.network.empty()) {
    simulator->line_ = std::make_unique<PtyMaster>(own.link);
  } else {
    auto line = make_network_line(own.network, *own.protocol);
    if (!line) return Unexpected<SetupError>(line.error());
    simulator->line_ = std::move(*line);
  }
  if (auto plugged = simulator->line_->plug_in(); !plugged) {
    return Unexpected<SetupError>(plugged.error());
  }
  return simulator;
}

std::string DeviceSimulator::uri() const {
  const ProtocolEntry& protocol = *settings_.protocol;
  const std::string options = device_->uri_options();
  return line_->address() + "?protocol=" + std::string(protocol.name) +
         (settings_.baud == protocol.baud || !settings_.network.empty()
              ? ""
              : "&baud=" + std::to_string(settings_.baud)) +
         (options.empty() ? "" : "&" + options) +
         (settings_.rate_Hz ? "&rate_hz=" + shortest_decimal(*settings_.rate_Hz) : "");
}

nanoseconds DeviceSimulator::device_time(Time now) const noexcept {
  const auto up = static_cast<double>((now - booted_).count());
  return Time{std::llround(up * (1.0 + settings_.faults.drift_ppm * 1e-6))};
}

void DeviceSimulator::boot(Time now) {
  booted_ = now;
  Bytes out;
  device_->boot(device_time(now), out);
  send(out, false);
}

void DeviceSimulator::run(const std::atomic<bool>& stop) {
  boot(host_now() - kUptime);
  while (!stop.load(std::memory_order_relaxed)) {
    const Time now = host_now();
    step(now);
    listen(std::clamp(next_event(now) - host_now(), Time{0}, Time{kMaxWait}));
  }
}

void DeviceSimulator::step(Time now) {
  if (started_) pass_faults(now);
  if (!started_ && device_->started() && line_->heard()) {
    started_ = now;
    trace_start_ = device_time(now);
  }
  if (started_) play(now);
  flush(now);
}

void DeviceSimulator::pass_faults(Time now) {
  SimulatedFaults& faults = settings_.faults;
  const Time played = now - *started_;
  if (faults.unplug_at && played >= *faults.unplug_at) {
    faults.unplug_at.reset();
    ++counts_.unplugs;
    line_->unplug();
    plugged_ = false;
    held_.clear();
    unplugged_until_ = now + faults.unplug_for;
  }
  if (!plugged_ && now >= unplugged_until_) {
    plugged_ = line_->plug_in().has_value();
  }
  if (faults.stall_at && played >= *faults.stall_at) {
    faults.stall_at.reset();
    stalled_until_ = now + faults.stall_for;
  }
  stalled_ = now < stalled_until_;
  if (faults.reboot_at && played >= *faults.reboot_at) {
    faults.reboot_at.reset();
    ++counts_.reboots;
    boot(now);
    // The press continues in the meantime; only the device's clock restarts.
    const Time gone = now - *started_;
    trace_start_ = device_time(now) - gone;
  }
}

std::optional<nanoseconds> DeviceSimulator::period() const noexcept {
  if (const auto of_device = device_->period()) return of_device;
  if (settings_.rate_Hz) return units::nanoseconds_from_s(1.0 / *settings_.rate_Hz);
  return std::nullopt;
}

/// Due time of the next sample since the start of the trace. After its end, a device repeats its
/// last measurement.
nanoseconds DeviceSimulator::next_sample() const noexcept {
  const auto& trace = settings_.trace;
  if (period() || next_ == trace.size()) return next_time_;
  return round_ + (trace[next_].time - trace.front().time);
}

std::span<const double> DeviceSimulator::others_of(std::size_t sample) const noexcept {
  const std::size_t width = settings_.extra_columns.size() + settings_.taxels.size();
  return std::span(settings_.others).subspan(sample * width, width);
}

/// The trace, interpolated; sets others_.
ProbeSample DeviceSimulator::interpolate(Time trace_time) {
  const auto& trace = settings_.trace;
  const Time length = trace.back().time - trace.front().time;
  if (settings_.repeat && length.count() > 0) trace_time %= length;
  const Time time = trace.front().time + trace_time;
  const auto found =
      std::lower_bound(trace.begin(), trace.end(), time,
                       [](const ProbeSample& sample, Time t) { return sample.time < t; });
  const auto next = std::min(static_cast<std::size_t>(found - trace.begin()), trace.size() - 1);
  const std::span<const double> to = others_of(next);
  others_.assign(to.begin(), to.end());
  const ProbeSample& after = trace[next];
  if (next == 0 || after.time <= time) return after;
  const ProbeSample& before = trace[next - 1];
  const double fraction = static_cast<double>((time - before.time).count()) /
                          static_cast<double>((after.time - before.time).count());
  const auto between = [fraction](double a, double b) { return a + fraction * (b - a); };
  ProbeSample sample = before;
  for (const SampleChannel& channel : kProbeChannels) {
    sample.*channel.member = between(before.*channel.member, after.*channel.member);
  }
  const std::span<const double> from = others_of(next - 1);
  for (std::size_t i = 0; i < others_.size(); ++i) others_[i] = between(from[i], to[i]);
  sample.time = time;
  return sample;
}

void DeviceSimulator::play(Time now) {
  const auto& trace = settings_.trace;
  while (true) {
    if (!period() && next_ == trace.size() && settings_.repeat && trace.size() > 1) {
      const Time span = trace.back().time - trace.front().time;
      round_ += span + span / static_cast<std::int64_t>(trace.size() - 1);
      next_ = 0;
    }
    const Time next = next_sample();
    if (trace_start_ + next > device_time(now)) return;
    const bool over = !period() && next_ == trace.size();
    Bytes out;
    const std::size_t place = over ? next_ - 1 : next_;
    if (period()) {
      const ProbeSample sample = interpolate(next);
      device_->measure(sample, others_, trace_start_ + next, out);
    } else {
      device_->measure(trace[place], others_of(place), trace_start_ + next, out);
    }
    ++counts_.measured;
    if (!plugged_ || !device_->started()) ++counts_.unsent;
    send(out, true);
    if (!period() && !over) ++next_;
    next_time_ = next + period().value_or(mean_period_);
  }
}

void DeviceSimulator::listen(Time patience) {
  std::array<std::uint8_t, 1024> bytes{};
  if (!plugged_) {
    std::this_thread::sleep_for(patience);
    return;
  }
  const std::size_t count = line_->read(bytes, patience);
  if (count == 0 || line_->baud(settings_.baud) != settings_.baud) return;
  const auto heard = std::span<const std::uint8_t>(bytes).first(count);
  if (settings_.faults.echo) send(Bytes(heard.begin(), heard.end()), false);
  Bytes out;
  device_->take(heard, device_time(host_now()), out);
  send(out, false);
  flush(host_now());
}

void DeviceSimulator::send(const Bytes& bytes, bool whole_frame) {
  const SimulatedFaults& faults = settings_.faults;
  if (!plugged_ || bytes.empty()) return;
  if (whole_frame && faults.drop_frame > 0.0 && random_.uniform() < faults.drop_frame) {
    ++counts_.frames_dropped;
    return;
  }
  const int baud = line_->baud(settings_.baud);
  const bool garbage = baud != 0 && baud != settings_.baud;
  for (std::uint8_t byte : bytes) {
    if (whole_frame && faults.drop_byte > 0.0 && random_.uniform() < faults.drop_byte) {
      ++counts_.bytes_dropped;
      continue;
    }
    if (whole_frame && faults.flip_byte > 0.0 && random_.uniform() < faults.flip_byte) {
      ++counts_.bytes_flipped;
      byte = static_cast<std::uint8_t>(byte ^ (1U << (random_.next() % 8U)));
    }
    if (garbage) byte = static_cast<std::uint8_t>(random_.next());
    held_.push_back(byte);
  }
}

/// Sends held-back bytes: all of them, or the pieces that are due.
void DeviceSimulator::flush(Time now) {
  const SimulatedFaults& faults = settings_.faults;
  if (held_.empty() || stalled_ || !plugged_) return;
  if (faults.batch.count() > 0) {
    if (now < next_batch_) return;
    next_batch_ = now + faults.batch;
  }
  std::size_t count = held_.size();
  if (faults.split && count > 1) {
    // One piece now, the rest at the next call: frames are split anywhere and merged.
    count = 1 + static_cast<std::size_t>(random_.next() % (count - 1));
  }
  const auto piece = std::span<const std::uint8_t>(held_).first(count);
  const std::size_t written = line_->write(piece);
  counts_.bytes_sent += written;
  counts_.bytes_overrun += count - written;
  held_.erase(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(count));
}

nanoseconds DeviceSimulator::next_event(Time now) const noexcept {
  if (settings_.faults.split && !held_.empty()) return now + Time{200'000};
  if (!started_) return now + kMaxWait;
  return now + (trace_start_ + next_sample() - device_time(now));
}

}  // namespace merkel
