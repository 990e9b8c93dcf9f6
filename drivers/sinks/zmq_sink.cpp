#include <array>
#include <charconv>
#include <chrono>
#include <vector>

#include "drivers/clock/clock_pair.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/sessions/afferent_table.hpp"
#include "drivers/sinks/zmq_publisher.hpp"

namespace merkel {
namespace {

constexpr std::uint16_t kSpikeMessage = 1;
constexpr std::uint16_t kSpikeStart = 0x4D01;  ///< "\x01M": not a type of Open Ephys
constexpr std::int64_t kSampleRate_hz = 1'000'000;

/// One message per spike in the format of Open Ephys' Event Broadcaster: a type, then JSON.
class ZmqSink final : public ZmqPublisher {
 public:
  static constexpr std::string_view kEndpoint = "tcp://127.0.0.1:5557";

  ZmqSink(const Uri& uri, const Options& options, const SinkSetup& setup)
      : ZmqPublisher(uri, options, kSpikeStart),
        afferents_(afferents_of(setup)),
        head_(head(kSpikeMessage)) {}

  [[nodiscard]] Expected<void, SinkError> begin(const RunOrigin& origin) override {
    return announce(start_message(origin));
  }

  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    return publish([&](const auto& send) {
      const ClockPair now = read_clock_pair();
      for (const SpikeEvent& spike : batch.spikes) {
        write_json(spike, now);
        ++sequence_;
        if (send(head_, json_)) ++delivered_;
      }
    });
  }

 private:
  /// The start of the run and the positions of the afferents. Sent with its own type whenever a
  /// subscriber subscribes to this type.
  std::string start_message(const RunOrigin& origin) const {
    std::string json = R"({"event_type":"merkel_start","stream":)" + stream() +
                       R"(,"start_device_ns":)" + std::to_string(origin.start.count()) +
                       R"(,"start_utc_ns":)" + std::to_string(origin.utc.count()) +
                       R"(,"afferents":[)";
    for (const AfferentRow& row : afferents_) {
      json += (row.number == 1 ? "[" : ",[") + std::to_string(row.number) + "," +
              std::to_string(row.patch) + "," + shortest_decimal(row.x_mm) + "," +
              shortest_decimal(row.y_mm) + "," + shortest_decimal(row.field_radius_mm) + "]";
    }
    return json + R"(],"afferent_fields":["neuron","patch","x_mm","y_mm","field_radius_mm"]})";
  }

  void append(std::string_view name, std::int64_t number) {
    std::array<char, 24> digits{};
    json_.append(name);
    json_.append(digits.data(),
                 std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr);
  }

  void write_json(const SpikeEvent& spike, const ClockPair& now) {
    using std::chrono::microseconds;
    const std::int64_t neuron = spike.neuron;
    json_ = R"({"event_type":"spike","stream":)";
    json_ += stream();
    append(R"(,"source_node":1,"electrode":"afferent )", neuron);
    append(R"(","num_channels":1,"sample_rate":)", kSampleRate_hz);
    append(R"(,"sample_number":)", std::chrono::floor<microseconds>(spike.time).count());
    append(R"(,"sorted_id":)", neuron);
    json_ += R"(,"amp1":0.0,"timestamp":)";
    append_seconds(json_, spike.time);
    append(R"(,"seq":)", static_cast<std::int64_t>(sequence_));
    append(R"(,"time_ns":)", spike.time.count());
    append(R"(,"patch":)", spike.patch);
    append(R"(,"neuron":)", spike.neuron);
    append(R"(,"flags":)", spike.flags);
    append(R"(,"sent_monotonic_ns":)", now.monotonic.count());
    append(R"(,"sent_utc_ns":)", now.utc.count());
    json_ += '}';
  }

  std::vector<AfferentRow> afferents_;
  std::string head_;
  std::string json_;
  std::uint64_t sequence_ = 0;
};

}  // namespace

OpenedSink open_zmq_sink(const Uri& uri, const SinkSetup& setup) {
  return ZmqPublisher::open<ZmqSink>(uri, setup);
}

}  // namespace merkel
