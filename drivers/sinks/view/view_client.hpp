#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket.hpp>

#include "drivers/sinks/view/view_server_state.hpp"

namespace merkel {

/// The web socket of one browser: sends the scene, then frames. A slow browser receives the newest
/// frame and the number of frames it missed. Thread: server.
class ViewClient : public std::enable_shared_from_this<ViewClient> {
 public:
  /// \param state  outlives the client.  \param steers  true if the browser has sent the token
  ViewClient(boost::asio::ip::tcp::socket socket, ViewServerState& state, bool steers);

  /// Answers the request to upgrade, sends the scene and the history, and joins the clients.
  void accept(const boost::beast::http::request<boost::beast::http::empty_body>& request);
  /// Queues a frame; if the queue is full, the frame replaces the newest in it.
  void send(const ViewFrame& frame);
  /// Closes the connection if the browser has read nothing for 20 s.
  void leave_if_stalled(std::chrono::steady_clock::time_point now);
  /// Closes the connection after the queued frames.
  void finish();

 private:
  void read();
  void take_message();
  void begin_writing();
  void write_hello();
  void write();
  void write_parts(const std::array<boost::asio::const_buffer, 2>& parts);
  void written(boost::beast::error_code error);
  void say_goodbye();
  void leave() { state_.clients.erase(shared_from_this()); }

  static constexpr bool kCompresses = false;  // most pages are open on the same host
  boost::beast::websocket::stream<boost::beast::tcp_stream, kCompresses> socket_;
  ViewServerState& state_;
  boost::beast::flat_buffer input_;
  std::deque<ViewFrame> waiting_;
  std::size_t most_waiting_;
  ViewFrame current_;
  std::array<char, sizeof(std::uint32_t)> prefix_{};
  std::uint32_t dropped_ = 0;
  std::chrono::steady_clock::time_point writing_since_{};
  bool steers_;
  bool writing_ = false;
  bool finishing_ = false;
};

}  // namespace merkel
