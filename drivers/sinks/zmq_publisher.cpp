#include "drivers/sinks/zmq_publisher.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <thread>

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "drivers/files/owned_descriptor.hpp"
#include "drivers/sinks/json_line.hpp"
#include "drivers/transports/host_name.hpp"

namespace merkel {
namespace {

constexpr int kLinger_ms = 2000;
constexpr int kStuck_ms = 5000;  ///< a subscriber that reads nothing for this long is abandoned
// A subscriber sends subscriptions and nothing else: short, and few of them.
constexpr std::int64_t kMaxZmqMessage = 1024;
constexpr int kMaxSubscriptions = 4096;
constexpr int kMaxConnections = 64;
constexpr int kQueuedSubscriptions = 64;
constexpr const char* kMonitor = "inproc://merkel-monitor";
constexpr int kRebinds = 50;
constexpr std::chrono::milliseconds kRebindPause{10};
constexpr std::size_t kThreads = 2;  ///< of ZeroMQ: one for connections, one to close them
constexpr std::chrono::milliseconds kNaming{500};
constexpr std::string_view kIpc = "ipc://";
constexpr std::string_view kTcp = "tcp://";

/// ZeroMQ removes any file at the path of an ipc: address. Refuses a path with anything but the
/// unused socket of an earlier run.
Expected<void, SetupError> make_way(const std::string& uri, const std::string& path) {
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0) return {};
  const auto refused = [&](const std::string& why) {
    return bad_input("\"" + uri + "\": " + path + " already exists and " + why +
                     ": use another file");
  };
  if (!S_ISSOCK(status.st_mode)) return refused("is not a socket");
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) return {};  // too long: ZeroMQ reports it
  path.copy(address.sun_path, path.size());
  const OwnedDescriptor probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const bool dead =
      probe.get() >= 0 &&
      ::connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 &&
      errno == ECONNREFUSED;
  if (!dead) return refused("another program listens there");
  return {};
}

/// Checks an endpoint and returns it in ZeroMQ's syntax.
Expected<std::string, SetupError> checked_endpoint(const Uri& uri, const SinkSetup& setup,
                                                   std::string_view fallback) {
  const std::string endpoint = uri.path.empty() ? std::string(fallback) : uri.path;
  const std::string example = uri.scheme + ":" + std::string(fallback);
  if (endpoint.starts_with(kIpc)) {
    if (auto free = make_way(uri.text, endpoint.substr(kIpc.size())); !free) {
      return Unexpected<SetupError>(free.error());
    }
    return endpoint;
  }
  if (!endpoint.starts_with(kTcp)) {
    return bad_input("\"" + uri.text + "\": the address must be tcp://HOST:PORT or ipc://FILE, " +
                     "for example " + example);
  }
  const auto address = HostAndPort::parse(std::string_view(endpoint).substr(kTcp.size()));
  if (!address) {
    return bad_input("\"" + uri.text + "\": the address must be tcp://HOST:PORT, for example " +
                     example);
  }
  if (!setup.allow_remote && !address->loopback()) return remote_refused(uri.text, address->host);
  // In a bind, a name denotes an interface.
  if (address->host == "localhost") return "tcp://127.0.0.1:" + std::to_string(address->port);
  return endpoint;
}

int next_publisher_number() {
  static std::atomic<int> last{0};
  return ++last;
}

zmq::context_t context_with_threads_named(int number) {
  zmq::context_t context;
  context.set(zmq::ctxopt::thread_name_prefix, number);
  return context;
}

bool subscribes(const zmq::message_t& message) {
  return message.size() > 0 && *message.data<char>() == 1;
}

}  // namespace

ZmqPublisher::Options ZmqPublisher::Options::read(UriOptions& options, const SinkSetup& setup) {
  return {.topic = options.text("topic", ""),
          .high_water_mark = static_cast<int>(options.whole("hwm", 100'000, 0, 100'000'000)),
          .wait_when_full = options.word("when_full", "drop", "drop|wait") == "wait",
          .subscribers = options.whole("subscribers", 0, 0, 1000),
          .patience = std::chrono::milliseconds{static_cast<std::int64_t>(
              1e3 * options.number("wait_s", 10.0, 0.0, 3600.0))},
          .stream = json_string(
              options.text("stream", setup.run.scene.empty() ? "merkel" : setup.run.scene))};
}

ZmqPublisher::ZmqPublisher(Uri uri, const Options& options, std::uint16_t announced_type)
    : Sink(uri.text),
      given_(std::move(uri)),
      options_(options),
      number_(next_publisher_number()),
      context_(context_with_threads_named(number_)),
      socket_(context_, zmq::socket_type::xpub),
      monitor_(context_, zmq::socket_type::pair),
      waits_(options.wait_when_full),
      announced_head_(head(announced_type)) {}

std::string ZmqPublisher::head(std::uint16_t type) const {
  return std::string(reinterpret_cast<const char*>(&type), sizeof type) + options_.topic;
}

Expected<void, SetupError> ZmqPublisher::listen(const SinkSetup& setup, std::string_view fallback) {
  auto endpoint = checked_endpoint(given_, setup, fallback);
  if (!endpoint) return Unexpected<SetupError>(endpoint.error());
  endpoint_ = std::move(*endpoint);
  if (auto bound = bind(fallback); !bound) return bound;
  if (wait_for_subscribers()) return {};
  return bad_input(
      "\"" + uri_ + "\": fewer than " + std::to_string(options_.subscribers) +
      " subscribers connected in time: start the subscribers, or remove the option subscribers");
}

Expected<void, SetupError> ZmqPublisher::bind(std::string_view fallback) {
  try {
    open_socket();
  } catch (const zmq::error_t& error) {
    if (error.num() == EADDRINUSE) {
      return unavailable(
          "\"" + uri_ + "\": " + endpoint_ +
          " is in use, perhaps by Open Ephys or another merkel process: choose another port");
    }
    return unavailable("\"" + uri_ + "\": cannot listen at " + endpoint_ + ": " + error.what() +
                       "; write " + given_.scheme + ":" + std::string(fallback) + " or " +
                       given_.scheme + ":ipc://FILE");
  }
  return {};
}

void ZmqPublisher::open_socket() {
  socket_.set(zmq::sockopt::sndtimeo, kStuck_ms);
  socket_.set(zmq::sockopt::sndhwm, options_.high_water_mark);
  socket_.set(zmq::sockopt::rcvhwm, kQueuedSubscriptions);
  socket_.set(zmq::sockopt::maxmsgsize, kMaxZmqMessage);
  socket_.set(zmq::sockopt::linger, kLinger_ms);
  socket_.set(zmq::sockopt::xpub_nodrop, true);
  socket_.set(zmq::sockopt::xpub_verboser,
              true);  // reports every subscription
  if (::zmq_socket_monitor(socket_.handle(), kMonitor,
                           ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_CLOSED | ZMQ_EVENT_DISCONNECTED) != 0) {
    throw zmq::error_t();
  }
  monitor_.set(zmq::sockopt::rcvhwm, 0);  // unlimited: ZeroMQ's thread blocks on a full queue
  monitor_.connect(kMonitor);
  socket_.bind(endpoint_);
}

bool ZmqPublisher::wait_for_subscribers() {
  const auto deadline = std::chrono::steady_clock::now() + options_.patience;
  for (std::int64_t subscribed = 0; subscribed < options_.subscribers;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        deadline - std::chrono::steady_clock::now());
    if (left.count() <= 0) return false;
    socket_.set(zmq::sockopt::rcvtimeo, static_cast<int>(left.count()));
    zmq::message_t message;
    if (!socket_.recv(message)) continue;
    if (subscribes(message)) ++subscribed;
    take_subscription(message);
  }
  return true;
}

Expected<void, SinkError> ZmqPublisher::announce(std::string text) {
  announced_text_ = std::move(text);
  return flush();
}

void ZmqPublisher::take_subscription(const zmq::message_t& message) {
  subscriptions_ += subscribes(message) ? 1 : -1;
  const auto type = std::string_view(announced_head_).substr(0, sizeof(std::uint16_t));
  announcement_wanted_ =
      announcement_wanted_ ||
      (subscribes(message) && message.to_string_view().substr(1).starts_with(type));
}

void ZmqPublisher::count_connections() {
  zmq::message_t message;
  while (monitor_.recv(message, zmq::recv_flags::dontwait)) {
    std::uint16_t event = 0;
    if (message.size() >= sizeof event) std::memcpy(&event, message.data(), sizeof event);
    if (event == ZMQ_EVENT_ACCEPTED) ++connections_;
    if (event == ZMQ_EVENT_DISCONNECTED) --connections_;
    static_cast<void>(monitor_.recv(message, zmq::recv_flags::dontwait));  // its address
  }
}

void ZmqPublisher::look_after_peers() {
  zmq::message_t message;
  while (subscriptions_ <= kMaxSubscriptions && socket_.recv(message, zmq::recv_flags::dontwait)) {
    take_subscription(message);
  }
  count_connections();
  if (subscriptions_ > kMaxSubscriptions || connections_ > kMaxConnections) {
    drop_all_peers();
  } else if (announcement_wanted_ && !announced_text_.empty()) {
    send_parts(announced_head_, announced_text_, zmq::send_flags::dontwait);
    announcement_wanted_ = false;
  }
}

/// Stops the monitor first: ZeroMQ's thread blocks forever on an event that no socket reads.
void ZmqPublisher::close_sockets() {
  ::zmq_socket_monitor(socket_.handle(), nullptr, 0);
  monitor_.close();
  socket_.close();
}

void ZmqPublisher::drop_all_peers() {
  subscriptions_ = connections_ = 0;
  socket_.set(zmq::sockopt::linger, 0);
  // The address becomes free shortly after the socket was closed.
  for (int attempt = 0;; ++attempt) {
    close_sockets();
    if (attempt > 0) std::this_thread::sleep_for(kRebindPause);
    socket_ = zmq::socket_t(context_, zmq::socket_type::xpub);
    monitor_ = zmq::socket_t(context_, zmq::socket_type::pair);
    try {
      open_socket();
      return;
    } catch (const zmq::error_t& error) {
      if (error.num() != EADDRINUSE || attempt == kRebinds) throw;
    }
  }
}

bool ZmqPublisher::send(std::string_view head, std::string_view text) {
  if (given_up_.load(std::memory_order_relaxed)) waits_ = false;
  if (send_parts(head, text, waits_ ? zmq::send_flags::none : zmq::send_flags::dontwait)) {
    return true;
  }
  waits_ = false;
  // Some subscriber's queue is full: it loses the message, the others get it.
  socket_.set(zmq::sockopt::xpub_nodrop, false);
  send_parts(head, text, zmq::send_flags::dontwait);
  socket_.set(zmq::sockopt::xpub_nodrop, true);
  return false;
}

bool ZmqPublisher::send_parts(std::string_view head, std::string_view text, zmq::send_flags flags) {
  if (!socket_.send(zmq::buffer(head), zmq::send_flags::sndmore | flags)) return false;
  return socket_.send(zmq::buffer(text), flags).has_value();
}

std::vector<pid_t> ZmqPublisher::threads() const {
  const std::string prefix = std::to_string(number_) + "/ZMQbg/";
  std::vector<pid_t> threads;
  // A thread names itself, soon after it was started.
  const auto deadline = std::chrono::steady_clock::now() + kNaming;
  do {
    threads.clear();
    std::error_code error;
    for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", error)) {
      std::string name;
      std::getline(std::ifstream(task.path() / "comm"), name);
      if (!name.starts_with(prefix)) continue;
      threads.push_back(static_cast<pid_t>(std::stol(task.path().filename().string())));
    }
    if (threads.size() >= kThreads) break;
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  } while (std::chrono::steady_clock::now() < deadline);
  return threads;
}

Expected<void, SinkError> ZmqPublisher::close() {
  if (given_up_.load(std::memory_order_relaxed)) socket_.set(zmq::sockopt::linger, 0);
  close_sockets();
  context_.close();
  return {};
}

}  // namespace merkel
