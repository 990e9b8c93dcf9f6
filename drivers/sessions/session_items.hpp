#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sessions/session_chunk.hpp"

namespace merkel {

/// The positions of a stream's channels in a file. Channels are matched by label, so their order
/// and additional channels do not matter.
struct StreamLayout {
  static constexpr std::uint8_t kMissing = 0xFF;

  const SessionStream* stream = nullptr;
  std::size_t channels = 0;  ///< in the file
  /// The position in the file of each channel of `stream`.
  std::array<std::uint8_t, kMostSessionChannels> places{};
  /// Of samples: the places of the columns of ProbeSample::extra.
  std::vector<std::uint8_t> extra = {};
};

/// Decodes the samples of one XDF chunk, without the stream number, into `chunk`. False if the
/// bytes are not samples of the stream or a value is invalid.
[[nodiscard]] bool decode_items(const StreamLayout& layout, std::string_view content,
                                SessionChunk& chunk);

/// The same for marks, which are strings.
[[nodiscard]] bool decode_marks(std::string_view content, SessionChunk& chunk);

}  // namespace merkel
