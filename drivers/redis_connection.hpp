#pragma once

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

/// Connects to a server at HOST:PORT, or at the socket with that absolute path; waits at most a
/// second, also for its replies. \param allow_remote  the server may be on another machine
[[nodiscard]] Expected<RedisConnection, SetupError> connect_to_redis(const Uri& uri,
                                                                     bool allow_remote);

}  // namespace merkel
