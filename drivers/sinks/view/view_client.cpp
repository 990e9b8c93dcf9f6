#include "drivers/sinks/view/view_client.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace merkel {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace net = boost::asio;
namespace websocket = beast::websocket;

constexpr std::size_t kMaxWaitingFrames = 2;
constexpr std::size_t kMaxRequest = 1024;     ///< from a browser
constexpr std::chrono::seconds kStalled{20};  ///< limit for a browser that reads nothing

}  // namespace

ViewClient::ViewClient(net::ip::tcp::socket socket, ViewServerState& state, bool steers)
    : socket_(std::move(socket)), state_(state), most_waiting_(kMaxWaitingFrames), steers_(steers) {
  // Frames queued in the kernel are out of date: keep its buffer short.
  boost::system::error_code ignored;
  beast::get_lowest_layer(socket_).socket().set_option(net::socket_base::send_buffer_size(1 << 17),
                                                       ignored);
}

void ViewClient::accept(const http::request<http::empty_body>& request) {
  beast::get_lowest_layer(socket_).expires_never();
  socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
  socket_.read_message_max(kMaxRequest);
  socket_.auto_fragment(false);
  socket_.async_accept(request, [self = shared_from_this()](beast::error_code error) {
    if (error) return;
    self->state_.clients.insert(self);
    self->waiting_.assign(self->state_.history.begin(), self->state_.history.end());
    self->most_waiting_ = self->waiting_.size() + kMaxWaitingFrames;
    self->write_hello();
    self->read();
  });
}

void ViewClient::send(const ViewFrame& frame) {
  if (waiting_.size() >= most_waiting_) {
    ++dropped_;
    waiting_.back() = frame;  // replaced by the newest
  } else {
    waiting_.push_back(frame);
  }
  if (!writing_) write();
}

void ViewClient::leave_if_stalled(std::chrono::steady_clock::time_point now) {
  if (!writing_ || now - writing_since_ < kStalled) return;
  beast::get_lowest_layer(socket_).close();
  leave();
}

void ViewClient::finish() {
  finishing_ = true;
  if (!writing_) say_goodbye();
}

void ViewClient::read() {
  socket_.async_read(input_, [self = shared_from_this()](beast::error_code error, std::size_t) {
    if (error) return self->leave();
    self->take_message();
    self->read();
  });
}

void ViewClient::take_message() {
  const auto data = input_.cdata();
  const auto request = ViewRequest::parse({static_cast<const char*>(data.data()), data.size()});
  input_.consume(input_.size());
  if (!request || (request->steers() && !steers_) || !state_.on_request) return;
  state_.on_request(*request);
}

void ViewClient::begin_writing() {
  writing_ = true;
  writing_since_ = std::chrono::steady_clock::now();
}

void ViewClient::write_hello() {
  begin_writing();
  socket_.text(true);
  current_ = steers_ ? state_.steering_hello : state_.hello;
  write_parts({net::buffer(*current_), net::const_buffer()});
}

void ViewClient::write() {
  begin_writing();
  current_ = std::move(waiting_.front());
  waiting_.pop_front();
  most_waiting_ = std::max(waiting_.size() + kMaxWaitingFrames, kMaxWaitingFrames);
  std::memcpy(prefix_.data(), &dropped_, sizeof dropped_);
  socket_.binary(true);
  write_parts({net::buffer(prefix_), net::buffer(*current_)});
}

void ViewClient::write_parts(const std::array<net::const_buffer, 2>& parts) {
  socket_.async_write(parts, [self = shared_from_this()](beast::error_code error, std::size_t) {
    self->written(error);
  });
}

void ViewClient::written(beast::error_code error) {
  writing_ = false;
  if (error) return leave();
  if (!waiting_.empty()) return write();
  if (finishing_) say_goodbye();
}

void ViewClient::say_goodbye() {
  begin_writing();
  socket_.async_close(websocket::close_code::going_away,
                      [self = shared_from_this()](beast::error_code) { self->leave(); });
}

}  // namespace merkel
