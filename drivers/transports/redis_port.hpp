#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/transports/redis_lines.hpp"
#include "drivers/transports/transport.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// The entries of a Redis stream as a port that sends RedisLines.
struct RedisEntries {
  std::unique_ptr<Transport> port;
  std::string columns;  ///< as in the option `columns`
};

/// Opens the entries that come from now on; waits two seconds for the first.
/// \param fields  empty: those of the first entry whose names are columns of the protocol csv
/// \param factors  of columns in volts or counts
[[nodiscard]] Expected<RedisEntries, SetupError> open_redis_stream(const Uri& uri,
                                                                   const std::string& stream,
                                                                   std::vector<RedisField> fields,
                                                                   const UnitFactors& factors);

}  // namespace merkel
