#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/units.hpp"
#include "drivers/clock/clock_pair.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/files/raw_bytes.hpp"
#include "drivers/sessions/session_format.hpp"
#include "drivers/sessions/session_headers.hpp"

namespace merkel {

/// Writes the chunks of an XDF file. All functions return false after an error of the file.
class XdfChunks {
 public:
  using Time = std::chrono::nanoseconds;

  explicit XdfChunks(OutputFile& file) : file_(file) {}

  [[nodiscard]] bool write(XdfTag tag, std::string_view content) {
    std::string head;
    append_raw(head, std::uint8_t{4});
    append_raw(head, static_cast<std::uint32_t>(content.size() + sizeof tag));
    append_raw(head, tag);
    return file_.write(head) && file_.write(content);
  }
  /// Begins a stream.
  [[nodiscard]] bool write_header(std::uint32_t stream, std::string_view header) {
    tallies_[stream] = {};
    return write_of(XdfTag::kStreamHeader, stream, header);
  }
  /// A fixed mark of the format, from which a reader can resume in a damaged file.
  [[nodiscard]] bool write_boundary() {
    constexpr unsigned char kBoundary[] = {0x43, 0xA5, 0x46, 0xDC, 0xCB, 0xF5, 0x41, 0x0F,
                                           0xB3, 0x0E, 0xD5, 0x46, 0x73, 0x83, 0xCB, 0xE4};
    return write(XdfTag::kBoundary, {reinterpret_cast<const char*>(kBoundary), sizeof kBoundary});
  }
  /// All streams share one clock, so every offset is 0. Readers complain if these chunks are
  /// missing, and pyxdf if two of a stream have the same time.
  [[nodiscard]] bool write_clock_offsets() {
    for (const auto& [stream, tally] : tallies_) {
      if (std::exchange(offset_times_[stream], newest()) == newest()) continue;
      std::string content;
      append_raw(content, units::s_from(newest()));
      append_raw(content, 0.0);
      if (!write_of(XdfTag::kClockOffset, stream, content)) return false;
    }
    return true;
  }
  [[nodiscard]] bool write_footers() {
    // A stream without samples must not set the file's start to the clock's origin.
    const double start_s = units::s_from(start_.value_or(Time{0}));
    for (const auto& [stream, all] : tallies_) {
      StreamTally tally = all;
      if (tally.samples == 0) tally.first_s = tally.last_s = start_s;
      if (!write_of(XdfTag::kStreamFooter, stream, stream_footer(tally))) return false;
    }
    return true;
  }

  /// Begins a sample; its values follow. \param stamped  else readers count on by the nominal rate
  void begin_sample(std::uint32_t stream, Time time, bool stamped) {
    const double stamp_s = units::s_from(time);
    StreamTally& all = tallies_[stream];
    if (all.samples++ == 0) all.first_s = stamp_s;
    all.last_s = stamp_s;
    if (!start_) start_ = newest_ = time;
    newest_ = std::max(newest_, time);
    ++samples_;
    append(static_cast<std::uint8_t>(stamped ? sizeof stamp_s : 0));
    if (stamped) append(stamp_s);
  }
  template <class Value>
  void append(Value value) {
    append_raw(content_, value);
  }
  void append_text(std::string_view text) {
    append(std::uint8_t{4});
    append(static_cast<std::uint32_t>(text.size()));
    content_ += text;
  }
  /// The samples since the last end_samples().
  [[nodiscard]] std::uint32_t samples() const noexcept { return samples_; }
  /// Writes them as a chunk, if there are any.
  [[nodiscard]] bool end_samples(std::uint32_t stream) {
    if (samples_ == 0) return true;
    std::string head;
    append_raw(head, std::uint8_t{4});
    append_raw(head, samples_);
    const bool written = write_of(XdfTag::kSamples, stream, head.append(content_));
    content_.clear();
    samples_ = 0;
    return written;
  }

  /// The newest time in the file, in probe time; in an empty file, the host's time.
  [[nodiscard]] Time newest() const { return start_ ? newest_ : read_clock_pair().monotonic; }

 private:
  bool write_of(XdfTag tag, std::uint32_t stream, std::string_view content) {
    std::string chunk;
    append_raw(chunk, stream);
    return write(tag, chunk.append(content));
  }

  OutputFile& file_;
  std::string content_;  ///< of samples that are not written yet
  std::uint32_t samples_ = 0;
  std::map<std::uint32_t, StreamTally> tallies_;               ///< of all streams, by number
  std::optional<Time> start_;                                  ///< of the first item
  Time newest_{0};                                             ///< of all items
  std::map<std::uint32_t, std::optional<Time>> offset_times_;  ///< of the last offset, by stream
};

}  // namespace merkel
