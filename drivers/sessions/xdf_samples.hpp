#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/sessions/byte_span.hpp"

namespace merkel {

/// The form of the samples of an XDF stream.
struct XdfForm {
  std::uint64_t channels = 0;     ///< 0: unknown
  std::uint64_t value_bytes = 8;  ///< of a channel; 0: texts
};

/// The values of a sample: all bytes as one view or, of texts, a view for each channel.
using XdfRow = std::span<const std::string_view>;

/// Calls take(stamp in seconds, if there is one; XdfRow) for each sample of a chunk.
/// \param content  what follows the number of the stream
/// \return false if the bytes do not have this form, or take() returns false
template <class Take>
[[nodiscard]] bool for_each_xdf_sample(std::string_view content, const XdfForm& form,
                                       const Take& take) {
  ByteSpan bytes(content);
  const bool texts = form.value_bytes == 0;
  const std::uint64_t row_bytes = form.channels * form.value_bytes;
  std::uint64_t count = 0;
  if (!bytes.take_count(count)) return false;
  if (count == 0) return bytes.left() == 0;
  // Each sample has a byte for its stamp, and each text one for its length.
  if (count > bytes.left() / (1 + (texts ? form.channels : row_bytes))) return false;
  std::vector<std::string_view> row(texts ? form.channels : 1);
  for (std::uint64_t i = 0; i < count; ++i) {
    std::optional<double> stamp_s;
    std::uint8_t stamp_bytes = 0;
    if (!bytes.take(stamp_bytes)) return false;
    if (stamp_bytes != 0 && (stamp_bytes != sizeof(double) || !bytes.take(stamp_s.emplace()))) {
      return false;
    }
    for (std::string_view& values : row) {
      std::uint64_t length = row_bytes;
      if ((texts && !bytes.take_count(length)) || !bytes.take_text(length, values)) return false;
    }
    if (!take(stamp_s, XdfRow(row))) return false;
  }
  return bytes.left() == 0;
}

}  // namespace merkel
