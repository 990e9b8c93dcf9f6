#include "drivers/sinks/view/view_connection.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <string_view>
#include <utility>

#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket.hpp>

#include "drivers/files/embedded_text.hpp"
#include "drivers/sinks/view/view_access.hpp"
#include "drivers/sinks/view/view_client.hpp"

namespace merkel {

extern const std::span<const EmbeddedText> kPageFiles;
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::asio::ip::tcp;

constexpr std::chrono::seconds kRequestTimeout{5};  ///< limit for a request and for its response

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
    response.body() = "open the page at the address that merkel printed, or as http://localhost\n";
  } else if (request.method() != http::verb::get && !head) {
    response.result(http::status::method_not_allowed);
  } else {
    response.result(http::status::not_found);
    for (const EmbeddedText& file : kPageFiles) {
      if (file.name != name) continue;
      response.result(http::status::ok);
      response.set(http::field::content_type,
                   beast::string_view(mime_type(name).data(), mime_type(name).size()));
      response.body() = file.text;
    }
  }
  response.keep_alive(false);
  response.prepare_payload();
  if (head) response.body().clear();
  return response;
}

}  // namespace

ViewConnection::ViewConnection(tcp::socket socket, ViewServerState& state)
    : stream_(std::move(socket)), state_(state) {
  place_ = state_.unserved.insert(state_.unserved.end(), this);
  parser_.header_limit(kMaxRequest);
  parser_.body_limit(0);
}

ViewConnection::~ViewConnection() {
  if (listed_) state_.unserved.erase(place_);
}

void ViewConnection::serve() {
  stream_.expires_after(kRequestTimeout);
  http::async_read(stream_, input_, parser_,
                   [self = shared_from_this()](beast::error_code error, std::size_t) {
                     if (!error) self->answer();
                   });
}

void ViewConnection::displace() {
  state_.unserved.erase(place_);
  listed_ = false;
  stream_.close();
}

void ViewConnection::answer() {
  const auto& request = parser_.get();
  std::optional<std::string_view> origin;
  if (const auto given = request.find(http::field::origin); given != request.end()) {
    origin = view_of(given->value());
  }
  const bool allowed = may_view(view_of(request[http::field::host]), origin, state_.loopback_only);
  const std::string_view target = view_of(request.target());
  const bool socket = target.substr(0, target.find('?')) == "/socket";
  if (allowed && socket && websocket::is_upgrade(request) &&
      state_.clients.size() < std::min(ViewServerState::kMaxClients, state_.most_sockets / 2)) {
    const bool steers = has_view_token(target, state_.token);
    std::make_shared<ViewClient>(stream_.release_socket(), state_, steers)->accept(request);
    return;
  }
  response_ = response_to(request, allowed);
  if (allowed && socket) {
    response_.result(http::status::service_unavailable);
    response_.body() = "too many pages are open: close some of them\n";
    response_.prepare_payload();
  }
  stream_.expires_after(kRequestTimeout);
  http::async_write(stream_, response_,
                    [self = shared_from_this()](beast::error_code, std::size_t) {
                      beast::error_code ignored;
                      self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
                    });
}

}  // namespace merkel
