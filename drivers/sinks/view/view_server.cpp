#include "drivers/sinks/view/view_server.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/error.hpp>
#include <pthread.h>

#include "drivers/sinks/view/view_access.hpp"
#include "drivers/sinks/view/view_client.hpp"
#include "drivers/sinks/view/view_connection.hpp"
#include "drivers/sinks/view/view_server_state.hpp"
#include "drivers/transports/host_name.hpp"

namespace merkel {
namespace {

namespace beast = boost::beast;
namespace net = boost::asio;
using net::ip::tcp;

constexpr std::chrono::milliseconds kFarewell{500};

}  // namespace

class ViewServer::Thread {
 public:
  explicit Thread(const Parameters& parameters) {
    state_.hello = std::make_shared<const std::string>(parameters.hello);
    state_.steering_hello = std::make_shared<const std::string>(parameters.steering_hello);
    state_.token = parameters.token;
    state_.on_request = parameters.on_request;
    state_.loopback_only = HostAndPort{.host = parameters.host, .port = parameters.port}.loopback();
    state_.most_sockets = most_view_sockets(state_.most_sockets);
  }
  Thread(const Thread&) = delete;
  Thread& operator=(const Thread&) = delete;
  ~Thread() {
    context_.stop();
    if (thread_.joinable()) thread_.join();
    state_.clients.clear();
  }

  /// \return the error, if any
  boost::system::error_code listen(const std::string& host, std::uint16_t port) {
    boost::system::error_code error;
    const auto address = net::ip::make_address(host == "localhost" ? "127.0.0.1" : host, error);
    if (error) return error;
    const tcp::endpoint endpoint(address, port);
    acceptor_.open(endpoint.protocol(), error);
    if (error) return error;
    acceptor_.set_option(net::socket_base::reuse_address(true), error);
    acceptor_.bind(endpoint, error);
    if (error) return error;
    acceptor_.listen(net::socket_base::max_listen_connections, error);
    return error;
  }

  void start() {
    accept();
    watch_clients();
    thread_ = std::thread([this] {
      ::pthread_setname_np(::pthread_self(), "merkel-page");
      context_.run();
    });
  }

  void publish(std::string bytes, bool first) {
    net::post(context_,
              [this, first, frame = std::make_shared<const std::string>(std::move(bytes))] {
                state_.remember(frame, first);
                for (const auto& client : state_.clients) client->send(frame);
              });
  }

  void finish() {
    net::post(context_, [this] {
      boost::system::error_code ignored;
      acceptor_.close(ignored);
      const auto clients = state_.clients;
      for (const auto& client : clients) client->finish();
      await_departures(std::chrono::steady_clock::now() + kFarewell);
    });
    if (thread_.joinable()) thread_.join();
  }

 private:
  void accept() {
    acceptor_.async_accept([this](beast::error_code error, tcp::socket socket) {
      if (!acceptor_.is_open()) return;
      if (error) {
        // Possibly out of descriptors: wait until a client disconnects.
        timer_.expires_after(std::chrono::milliseconds{100});
        timer_.async_wait([this](beast::error_code) { accept(); });
        return;
      }
      if (state_.unserved.size() >=
          std::min(ViewServerState::kMaxUnserved, state_.most_sockets / 2)) {
        state_.unserved.front()->displace();
      }
      std::make_shared<ViewConnection>(std::move(socket), state_)->serve();
      accept();
    });
  }

  void watch_clients() {
    stalls_.expires_after(std::chrono::seconds{1});
    stalls_.async_wait([this](beast::error_code error) {
      if (error) return;
      const auto clients = state_.clients;
      const auto now = std::chrono::steady_clock::now();
      for (const auto& client : clients) client->leave_if_stalled(now);
      watch_clients();
    });
  }

  void await_departures(std::chrono::steady_clock::time_point deadline) {
    if (state_.clients.empty() || std::chrono::steady_clock::now() >= deadline) {
      context_.stop();
      return;
    }
    timer_.expires_after(std::chrono::milliseconds{10});
    timer_.async_wait([this, deadline](beast::error_code) { await_departures(deadline); });
  }

  ViewServerState state_;  // outlives the context, whose pending work refers to it
  net::io_context context_{1};
  tcp::acceptor acceptor_{context_};
  net::steady_timer timer_{context_};
  net::steady_timer stalls_{context_};
  std::thread thread_;
};

Expected<std::unique_ptr<ViewServer>, SetupError> ViewServer::start(const Parameters& parameters) {
  auto thread = std::make_unique<Thread>(parameters);
  const auto error = thread->listen(parameters.host, parameters.port);
  const std::string port = std::to_string(parameters.port);
  if (error == boost::system::errc::address_in_use) {
    return unavailable(
        "the port " + port +
        " of the live page is in use, perhaps by another merkel process: choose another port, as in "
        "view:" +
        std::to_string(parameters.port == 65535 ? 8081 : parameters.port + 1));
  }
  if (error) {
    return unavailable("cannot serve the live page at " + parameters.host + ":" + port + ": " +
                       error.message() + "; choose a port such as view:8080");
  }
  thread->start();
  return std::unique_ptr<ViewServer>(new ViewServer(std::move(thread)));
}

ViewServer::ViewServer(std::unique_ptr<Thread> thread) : thread_(std::move(thread)) {}

ViewServer::~ViewServer() = default;

void ViewServer::publish(std::string frame, bool first) {
  thread_->publish(std::move(frame), first);
}

void ViewServer::finish() { thread_->finish(); }

}  // namespace merkel
