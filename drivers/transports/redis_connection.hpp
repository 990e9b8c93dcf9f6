#pragma once

#include <chrono>
#include <memory>
#include <string>

#include <hiredis/hiredis.h>

#include "core/expected.hpp"
#include "drivers/uri.hpp"

namespace merkel {

struct FreeRedisContext {
  void operator()(redisContext* context) const { redisFree(context); }
};
struct FreeRedisReply {
  void operator()(redisReply* reply) const { freeReplyObject(reply); }
};
using RedisConnection = std::unique_ptr<redisContext, FreeRedisContext>;
using RedisReply = std::unique_ptr<redisReply, FreeRedisReply>;

/// Connects to a server at HOST:PORT, or at the socket with that absolute path.
/// \param allow_remote  the server may be on another machine
/// \param patience  for the connection
/// \param reply_patience  for each of its replies
[[nodiscard]] Expected<RedisConnection, SetupError> connect_to_redis(
    const Uri& uri, bool allow_remote,
    std::chrono::milliseconds patience = std::chrono::milliseconds{1000},
    std::chrono::milliseconds reply_patience = std::chrono::milliseconds{1000});

}  // namespace merkel
