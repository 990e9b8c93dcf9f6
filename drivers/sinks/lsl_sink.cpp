#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include <lsl_cpp.h>

#include "core/units.hpp"
#include "drivers/clock/clock_pair.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/sample_channels.hpp"
#include "drivers/sessions/afferent_table.hpp"
#include "drivers/sessions/rig_recording.hpp"
#include "drivers/sinks/sink_openers.hpp"

namespace merkel {
namespace {

/// The buffer of an inlet. liblsl assumes 100 samples per second for an irregular rate.
constexpr int kOutletBuffer_s = 10'000;
constexpr std::chrono::milliseconds kLslFarewell{500};
constexpr double kMaxWait_s = 3600.0;

/// The streams of a rig in LSL's time, CLOCK_MONOTONIC in seconds; the probe time of a device is on
/// this clock already. NAME: one int32 channel of neuron numbers at an irregular rate.
/// NAME.samples, NAME.samples.1, …: what each probe measures. NAME.marks, the last of which is
/// kRigEnd. RigRecording reads them from a recording of LabRecorder.
class LslSink final : public Sink {
 public:
  LslSink(std::string uri, const std::string& name, const SinkSetup& setup)
      : Sink(std::move(uri)),
        spikes_(spikes_info(name, setup), 0, kOutletBuffer_s),
        marks_(info_of(name + ".marks", "Markers", 1, lsl::cf_string), 0, kOutletBuffer_s) {
    for (std::size_t probe = 0; probe < setup.run.probes.size(); ++probe) {
      const std::uint32_t channels = setup.run.probes[probe].channels;
      SampleStream& stream = samples_.emplace_back();
      for (const SampleChannel& channel : kProbeChannels) {
        if (channel.in(channels)) stream.channels.push_back(&channel);
      }
      if (stream.channels.empty()) continue;
      const std::string part = probe == 0 ? ".samples" : ".samples." + std::to_string(probe);
      lsl::stream_info info = info_of(name + part, "ProbeSamples",
                                      static_cast<int>(stream.channels.size()), lsl::cf_double64);
      lsl::xml_element described = info.desc().append_child("channels");
      for (const SampleChannel* channel : stream.channels) {
        described.append_child("channel")
            .append_child_value("label", std::string(channel->name))
            .append_child_value("unit", std::string(channel->unit));
      }
      stream.outlet = std::make_unique<lsl::stream_outlet>(info, 0, kOutletBuffer_s);
    }
  }

  /// Waits for an inlet of the spikes. False on a timeout.
  bool wait_for_consumers(double wait_s) { return spikes_.wait_for_consumers(wait_s); }

  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kKinds<SpikeEvent, DeliveredSample, Mark>;
  }

  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    for (const DeliveredSample& item : batch.samples) send(item);
    for (const SpikeEvent& spike : batch.spikes) {
      const std::array<std::int32_t, 1> neuron{static_cast<std::int32_t>(spike.neuron)};
      // Samples without pushthrough are sent with the next one that has it.
      const bool last = &spike == &batch.spikes.back();
      spikes_.push_sample(neuron.data(), stamp(spike.time), last);
    }
    for (const Mark& mark : batch.marks) marks_.push_sample(&mark.label, stamp(mark.time), true);
    delivered_ += batch.spikes.size();
    return {};
  }

  /// The outlets send from their own threads and do not report their progress. Their destructors
  /// discard unsent samples.
  [[nodiscard]] Expected<void, SinkError> close() override {
    const std::string end(kRigEnd);
    marks_.push_sample(&end, std::max(latest_s_, lsl::local_clock()), true);
    if (spikes_.have_consumers() || marks_.have_consumers()) {
      std::this_thread::sleep_for(kLslFarewell);
    }
    return {};
  }

 private:
  struct SampleStream {
    std::vector<const SampleChannel*> channels = {};
    std::unique_ptr<lsl::stream_outlet> outlet = nullptr;
  };

  static lsl::stream_info info_of(const std::string& name, const std::string& type, int channels,
                                  lsl::channel_format_t format) {
    return {name, type, channels, lsl::IRREGULAR_RATE, format, std::string(kRigSource) + name};
  }

  /// Describes the run as the header of a session does.
  static lsl::stream_info spikes_info(const std::string& name, const SinkSetup& setup) {
    lsl::stream_info info = info_of(name, "Spikes", 1, lsl::cf_int32);
    lsl::xml_element channel = info.desc().append_child("channels").append_child("channel");
    channel.append_child_value("label", "neuron")
        .append_child_value("type", "Spikes")
        .append_child_value("unit", "number from 1");
    info.desc().append_child_value("scene", utf8_text(setup.run.scene));
    lsl::xml_element facts = info.desc().append_child("merkel");
    for (const auto& [fact, value] : setup.run.facts) {
      facts.append_child_value(fact, utf8_text(value));
    }
    facts.append_child_value("scene", utf8_text(setup.run.scene));
    const ClockPair clocks = read_clock_pair();
    facts.append_child_value("clock_monotonic_ns", std::to_string(clocks.monotonic.count()));
    facts.append_child_value("clock_utc_ns", std::to_string(clocks.utc.count()));
    lsl::xml_element afferents = info.desc().append_child("afferents");
    for (const AfferentRow& row : afferents_of(setup)) {
      lsl::xml_element afferent = afferents.append_child("afferent");
      for_each_member(row, [&](const char* member, const std::string& value) {
        afferent.append_child_value(member, value);
      });
    }
    return info;
  }

  void send(const DeliveredSample& item) {
    if (item.probe >= samples_.size() || !samples_[item.probe].outlet) return;
    const SampleStream& stream = samples_[item.probe];
    const ProbeSample& sample = item.sample;
    values_.clear();
    for (const SampleChannel* channel : stream.channels) values_.push_back(channel->of(sample));
    stream.outlet->push_sample(values_.data(), stamp(sample.time), true);
  }

  double stamp(std::chrono::nanoseconds time) {
    const double stamp_s = units::s_from(time);
    latest_s_ = std::max(latest_s_, stamp_s);
    return stamp_s;
  }

  lsl::stream_outlet spikes_;
  lsl::stream_outlet marks_;
  std::vector<SampleStream> samples_;
  std::vector<double> values_;
  double latest_s_ = 0.0;  ///< of all stamps
};

}  // namespace

OpenedSink open_lsl_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const double wait_s = options.number("wait_s", 0.0, 0.0, kMaxWait_s);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (uri.path.empty()) return bad_input("\"" + uri.text + "\": give the stream a name: lsl:NAME");
  if (!setup.allow_remote) {
    return bad_input("\"" + uri.text +
                     "\": the Lab Streaming Layer announces its streams to the whole network: add "
                     "--allow-remote if others may see the spikes");
  }
  try {
    auto sink = std::make_unique<LslSink>(uri.text, uri.path, setup);
    if (wait_s > 0.0 && !sink->wait_for_consumers(wait_s)) {
      return unavailable("\"" + uri.text +
                         "\": no inlet connected in time; start it, then run again");
    }
    return sink;
  } catch (const std::exception& error) {
    return unavailable("\"" + uri.text + "\": liblsl failed: " + error.what());
  }
}

}  // namespace merkel
