#include <utility>

#include "drivers/clock/clock_pair.hpp"
#include "drivers/sinks/json_line.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "drivers/sinks/stimulation_text.hpp"
#include "drivers/sinks/zmq_publisher.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

// Open Ephys' Event Broadcaster uses neither type.
constexpr std::uint16_t kCommandMessage = 100;
constexpr std::uint16_t kStimulationStart = 0x4D02;  ///< "\x02M"
constexpr std::string_view kStimulationEndpoint = "tcp://127.0.0.1:5558";

/// One message per stimulation command, in the format of the spike sink: a type, then JSON.
class StimZmqSink final : public Sink {
 public:
  StimZmqSink(const Uri& uri, const ZmqPublisher::Options& options, const std::string& stream,
              const EncodingParameters& encoding)
      : publisher_(uri, options, kStimulationStart),
        text_(encoding),
        encoding_(encoding_members(encoding)),
        head_(publisher_.head(kCommandMessage)),
        stream_(json_string(stream)) {}

  [[nodiscard]] ZmqPublisher& publisher() { return publisher_; }
  [[nodiscard]] const std::string& uri() const noexcept override { return publisher_.uri(); }
  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kKinds<SentCommand>;
  }
  [[nodiscard]] std::vector<pid_t> transport_threads() const override {
    return publisher_.threads();
  }

  /// The electrodes and their limits, for subscribers of the start message.
  [[nodiscard]] Expected<void, SinkError> begin(const RunOrigin& origin) override {
    return publisher_.announce(R"({"event_type":"stimulation_start","stream":)" + stream_ +
                               R"(,"start_device_ns":)" + std::to_string(origin.start.count()) +
                               R"(,"start_utc_ns":)" + std::to_string(origin.utc.count()) + "," +
                               encoding_ + "}");
  }
  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    bool complete = true;
    auto published = publisher_.publish([&](const auto& send) {
      const ClockPair now = read_clock_pair();
      for (const SentCommand& sent : batch.sent) {
        json_ = R"({"event_type":"stimulation","stream":)" + stream_ + ",";
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
  [[nodiscard]] Expected<void, SinkError> flush() override { return publisher_.flush(); }
  [[nodiscard]] Expected<void, SinkError> close() override {
    publisher_.close();
    return {};
  }
  void give_up() noexcept override { publisher_.give_up(); }

 private:
  ZmqPublisher publisher_;
  StimulationText text_;
  std::string encoding_;  ///< members of JSON
  std::string head_;
  std::string stream_;
  std::string json_;
  std::uint64_t sequence_ = 0;
};

}  // namespace

OpenedSink open_stim_zmq_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const auto publisher = ZmqPublisher::Options::read(options);
  const std::string stream =
      options.text("stream", setup.run.scene.empty() ? "merkel" : setup.run.scene);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (auto some = require_electrodes(uri, setup.run.encoding); !some) {
    return Unexpected<SetupError>(some.error());
  }
  auto sink = std::make_unique<StimZmqSink>(uri, publisher, stream, setup.run.encoding);
  if (auto opened = sink->publisher().open(setup, kStimulationEndpoint); !opened) {
    return Unexpected<SetupError>(opened.error());
  }
  return sink;
}

}  // namespace merkel
