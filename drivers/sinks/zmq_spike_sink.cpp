#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <optional>
#include <utility>

#include <zmq.hpp>

#include "drivers/clock/clock_pair.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/sinks/host_name.hpp"
#include "drivers/sinks/json_text.hpp"
#include "drivers/sinks/sink_openers.hpp"

namespace merkel {
namespace {

constexpr std::uint16_t kSpikeMessage = 1;
constexpr std::int64_t kSampleRate_hz = 1'000'000;
constexpr std::string_view kDefaultEndpoint = "tcp://127.0.0.1:5557";

/// A message a spike, as Open Ephys' Event Broadcaster sends it: a type, then JSON.
///
/// The socket is an XPUB, which differs from a PUB for its owner only: it tells who subscribes and
/// when a subscriber's queue is full.
class ZmqSpikeSink final : public SpikeSink {
 public:
  ZmqSpikeSink(std::string uri, const std::string& stream, const std::string& topic)
      : uri_(std::move(uri)),
        socket_(context_, zmq::socket_type::xpub),
        type_(reinterpret_cast<const char*>(&kSpikeMessage), sizeof kSpikeMessage),
        stream_(json_string(stream)) {
    type_ += topic;
  }

  Expected<void, SetupError> bind(const std::string& endpoint, int high_water_mark,
                                  bool wait_when_full) {
    wait_flag_ = wait_when_full ? zmq::send_flags::none : zmq::send_flags::dontwait;
    try {
      socket_.set(zmq::sockopt::sndtimeo, kStuck_ms);
      socket_.set(zmq::sockopt::sndhwm, high_water_mark);
      socket_.set(zmq::sockopt::linger, kLinger_ms);
      socket_.set(zmq::sockopt::xpub_nodrop, true);
      socket_.bind(endpoint);
    } catch (const zmq::error_t& error) {
      if (error.num() == EADDRINUSE) {
        return unavailable(
            "\"" + uri_ + "\": " + endpoint +
            " is in use, perhaps by Open Ephys or another merkel: name another port");
      }
      return unavailable("\"" + uri_ + "\": cannot listen at " + endpoint + ": " + error.what() +
                         "; write zmq:tcp://127.0.0.1:5557 or zmq:ipc://FILE");
    }
    return {};
  }

  /// Waits until `wanted` subscribers are there; false when they are not in time.
  bool wait_for_subscribers(std::int64_t wanted, std::chrono::milliseconds patience) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    socket_.set(zmq::sockopt::xpub_verboser, true);
    for (std::int64_t subscribed = 0; subscribed < wanted;) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          deadline - std::chrono::steady_clock::now());
      if (left.count() <= 0) return false;
      socket_.set(zmq::sockopt::rcvtimeo, static_cast<int>(left.count()));
      zmq::message_t message;
      if (!socket_.recv(message)) continue;
      if (message.size() > 0 && *message.data<char>() == 1) ++subscribed;
    }
    return true;
  }

  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }

  [[nodiscard]] Expected<void, SinkError> write(std::span<const SpikeEvent> spikes) override {
    try {
      // Subscriptions are taken in while their senders are served; nobody else reads them.
      zmq::message_t subscription;
      while (socket_.recv(subscription, zmq::recv_flags::dontwait)) {
      }
      const ClockPair now = read_clock_pair();
      for (const SpikeEvent& spike : spikes) send(spike, now);
    } catch (const zmq::error_t& error) {
      return Unexpected<SinkError>({.sentence = uri_ + " failed: " + error.what() + "; run again"});
    }
    return {};
  }

  [[nodiscard]] Expected<void, SinkError> close() override {
    socket_.close();
    // Waits until everything is sent, kLinger_ms at most.
    context_.close();
    return {};
  }

  [[nodiscard]] std::uint64_t delivered() const noexcept override { return delivered_; }

 private:
  static constexpr int kLinger_ms = 2000;
  static constexpr int kStuck_ms = 5000;  ///< who takes nothing for so long is waited for no more

  void send(const SpikeEvent& spike, const ClockPair& now) {
    write_json(spike, now);
    ++sequence_;
    if (send_parts()) {
      ++delivered_;
      return;
    }
    wait_flag_ = zmq::send_flags::dontwait;
    // Some subscriber's queue is full: it loses the message, the others get it.
    socket_.set(zmq::sockopt::xpub_nodrop, false);
    static_cast<void>(send_parts());
    socket_.set(zmq::sockopt::xpub_nodrop, true);
  }

  bool send_parts() {
    if (!socket_.send(zmq::buffer(type_), zmq::send_flags::sndmore | wait_flag_)) return false;
    return socket_.send(zmq::buffer(json_), wait_flag_).has_value();
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
    json_ += stream_;
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

  std::string uri_;
  zmq::context_t context_;
  zmq::socket_t socket_;
  std::string type_;
  std::string stream_;
  std::string json_;
  zmq::send_flags wait_flag_ = zmq::send_flags::dontwait;
  std::uint64_t sequence_ = 0;
  std::uint64_t delivered_ = 0;
};

}  // namespace

OpenedSink open_zmq_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const std::string topic = options.text("topic", "");
  const std::string stream =
      options.text("stream", setup.run.scene.empty() ? "merkel" : setup.run.scene);
  const auto high_water_mark = static_cast<int>(options.whole("hwm", 100'000, 0, 100'000'000));
  const std::int64_t subscribers = options.whole("subscribers", 0, 0, 1000);
  const std::chrono::milliseconds patience{
      static_cast<std::int64_t>(1e3 * options.number("wait_s", 10.0, 0.0, 3600.0))};
  const bool wait_when_full = options.word("when_full", "drop", "drop|wait") == "wait";
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());

  std::string endpoint = uri.path.empty() ? std::string(kDefaultEndpoint) : uri.path;
  constexpr std::string_view kTcp = "tcp://";
  if (endpoint.starts_with(kTcp)) {
    const auto address = HostAndPort::parse(std::string_view(endpoint).substr(kTcp.size()));
    if (!address) {
      return bad_input("\"" + uri.text +
                       "\": the address must be tcp://HOST:PORT, for example zmq:" +
                       std::string(kDefaultEndpoint));
    }
    if (!setup.allow_remote && !address->loopback()) {
      return remote_refused(uri.text, address->host);
    }
    // A name in a bind means an interface.
    if (address->host == "localhost") {
      endpoint = "tcp://127.0.0.1:" + std::to_string(address->port);
    }
  } else if (!endpoint.starts_with("ipc://")) {
    return bad_input("\"" + uri.text + "\": the address must be tcp://HOST:PORT or ipc://FILE, " +
                     "for example zmq:" + std::string(kDefaultEndpoint));
  }
  auto sink = std::make_unique<ZmqSpikeSink>(uri.text, stream, topic);
  if (auto bound = sink->bind(endpoint, high_water_mark, wait_when_full); !bound) {
    return Unexpected<SetupError>(bound.error());
  }
  if (!sink->wait_for_subscribers(subscribers, patience)) {
    return bad_input("\"" + uri.text + "\": not " + std::to_string(subscribers) +
                     " subscribers came in time: start them, or leave out the option subscribers");
  }
  return sink;
}

}  // namespace merkel
