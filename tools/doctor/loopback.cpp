#include "tools/doctor/loopback.hpp"

#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "drivers/sinks/open_sink.hpp"
#include "realtime/threads/thread_setup.hpp"

#ifdef MERKEL_WITH_ZMQ
#include <zmq.hpp>

namespace merkel {

struct Loopback::Subscriber {
  zmq::context_t context;
  zmq::socket_t socket{context, zmq::socket_type::sub};
};

Expected<std::unique_ptr<Loopback>, SetupError> Loopback::open(std::uint32_t neurons,
                                                               Receive receive) {
  auto subscriber = std::make_unique<Subscriber>();
  try {
    // A free port: one that another socket was given and has released.
    std::string endpoint;
    {
      zmq::context_t context;  // its destructor releases the port
      zmq::socket_t scout(context, zmq::socket_type::pub);
      scout.bind("tcp://127.0.0.1:*");
      endpoint = scout.get(zmq::sockopt::last_endpoint);
    }
    subscriber->socket.set(zmq::sockopt::rcvtimeo, 50);
    subscriber->socket.set(zmq::sockopt::rcvhwm, 0);
    subscriber->socket.set(zmq::sockopt::reconnect_ivl, 5);
    subscriber->socket.set(zmq::sockopt::subscribe, "");
    subscriber->socket.connect(endpoint);
    auto sink = open_sink("zmq:" + endpoint + "?subscribers=1&wait_s=5",
                          {.neurons = neurons, .overwrite = false, .allow_remote = false});
    if (!sink) return Unexpected<SetupError>(sink.error());
    return std::unique_ptr<Loopback>(
        new Loopback(std::move(subscriber), std::move(*sink), std::move(receive)));
  } catch (const zmq::error_t& error) {
    return Unexpected<SetupError>(
        {.kind = SetupError::Kind::kUnavailable,
         .sentence = std::string("cannot send to this host by ZeroMQ: ") + error.what() +
                     "; bring up the loopback interface (ip link set lo up)"});
  }
}

void Loopback::receive_all(const std::stop_token& stop) {
  set_up_helper_thread("merkel-zmq");
  zmq::message_t message;
  while (!stop.stop_requested()) {
    if (!subscriber_->socket.recv(message) || message.more()) continue;
    const auto json = nlohmann::json::parse(message.to_string_view(), nullptr, false);
    const auto time = json.find("time_ns");
    if (json.is_discarded() || time == json.end()) continue;
    receive_(std::chrono::nanoseconds{time->get<std::int64_t>()});
    ++received_;
  }
}

}  // namespace merkel

#else

namespace merkel {

struct Loopback::Subscriber {};

Expected<std::unique_ptr<Loopback>, SetupError> Loopback::open(std::uint32_t, Receive) {
  return nullptr;
}

void Loopback::receive_all(const std::stop_token&) {}

}  // namespace merkel

#endif

namespace merkel {

Loopback::Loopback(std::unique_ptr<Subscriber> subscriber, std::unique_ptr<Sink> sink,
                   Receive receive)
    : subscriber_(std::move(subscriber)),
      sink_(std::move(sink)),
      receive_(std::move(receive)),
      thread_([this](const std::stop_token& stop) { receive_all(stop); }) {}

Loopback::~Loopback() {
  thread_.request_stop();
  thread_.join();
}

std::unique_ptr<Sink> Loopback::sink() { return std::move(sink_); }

void Loopback::settle(std::uint64_t spikes) const {
  for (int i = 0; i < 200 && received_.load() < spikes; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  }
}

}  // namespace merkel
