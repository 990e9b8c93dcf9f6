#pragma once

#include <cstddef>
#include <list>
#include <memory>

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>

#include "drivers/sinks/view/view_server_state.hpp"

namespace merkel {

/// One HTTP request: answered with a file of the page, or passed to a ViewClient. Thread: server.
class ViewConnection : public std::enable_shared_from_this<ViewConnection> {
 public:
  static constexpr std::size_t kMaxRequest = 8192;

  /// \param state  outlives the connection
  ViewConnection(boost::asio::ip::tcp::socket socket, ViewServerState& state);
  ViewConnection(const ViewConnection&) = delete;
  ViewConnection& operator=(const ViewConnection&) = delete;
  ~ViewConnection();

  void serve();
  /// Closes the connection to make room for another.
  void displace();

 private:
  void answer();

  boost::beast::tcp_stream stream_;
  ViewServerState& state_;
  std::list<ViewConnection*>::iterator place_;
  bool listed_ = true;
  boost::beast::flat_buffer input_{kMaxRequest};
  boost::beast::http::request_parser<boost::beast::http::empty_body> parser_;
  boost::beast::http::response<boost::beast::http::string_body> response_;
};

}  // namespace merkel
