// Compiled only if hiredis is found.
#include "drivers/transports/redis_connection.hpp"

#include <sys/time.h>

#include "core/parameters/parameter_error.hpp"
#include "drivers/transports/host_name.hpp"

namespace merkel {
namespace {

timeval timeval_of(std::chrono::milliseconds time) {
  return {.tv_sec = time.count() / 1000, .tv_usec = time.count() % 1000 * 1000};
}

}  // namespace

Expected<RedisConnection, SetupError> connect_to_redis(const Uri& uri, bool allow_remote,
                                                       std::chrono::milliseconds patience,
                                                       std::chrono::milliseconds reply_patience) {
  const timeval timeout = timeval_of(patience);
  RedisConnection connection;
  std::string start = "redis-server --unixsocket " + uri.path;
  if (uri.path.starts_with('/')) {
    connection.reset(redisConnectUnixWithTimeout(uri.path.c_str(), timeout));
  } else {
    const auto address = HostAndPort::parse(uri.path);
    if (!address) {
      return bad_input("\"" + uri.text +
                       "\": the address must be HOST:PORT or the path of a socket, for example "
                       "redis:127.0.0.1:6379");
    }
    if (!allow_remote && !address->loopback()) return remote_refused(uri.text, address->host);
    start = "redis-server --port " + std::to_string(address->port);
    connection.reset(redisConnectWithTimeout(address->host.c_str(), address->port, timeout));
  }
  if (!connection || connection->err != 0) {
    return unavailable("\"" + uri.text + "\": no Redis server answers there (" +
                       (connection ? connection->errstr : "out of memory") + "): start it with " +
                       start);
  }
  redisSetTimeout(connection.get(), timeval_of(reply_patience));
  return connection;
}

}  // namespace merkel
