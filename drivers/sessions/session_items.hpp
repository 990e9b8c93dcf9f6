#pragma once

#include <string_view>

#include "drivers/sessions/session_chunk.hpp"

namespace merkel {

/// Adds the items of one XDF chunk of samples to `chunk`. Whatever the bytes are, only possible
/// values are handed out.
/// \param content  of the chunk, behind its stream's number: the count, then the samples
/// \return false where a sample cannot be
[[nodiscard]] bool decode_items(const SessionStream& stream, std::string_view content,
                                SessionChunk& chunk);

}  // namespace merkel
