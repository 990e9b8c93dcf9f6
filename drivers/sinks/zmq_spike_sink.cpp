#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>
#include <zmq.hpp>

#include "core/parameters/parameter_error.hpp"
#include "drivers/clock/clock_pair.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/sinks/afferent_table.hpp"
#include "drivers/sinks/host_name.hpp"
#include "drivers/sinks/json_text.hpp"
#include "drivers/sinks/sink_openers.hpp"

namespace merkel {
namespace {

constexpr std::uint16_t kSpikeMessage = 1;
constexpr std::uint16_t kStartMessage = 0x4D01;  ///< "\x01M": no type of Open Ephys
constexpr std::int64_t kSampleRate_hz = 1'000'000;
constexpr std::string_view kIpc = "ipc://";
constexpr std::string_view kDefaultEndpoint = "tcp://127.0.0.1:5557";

/// A message a spike, as Open Ephys' Event Broadcaster sends it: a type, then JSON.
///
/// The socket is an XPUB, which differs from a PUB for its owner only: it tells who subscribes and
/// when a subscriber's queue is full.
class ZmqSpikeSink final : public SpikeSink {
 public:
  struct Parameters {
    std::string endpoint;
    std::string stream;
    std::string topic;
    int high_water_mark = 0;
    bool wait_when_full = false;
  };

  ZmqSpikeSink(std::string uri, Parameters parameters, std::vector<AfferentRow> afferents)
      : uri_(std::move(uri)),
        parameters_(std::move(parameters)),
        afferents_(std::move(afferents)),
        socket_(context_, zmq::socket_type::xpub),
        monitor_(context_, zmq::socket_type::pair),
        type_(type_of(kSpikeMessage) + parameters_.topic),
        start_type_(type_of(kStartMessage) + parameters_.topic),
        stream_(json_string(parameters_.stream)),
        wait_flag_(parameters_.wait_when_full ? zmq::send_flags::none : zmq::send_flags::dontwait) {
  }

  Expected<void, SetupError> bind() {
    const std::string& endpoint = parameters_.endpoint;
    try {
      open_socket();
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
    for (std::int64_t subscribed = 0; subscribed < wanted;) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          deadline - std::chrono::steady_clock::now());
      if (left.count() <= 0) return false;
      socket_.set(zmq::sockopt::rcvtimeo, static_cast<int>(left.count()));
      zmq::message_t message;
      if (!socket_.recv(message)) continue;
      if (message.size() > 0 && *message.data<char>() == 1) ++subscribed;
      start_wanted_early_ = start_wanted_early_ || wants_start(message);
      ++subscriptions_;
    }
    return true;
  }

  [[nodiscard]] Expected<void, SinkError> begin(const RunOrigin& origin) override {
    start_json_ = start_message(origin);
    return guarded([this] {
      if (start_wanted_early_) send_start();
      look_after_peers();
    });
  }

  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }

  [[nodiscard]] Expected<void, SinkError> write(std::span<const SpikeEvent> spikes) override {
    return guarded([&] {
      look_after_peers();
      const ClockPair now = read_clock_pair();
      for (const SpikeEvent& spike : spikes) send(spike, now);
    });
  }

  [[nodiscard]] Expected<void, SinkError> flush() override {
    return guarded([this] { look_after_peers(); });
  }

  [[nodiscard]] Expected<void, SinkError> close() override {
    if (given_up_.load(std::memory_order_relaxed)) socket_.set(zmq::sockopt::linger, 0);
    close_sockets();
    // Waits until everything is sent, kLinger_ms at most.
    context_.close();
    return {};
  }
  void give_up() noexcept override { given_up_.store(true, std::memory_order_relaxed); }

  [[nodiscard]] std::uint64_t delivered() const noexcept override { return delivered_; }

 private:
  static constexpr int kLinger_ms = 2000;
  static constexpr int kStuck_ms = 5000;  ///< who takes nothing for so long is waited for no more
  // A subscriber sends subscriptions and nothing else: short, and few of them.
  static constexpr std::int64_t kLongestMessage = 1024;
  static constexpr int kMostSubscriptions = 4096;
  static constexpr int kMostConnections = 64;
  static constexpr int kQueuedSubscriptions = 64;
  static constexpr const char* kMonitor = "inproc://merkel-monitor";

  static std::string type_of(std::uint16_t type) {
    return {reinterpret_cast<const char*>(&type), sizeof type};
  }

  static bool wants_start(const zmq::message_t& message) {
    const std::string_view text = message.to_string_view();
    return text.starts_with('\1') && text.substr(1).starts_with(type_of(kStartMessage));
  }

  template <class Action>
  Expected<void, SinkError> guarded(Action action) {
    try {
      action();
    } catch (const zmq::error_t& error) {
      return Unexpected<SinkError>({.sentence = uri_ + " failed: " + error.what() + "; run again"});
    }
    return {};
  }

  void open_socket() {
    socket_.set(zmq::sockopt::sndtimeo, kStuck_ms);
    socket_.set(zmq::sockopt::sndhwm, parameters_.high_water_mark);
    socket_.set(zmq::sockopt::rcvhwm, kQueuedSubscriptions);
    socket_.set(zmq::sockopt::maxmsgsize, kLongestMessage);
    socket_.set(zmq::sockopt::linger, kLinger_ms);
    socket_.set(zmq::sockopt::xpub_nodrop, true);
    socket_.set(zmq::sockopt::xpub_verboser, true);  // every subscription is seen, and counted
    if (::zmq_socket_monitor(socket_.handle(), kMonitor,
                             ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_CLOSED | ZMQ_EVENT_DISCONNECTED) != 0) {
      throw zmq::error_t();
    }
    monitor_.set(zmq::sockopt::rcvhwm, 0);  // ZeroMQ's thread waits while it is full
    monitor_.connect(kMonitor);
    socket_.bind(parameters_.endpoint);
  }

  /// Takes in subscriptions and connections, and bounds both: whoever exceeds a limit costs all
  /// subscribers their connection. Honest ones come back by themselves within 100 ms.
  void look_after_peers() {
    bool start_wanted = false;
    zmq::message_t message;
    while (socket_.recv(message, zmq::recv_flags::dontwait)) {
      const bool subscribes = message.size() > 0 && *message.data<char>() == 1;
      subscriptions_ += subscribes ? 1 : -1;
      start_wanted = start_wanted || wants_start(message);
      if (subscriptions_ > kMostSubscriptions) break;
    }
    while (monitor_.recv(message, zmq::recv_flags::dontwait)) {
      std::uint16_t event = 0;
      if (message.size() >= sizeof event) std::memcpy(&event, message.data(), sizeof event);
      if (event == ZMQ_EVENT_ACCEPTED) ++connections_;
      if (event == ZMQ_EVENT_DISCONNECTED) --connections_;
      static_cast<void>(monitor_.recv(message, zmq::recv_flags::dontwait));  // its address
    }
    if (subscriptions_ > kMostSubscriptions || connections_ > kMostConnections) {
      drop_all_peers();
    } else if (start_wanted) {
      send_start();
    }
  }

  /// Stops the monitor first: ZeroMQ's thread blocks for good in an event that no socket takes.
  void close_sockets() {
    ::zmq_socket_monitor(socket_.handle(), nullptr, 0);
    monitor_.close();
    socket_.close();
  }

  void drop_all_peers() {
    socket_.set(zmq::sockopt::linger, 0);
    close_sockets();
    subscriptions_ = connections_ = 0;
    socket_ = zmq::socket_t(context_, zmq::socket_type::xpub);
    monitor_ = zmq::socket_t(context_, zmq::socket_type::pair);
    // The address is free once the closed socket is gone, a moment later.
    for (int attempt = 0;; ++attempt) {
      try {
        open_socket();
        return;
      } catch (const zmq::error_t& error) {
        if (error.num() != EADDRINUSE || attempt == kRebinds) throw;
        close_sockets();
        std::this_thread::sleep_for(kRebindPause);
        socket_ = zmq::socket_t(context_, zmq::socket_type::xpub);
        monitor_ = zmq::socket_t(context_, zmq::socket_type::pair);
      }
    }
  }

  /// What a subscriber may want to know besides spikes: when the run began, and where each afferent
  /// is. Sent under a type of its own, whenever somebody subscribes to that type.
  std::string start_message(const RunOrigin& origin) const {
    std::string json = R"({"event_type":"merkel_start","stream":)" + stream_ +
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

  void send_start() {
    if (start_json_.empty()) return;
    if (!socket_.send(zmq::buffer(start_type_),
                      zmq::send_flags::sndmore | zmq::send_flags::dontwait)) {
      return;
    }
    static_cast<void>(socket_.send(zmq::buffer(start_json_), zmq::send_flags::dontwait));
  }

  void send(const SpikeEvent& spike, const ClockPair& now) {
    write_json(spike, now);
    ++sequence_;
    if (send_parts()) {
      ++delivered_;
      return;
    }
    wait_flag_ = zmq::send_flags::dontwait;  // waits for nobody again
    // Some subscriber's queue is full: it loses the message, the others get it.
    socket_.set(zmq::sockopt::xpub_nodrop, false);
    static_cast<void>(send_parts());
    socket_.set(zmq::sockopt::xpub_nodrop, true);
  }

  bool send_parts() {
    if (given_up_.load(std::memory_order_relaxed)) wait_flag_ = zmq::send_flags::dontwait;
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

  static constexpr int kRebinds = 50;
  static constexpr std::chrono::milliseconds kRebindPause{10};

  std::string uri_;
  Parameters parameters_;
  std::vector<AfferentRow> afferents_;
  zmq::context_t context_;
  zmq::socket_t socket_;
  zmq::socket_t monitor_;
  std::string type_;
  std::string start_type_;
  std::string stream_;
  std::string json_;
  std::string start_json_;
  zmq::send_flags wait_flag_;
  std::atomic<bool> given_up_{false};
  bool start_wanted_early_ = false;
  int subscriptions_ = 0;
  int connections_ = 0;
  std::uint64_t sequence_ = 0;
  std::uint64_t delivered_ = 0;
};

/// ZeroMQ removes whatever is at the path of an ipc: address. Leaves it only what another run has
/// left: a socket that no program listens at.
Expected<void, SetupError> make_way(const std::string& uri, const std::string& path) {
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0) return {};
  const auto refused = [&](const std::string& why) {
    return bad_input("\"" + uri + "\": " + path + " exists already and " + why +
                     ": name another file");
  };
  if (!S_ISSOCK(status.st_mode)) return refused("is not a socket");
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) return {};  // too long: ZeroMQ says so
  path.copy(address.sun_path, path.size());
  const int probe = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const bool dead =
      probe >= 0 &&
      ::connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 &&
      errno == ECONNREFUSED;
  if (probe >= 0) ::close(probe);
  if (!dead) return refused("another program listens there");
  return {};
}

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
  } else if (!endpoint.starts_with(kIpc)) {
    return bad_input("\"" + uri.text + "\": the address must be tcp://HOST:PORT or ipc://FILE, " +
                     "for example zmq:" + std::string(kDefaultEndpoint));
  }
  if (endpoint.starts_with(kIpc)) {
    if (auto free = make_way(uri.text, endpoint.substr(kIpc.size())); !free) {
      return Unexpected<SetupError>(free.error());
    }
  }
  auto sink =
      std::make_unique<ZmqSpikeSink>(uri.text,
                                     ZmqSpikeSink::Parameters{.endpoint = endpoint,
                                                              .stream = stream,
                                                              .topic = topic,
                                                              .high_water_mark = high_water_mark,
                                                              .wait_when_full = wait_when_full},
                                     afferents_of(setup));
  if (auto bound = sink->bind(); !bound) return Unexpected<SetupError>(bound.error());
  if (!sink->wait_for_subscribers(subscribers, patience)) {
    return bad_input("\"" + uri.text + "\": not " + std::to_string(subscribers) +
                     " subscribers came in time: start them, or leave out the option subscribers");
  }
  return sink;
}

}  // namespace merkel
