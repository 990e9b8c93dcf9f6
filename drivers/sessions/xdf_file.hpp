#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "core/expected.hpp"
#include "drivers/clock/clock_line.hpp"
#include "drivers/sessions/session_format.hpp"
#include "drivers/sessions/xdf_samples.hpp"

namespace merkel {

/// A chunk of an XDF file, without its length.
struct XdfChunk {
  XdfTag tag = XdfTag::kBoundary;
  std::string content;
};

/// Reads the chunks of an XDF file.
class XdfFile {
 public:
  /// The longest chunk of a session.
  static constexpr std::uint64_t kMaxSessionChunk = std::uint64_t{16} << 20U;

  /// \param max_chunk  bytes; longer chunks are skipped, so that the memory is bounded
  [[nodiscard]] static Expected<XdfFile, SetupError> open(
      const std::string& path, std::uint64_t max_chunk = kMaxSessionChunk);

  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  /// Reads the next chunk. False at the end.
  [[nodiscard]] Expected<bool, SetupError> next(XdfChunk& chunk);
  /// True if the file ended within a chunk: its writer was stopped there.
  [[nodiscard]] bool truncated() const noexcept { return truncated_; }
  /// Goes back to the first chunk.
  void rewind();
  /// The error that the chunk read last is damaged.
  [[nodiscard]] Unexpected<SetupError> damaged(const std::string& what) const;

 private:
  struct Close {
    void operator()(std::FILE* file) const { static_cast<void>(std::fclose(file)); }
  };

  XdfFile(std::string path, std::unique_ptr<std::FILE, Close> file, std::uint64_t size,
          std::uint64_t max_chunk)
      : path_(std::move(path)), file_(std::move(file)), size_(size), max_chunk_(max_chunk) {}
  [[nodiscard]] bool read_bytes(void* bytes, std::size_t count);

  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t size_;
  std::uint64_t max_chunk_;
  std::uint64_t place_ = 0;        ///< bytes read so far
  std::uint64_t chunk_start_ = 0;  ///< of the chunk read last
  bool truncated_ = false;
};

/// A stream of an XDF file, of whichever program.
struct XdfStream {
  std::string header;  ///< XML
  std::string name;
  std::string format;  ///< "float32", …
  XdfForm form;
  double period_s = 0.0;  ///< from a sample to one without a stamp
  double stamp_s = 0.0;   ///< of the last sample, on the stream's clock
  ClockOffsets offsets;

  /// Calls take(XdfRow) for each sample of a chunk, whose stamp is stamp_s.
  /// \return false if the bytes do not have the stream's form
  template <class Take>
  [[nodiscard]] bool for_each_sample(std::string_view content, const Take& take) {
    return for_each_xdf_sample(content, form, [&](std::optional<double> stamp, XdfRow row) {
      stamp_s = stamp.value_or(stamp_s + period_s);
      take(row);
      return true;
    });
  }
};

/// Reads the streams of a file by their numbers, from its first chunk to its end. A file that ends
/// within a chunk is read up to there.
/// \param take  takes each sample of the streams whose form is known
[[nodiscard]] Expected<std::map<std::uint32_t, XdfStream>, SetupError> read_xdf_streams(
    XdfFile& file,
    const std::function<void(std::uint32_t number, const XdfStream& stream, XdfRow row)>& take);

}  // namespace merkel
