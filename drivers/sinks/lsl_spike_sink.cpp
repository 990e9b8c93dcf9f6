#include <array>
#include <chrono>
#include <memory>
#include <thread>
#include <utility>

#include <lsl_cpp.h>

#include "core/units.hpp"
#include "drivers/clock/clock_pair.hpp"
#include "drivers/sinks/sink_openers.hpp"

namespace merkel {
namespace {

/// The buffer of an inlet. liblsl assumes 100 samples per second for an irregular rate.
constexpr int kOutletBuffer_s = 10'000;
constexpr std::chrono::milliseconds kFarewell{500};
constexpr double kLongestWait_s = 3600.0;

/// One int32 channel of neuron numbers at an irregular rate, stamped in LSL's time: CLOCK_MONOTONIC
/// in seconds. The probe time of a device is on this clock already.
class LslSpikeSink final : public SpikeSink {
 public:
  LslSpikeSink(std::string uri, const lsl::stream_info& info)
      : uri_(std::move(uri)), outlet_(info, 0, kOutletBuffer_s) {}

  /// Waits for an inlet. False on a timeout.
  bool wait_for_consumers(double wait_s) { return outlet_.wait_for_consumers(wait_s); }

  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }

  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    for (const SpikeEvent& spike : batch.spikes) {
      const std::array<std::int32_t, 1> neuron{static_cast<std::int32_t>(spike.neuron)};
      // Samples without pushthrough are sent with the next one that has it.
      const bool last = &spike == &batch.spikes.back();
      outlet_.push_sample(neuron.data(), units::s_from(spike.time), last);
    }
    delivered_ += batch.spikes.size();
    return {};
  }

  /// The outlet sends from its own thread and does not report its progress. Its destructor discards
  /// unsent samples.
  [[nodiscard]] Expected<void, SinkError> close() override {
    if (outlet_.have_consumers()) std::this_thread::sleep_for(kFarewell);
    return {};
  }
  [[nodiscard]] std::uint64_t delivered() const noexcept override { return delivered_; }

 private:
  std::string uri_;
  lsl::stream_outlet outlet_;
  std::uint64_t delivered_ = 0;
};

}  // namespace

OpenedSink open_lsl_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const double wait_s = options.number("wait_s", 0.0, 0.0, kLongestWait_s);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (uri.path.empty()) return bad_input("\"" + uri.text + "\": give the stream a name: lsl:NAME");
  if (!setup.allow_remote) {
    return bad_input("\"" + uri.text +
                     "\": the Lab Streaming Layer announces its streams to the whole network: add "
                     "--allow-remote if others may see the spikes");
  }
  try {
    lsl::stream_info info(uri.path, "Spikes", 1, lsl::IRREGULAR_RATE, lsl::cf_int32,
                          "merkel-" + uri.path);
    lsl::xml_element channel = info.desc().append_child("channels").append_child("channel");
    channel.append_child_value("label", "neuron")
        .append_child_value("type", "Spikes")
        .append_child_value("unit", "number from 1");
    info.desc().append_child_value("scene", setup.run.scene);
    auto sink = std::make_unique<LslSpikeSink>(uri.text, info);
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
