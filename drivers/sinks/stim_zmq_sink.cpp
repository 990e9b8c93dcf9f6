#include "drivers/clock/clock_pair.hpp"
#include "drivers/sinks/stimulation_text.hpp"
#include "drivers/sinks/zmq_publisher.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

// Open Ephys' Event Broadcaster uses neither type.
constexpr std::uint16_t kCommandMessage = 100;
constexpr std::uint16_t kStimulationStart = 0x4D02;  ///< "\x02M"

/// One message per stimulation command, in the format of the spike sink: a type, then JSON.
class StimZmqSink final : public ZmqPublisher {
 public:
  static constexpr std::string_view kEndpoint = "tcp://127.0.0.1:5558";

  StimZmqSink(const Uri& uri, const Options& options, const SinkSetup& setup)
      : ZmqPublisher(uri, options, kStimulationStart),
        text_(setup.run.encoding),
        encoding_(encoding_members(setup.run.encoding)),
        head_(head(kCommandMessage)) {}

  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kKinds<SentCommand>;
  }
  [[nodiscard]] std::vector<pid_t> transport_threads() const override { return threads(); }

  /// The electrodes and their limits, for subscribers of the start message.
  [[nodiscard]] Expected<void, SinkError> begin(const RunOrigin& origin) override {
    return announce(R"({"event_type":"stimulation_start","stream":)" + stream() +
                    R"(,"start_device_ns":)" + std::to_string(origin.start.count()) +
                    R"(,"start_utc_ns":)" + std::to_string(origin.utc.count()) + "," + encoding_ +
                    "}");
  }
  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    bool complete = true;
    auto published = publish([&](const auto& send) {
      const ClockPair now = read_clock_pair();
      for (const SentCommand& sent : batch.sent) {
        json_ = R"({"event_type":"stimulation","stream":)" + stream() + ",";
        text_.append_members(json_, sent);
        json_ += R"(,"seq":)" + std::to_string(sequence_++);
        const auto age = sent.sent.count() == 0 ? nanoseconds{0} : now.monotonic - sent.sent;
        json_ += R"(,"sent_utc_ns":)" + std::to_string((now.utc - age).count()) + "}";
        complete = send(head_, json_) && complete;
      }
    });
    if (!published || complete) return published;
    return Unexpected<SinkError>(
        {.sentence = uri() + " failed: the queue of a subscriber is full, so stimulation was "
                             "stopped; make the subscriber read faster, and run again"});
  }

 private:
  StimulationText text_;
  std::string encoding_;  ///< members of JSON
  std::string head_;
  std::string json_;
  std::uint64_t sequence_ = 0;
};

}  // namespace

OpenedSink open_stim_zmq_sink(const Uri& uri, const SinkSetup& setup) {
  if (auto some = require_electrodes(uri, setup.run.encoding); !some) {
    return Unexpected<SetupError>(some.error());
  }
  return ZmqPublisher::open<StimZmqSink>(uri, setup);
}

}  // namespace merkel
