#pragma once

#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "drivers/sessions/session_chunk.hpp"
#include "drivers/sessions/session_format.hpp"
#include "drivers/sessions/session_items.hpp"
#include "drivers/spike_sink.hpp"

namespace pugi {
class xml_node;
}

namespace merkel {

/// Reads a recorded session, chunk by chunk, in bounded memory.
///
/// A session that broke off is read up to its last whole chunk. Whatever the file's bytes are,
/// every item handed out has a valid state and kind and finite, plausible values, but for the extra
/// columns of samples, which may be any number; anything else is an error that names the place.
/// Streams that are not merkel's are skipped.
class SessionReader {
 public:
  [[nodiscard]] static Expected<SessionReader, SetupError> open(const std::string& path);

  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  /// A fact of the recording (scene text, seeds, machine) by name; empty if absent.
  [[nodiscard]] std::string fact(std::string_view name) const;
  /// All facts, names and values, in order.
  [[nodiscard]] const std::vector<std::pair<std::string, std::string>>& facts() const noexcept {
    return facts_;
  }
  /// Names of ProbeSample::extra of the samples, in order.
  [[nodiscard]] const std::vector<std::string>& extra_columns() const noexcept {
    return extra_columns_;
  }
  /// Whether the samples have ProbeSample::valid_for; those of older versions do not.
  [[nodiscard]] bool has_validity() const noexcept { return has_validity_; }
  /// All of that name, in order.
  [[nodiscard]] std::vector<std::string> facts(std::string_view name) const;

  /// Reads the next chunk that holds items. False at the end.
  [[nodiscard]] Expected<bool, SetupError> next(SessionChunk& chunk);

  /// True if the recording was closed properly; valid after next() returned false.
  [[nodiscard]] bool complete() const noexcept { return footers_ > 0 && !truncated_; }

 private:
  struct Close {
    void operator()(std::FILE* file) const { static_cast<void>(std::fclose(file)); }
  };
  struct Raw {
    XdfTag tag = XdfTag::kBoundary;
    std::string content;
  };

  SessionReader(std::string path, std::unique_ptr<std::FILE, Close> file, std::uint64_t size)
      : path_(std::move(path)), file_(std::move(file)), size_(size) {}
  Expected<void, SetupError> read_headers();
  Expected<void, SetupError> add_stream(std::uint32_t id, const pugi::xml_node& info);
  Expected<bool, SetupError> read_raw(Raw& raw);
  Expected<void, SetupError> decode(std::string_view content, SessionChunk& chunk) const;
  [[nodiscard]] bool read_bytes(void* bytes, std::size_t count);
  [[nodiscard]] Unexpected<SetupError> damaged(const std::string& what) const;

  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t size_;
  std::uint64_t place_ = 0;        ///< bytes read so far
  std::uint64_t chunk_start_ = 0;  ///< of the chunk read last
  std::vector<std::pair<std::string, std::string>> facts_;
  std::map<std::uint32_t, StreamLayout> layouts_;  ///< keyed by the stream's number in the file
  Raw raw_;
  bool raw_pending_ = false;  ///< raw_ was read ahead, by read_headers()
  bool truncated_ = false;
  std::optional<std::uint32_t> mark_stream_;
  bool has_validity_ = false;
  std::vector<std::string> extra_columns_;
  int footers_ = 0;
};

/// The start of the first tick of a recorded run, in the run's own time; if samples were recorded
/// without a simulation, the time of the first one. Reads the file from its beginning, whatever
/// `session` has read.
[[nodiscard]] Expected<std::chrono::nanoseconds, SetupError> session_start(
    const SessionReader& session);

/// The origin of a recorded run: a fact of the session; in older sessions, session_start().
[[nodiscard]] Expected<RunOrigin, SetupError> session_origin(const SessionReader& session);

}  // namespace merkel
