#include "drivers/sinks/view/view_server.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <deque>
#include <list>
#include <optional>
#include <set>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <pthread.h>

#include "drivers/sinks/host_name.hpp"
#include "drivers/sinks/view/page_files.hpp"
#include "drivers/sinks/view/view_access.hpp"

namespace merkel {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace net = boost::asio;
namespace websocket = beast::websocket;
using net::ip::tcp;
using Frame = std::shared_ptr<const std::string>;

constexpr std::size_t kMostClients = 64;
constexpr std::size_t kMostUnserved = 32;  ///< connections whose request is still to come
constexpr std::size_t kHistory = 1500;     ///< frames that a new client is sent: a minute
constexpr std::size_t kHistoryBytes = 8 << 20;
constexpr std::size_t kMostWaiting = 2;
constexpr std::size_t kLongestRequest = 8192;
constexpr std::size_t kLongestMessage = 1024;  ///< from a client
constexpr std::chrono::seconds kPatience{5};   ///< for a request, and for its response to be taken
constexpr std::chrono::seconds kStalled{20};   ///< a client that takes nothing for so long
constexpr std::chrono::milliseconds kFarewell{500};

std::string_view view_of(beast::string_view text) { return {text.data(), text.size()}; }

std::string_view mime_type(std::string_view name) {
  if (name.ends_with(".html")) return "text/html; charset=utf-8";
  if (name.ends_with(".js")) return "text/javascript; charset=utf-8";
  if (name.ends_with(".css")) return "text/css; charset=utf-8";
  return "text/plain; charset=utf-8";
}

http::response<http::string_body> response_to(const http::request<http::empty_body>& request,
                                              bool allowed) {
  http::response<http::string_body> response{http::status::ok, request.version()};
  response.set(http::field::cache_control, "no-store");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Content-Security-Policy",
               "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
               "img-src data:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'");
  response.set(http::field::content_type, "text/plain; charset=utf-8");
  const bool head = request.method() == http::verb::head;
  std::string_view target = view_of(request.target());
  target = target.substr(0, target.find('?'));
  const std::string_view name = target == "/" ? "page.html" : target.substr(target.empty() ? 0 : 1);
  if (!allowed) {
    response.result(http::status::forbidden);
    response.body() = "open the page by the address that merkel printed, or as http://localhost\n";
  } else if (request.method() != http::verb::get && !head) {
    response.result(http::status::method_not_allowed);
  } else {
    response.result(http::status::not_found);
    for (const PageFile& file : page_files()) {
      if (file.name != name) continue;
      response.result(http::status::ok);
      response.set(http::field::content_type,
                   beast::string_view(mime_type(name).data(), mime_type(name).size()));
      response.body() = file.content;
    }
  }
  response.keep_alive(false);
  response.prepare_payload();
  if (head) response.body().clear();
  return response;
}

class Client;
class Connection;

/// What the clients share; touched by the server's thread only.
struct Room {
  std::set<std::shared_ptr<Client>> clients;
  std::list<Connection*> unserved;  ///< oldest first
  std::deque<Frame> history;
  std::size_t history_bytes = 0;
  Frame hello;
  Frame steering_hello;
  std::string token;
  std::function<void(const ViewRequest&)> on_request;
  bool loopback_only = true;
  std::size_t most_sockets = kMostClients;

  void remember(const Frame& frame, bool first) {
    if (first) {
      history.clear();
      history_bytes = 0;
    }
    history.push_back(frame);
    history_bytes += frame->size();
    while (history.size() > kHistory || (history_bytes > kHistoryBytes && history.size() > 1)) {
      history_bytes -= history.front()->size();
      history.pop_front();
    }
  }
};

/// One browser's socket.
class Client : public std::enable_shared_from_this<Client> {
 public:
  /// \param steers  whether it has shown the token
  Client(tcp::socket socket, Room& room, bool steers)
      : socket_(std::move(socket)), room_(room), steers_(steers) {
    // What waits in the kernel is old news: keep it short.
    boost::system::error_code ignored;
    beast::get_lowest_layer(socket_).socket().set_option(
        net::socket_base::send_buffer_size(1 << 17), ignored);
  }

  void accept(const http::request<http::empty_body>& request) {
    beast::get_lowest_layer(socket_).expires_never();
    socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket_.read_message_max(kLongestMessage);
    socket_.auto_fragment(false);
    socket_.async_accept(request, [self = shared_from_this()](beast::error_code error) {
      if (error) return;
      self->room_.clients.insert(self);
      self->waiting_.assign(self->room_.history.begin(), self->room_.history.end());
      self->most_waiting_ = self->waiting_.size() + kMostWaiting;
      self->write_hello();
      self->read();
    });
  }

  void send(const Frame& frame) {
    if (waiting_.size() >= most_waiting_) {
      ++dropped_;
      waiting_.back() = frame;  // the latest wins
    } else {
      waiting_.push_back(frame);
    }
    if (!writing_) write();
  }

  /// Cuts the connection if nothing was taken for long.
  void leave_if_stalled(std::chrono::steady_clock::time_point now) {
    if (!writing_ || now - writing_since_ < kStalled) return;
    beast::get_lowest_layer(socket_).close();
    leave();
  }

  /// Ends the connection after what waits.
  void finish() {
    finishing_ = true;
    if (!writing_) say_goodbye();
  }

 private:
  void read() {
    socket_.async_read(input_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (error) return self->leave();
      self->take_message();
      self->read();
    });
  }

  void take_message() {
    const auto data = input_.cdata();
    const auto request = ViewRequest::parse({static_cast<const char*>(data.data()), data.size()});
    input_.consume(input_.size());
    if (!request || (request->steers() && !steers_) || !room_.on_request) return;
    room_.on_request(*request);
  }

  void begin_writing() {
    writing_ = true;
    writing_since_ = std::chrono::steady_clock::now();
  }

  void write_hello() {
    begin_writing();
    socket_.text(true);
    hello_ = steers_ ? room_.steering_hello : room_.hello;
    socket_.async_write(net::buffer(*hello_),
                        [self = shared_from_this()](beast::error_code error, std::size_t) {
                          self->written(error);
                        });
  }

  void write() {
    begin_writing();
    current_ = std::move(waiting_.front());
    waiting_.pop_front();
    most_waiting_ = std::max(waiting_.size() + kMostWaiting, kMostWaiting);
    std::memcpy(prefix_.data(), &dropped_, sizeof dropped_);
    socket_.binary(true);
    const std::array<net::const_buffer, 2> parts = {net::buffer(prefix_), net::buffer(*current_)};
    socket_.async_write(parts, [self = shared_from_this()](beast::error_code error, std::size_t) {
      self->written(error);
    });
  }

  void written(beast::error_code error) {
    writing_ = false;
    if (error) return leave();
    if (!waiting_.empty()) return write();
    if (finishing_) say_goodbye();
  }

  void say_goodbye() {
    begin_writing();
    socket_.async_close(websocket::close_code::going_away,
                        [self = shared_from_this()](beast::error_code) { self->leave(); });
  }

  void leave() { room_.clients.erase(shared_from_this()); }

  websocket::stream<beast::tcp_stream> socket_;
  Room& room_;
  beast::flat_buffer input_;
  std::deque<Frame> waiting_;
  std::size_t most_waiting_ = kMostWaiting;
  Frame current_;
  Frame hello_;
  std::array<char, sizeof(std::uint32_t)> prefix_{};
  std::uint32_t dropped_ = 0;
  std::chrono::steady_clock::time_point writing_since_{};
  bool steers_;
  bool writing_ = false;
  bool finishing_ = false;
};

/// One request: a file of the page, or the way to its socket.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, Room& room) : stream_(std::move(socket)), room_(room) {
    place_ = room_.unserved.insert(room_.unserved.end(), this);
    parser_.header_limit(kLongestRequest);
    parser_.body_limit(0);
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() {
    if (listed_) room_.unserved.erase(place_);
  }

  void serve() {
    stream_.expires_after(kPatience);
    http::async_read(stream_, input_, parser_,
                     [self = shared_from_this()](beast::error_code error, std::size_t) {
                       if (!error) self->answer();
                     });
  }

  /// Makes room for another.
  void displace() {
    room_.unserved.erase(place_);
    listed_ = false;
    stream_.close();
  }

 private:
  void answer() {
    const auto& request = parser_.get();
    const bool allowed = may_view(view_of(request[http::field::host]),
                                  view_of(request[http::field::origin]), room_.loopback_only);
    const std::string_view target = view_of(request.target());
    const bool socket = target.substr(0, target.find('?')) == "/socket";
    if (allowed && socket && websocket::is_upgrade(request) &&
        room_.clients.size() < std::min(kMostClients, room_.most_sockets / 2)) {
      const bool steers = has_view_token(target, room_.token);
      std::make_shared<Client>(stream_.release_socket(), room_, steers)->accept(request);
      return;
    }
    response_ = response_to(request, allowed);
    if (allowed && socket) {
      response_.result(http::status::service_unavailable);
      response_.body() = "too many pages are open: close some\n";
      response_.prepare_payload();
    }
    stream_.expires_after(kPatience);
    http::async_write(stream_, response_,
                      [self = shared_from_this()](beast::error_code, std::size_t) {
                        beast::error_code ignored;
                        self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
                      });
  }

  beast::tcp_stream stream_;
  Room& room_;
  std::list<Connection*>::iterator place_;
  bool listed_ = true;
  beast::flat_buffer input_{kLongestRequest};
  http::request_parser<http::empty_body> parser_;
  http::response<http::string_body> response_;
};

}  // namespace

class ViewServer::Thread {
 public:
  explicit Thread(const Parameters& parameters) {
    room_.hello = std::make_shared<const std::string>(parameters.hello);
    room_.steering_hello = std::make_shared<const std::string>(parameters.steering_hello);
    room_.token = parameters.token;
    room_.on_request = parameters.on_request;
    room_.loopback_only = HostAndPort{.host = parameters.host, .port = parameters.port}.loopback();
    room_.most_sockets = most_view_sockets(kMostClients + kMostUnserved);
  }
  Thread(const Thread&) = delete;
  Thread& operator=(const Thread&) = delete;
  ~Thread() {
    context_.stop();
    if (thread_.joinable()) thread_.join();
    room_.clients.clear();
  }

  /// What went wrong, if anything.
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
                room_.remember(frame, first);
                for (const auto& client : room_.clients) client->send(frame);
              });
  }

  void finish() {
    net::post(context_, [this] {
      boost::system::error_code ignored;
      acceptor_.close(ignored);
      const auto clients = room_.clients;
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
        // Out of descriptors, perhaps: wait until some client leaves.
        timer_.expires_after(std::chrono::milliseconds{100});
        timer_.async_wait([this](beast::error_code) { accept(); });
        return;
      }
      if (room_.unserved.size() >= std::min(kMostUnserved, room_.most_sockets / 2)) {
        room_.unserved.front()->displace();
      }
      std::make_shared<Connection>(std::move(socket), room_)->serve();
      accept();
    });
  }

  void watch_clients() {
    stalls_.expires_after(std::chrono::seconds{1});
    stalls_.async_wait([this](beast::error_code error) {
      if (error) return;
      const auto clients = room_.clients;
      const auto now = std::chrono::steady_clock::now();
      for (const auto& client : clients) client->leave_if_stalled(now);
      watch_clients();
    });
  }

  void await_departures(std::chrono::steady_clock::time_point deadline) {
    if (room_.clients.empty() || std::chrono::steady_clock::now() >= deadline) {
      context_.stop();
      return;
    }
    timer_.expires_after(std::chrono::milliseconds{10});
    timer_.async_wait([this, deadline](beast::error_code) { await_departures(deadline); });
  }

  Room room_;  // outlives the context, whose pending work knows it
  net::io_context context_{1};
  tcp::acceptor acceptor_{context_};
  net::steady_timer timer_{context_};
  net::steady_timer stalls_{context_};
  std::thread thread_;
};

Expected<std::unique_ptr<ViewServer>, SetupError> ViewServer::start(Parameters parameters) {
  auto thread = std::make_unique<Thread>(parameters);
  const auto error = thread->listen(parameters.host, parameters.port);
  const std::string port = std::to_string(parameters.port);
  if (error == boost::system::errc::address_in_use) {
    return unavailable(
        "the port " + port +
        " of the live page is in use, perhaps by another merkel: name another, as in "
        "view:" +
        std::to_string(parameters.port == 65535 ? 8081 : parameters.port + 1));
  }
  if (error) {
    return unavailable("cannot serve the live page at " + parameters.host + ":" + port + ": " +
                       error.message() + "; name a port such as view:8080");
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
