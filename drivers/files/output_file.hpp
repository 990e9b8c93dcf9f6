#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "core/expected.hpp"

namespace merkel {

/// The one writer of every output file: durable, and never whole by its name before it is whole.
///
/// Bytes go to NAME.part, locked against other writers and readable up to the last flush whatever
/// happens to the program. close() forces them to the disk and gives the file its name, without
/// replacing a file that has appeared there meanwhile. A NAME.part that no program writes any more
/// is what a killed run has left: it is kept under a name of its own (`recovered_name`).
///
/// A device or pipe that exists already (/dev/stdout, a FIFO) is written directly, and "-" is the
/// standard output.
class OutputFile {
 public:
  /// Gets a sentence for the user when a file of a killed run is recovered.
  using Notice = std::function<void(const std::string&)>;

  /// Buffered bytes are written out after so long at the latest, while there are calls.
  static constexpr std::chrono::milliseconds kFlushAfter{100};

  /// Fails where the file exists (unless `overwrite`), cannot be made, or another program writes
  /// it; for a FIFO, where no program reads it within 10 s.
  [[nodiscard]] static Expected<OutputFile, SetupError> create(const std::string& path,
                                                               bool overwrite,
                                                               const Notice& notice = {});
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  /// Abandons the file unless close() was called: what was written stays in NAME.part, but for a
  /// header without anything behind it.
  ~OutputFile();

  /// Buffers bytes; writes them out when there are many, or the last flush is kFlushAfter ago.
  /// False after an error.
  [[nodiscard]] bool write(std::string_view bytes);
  /// Marks what was written so far as a header, worth nothing by itself.
  void end_header() noexcept { header_bytes_ = written_bytes_ + buffer_.size(); }
  /// Writes all buffered bytes out, or none of them. False after an error.
  [[nodiscard]] bool flush();
  /// Flushes where the last flush is kFlushAfter ago. False after an error.
  [[nodiscard]] bool flush_if_due();
  /// Replaces bytes that are written out already: a header that counts what follows it. Regular
  /// files only. False after an error.
  [[nodiscard]] bool rewrite(std::uint64_t place, std::string_view bytes);
  /// Flushes, forces the bytes to the disk and renames. False after an error.
  [[nodiscard]] bool close();
  /// Removes the file: what it held is kept elsewhere by now.
  void remove() noexcept;
  /// Makes a write that waits for a pipe's reader fail at once. Thread: any.
  void give_up() noexcept { given_up_->store(true, std::memory_order_relaxed); }

  /// Whether every byte given to write() is written out.
  [[nodiscard]] bool settled() const noexcept { return buffer_.empty(); }
  /// "cannot write NAME: No space left on device; …", after a false.
  [[nodiscard]] const std::string& error() const noexcept { return error_; }
  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  /// Where the remains of a killed run are kept now; empty where there were none.
  [[nodiscard]] const std::string& recovered() const noexcept { return recovered_; }
  /// NAME.part while the file is being written; empty for a device or pipe.
  [[nodiscard]] const std::string& part() const noexcept { return part_; }

 private:
  OutputFile(std::string path, std::string part, int descriptor, bool overwrite);
  static Expected<OutputFile, SetupError> create_special(const std::string& path);
  bool fail(int error_number, std::string_view remedy);
  bool write_out(std::size_t& done);
  bool wait_for_room();
  bool publish();

  std::string path_;
  std::string part_;  ///< empty where the path is written directly
  int descriptor_;
  bool overwrite_;
  std::string recovered_;
  std::string buffer_;
  std::uint64_t written_bytes_ = 0;
  std::uint64_t header_bytes_ = 0;
  std::chrono::steady_clock::time_point last_flush_ = std::chrono::steady_clock::now();
  std::unique_ptr<std::atomic<bool>> given_up_ = std::make_unique<std::atomic<bool>>(false);
  std::string error_;
};

/// Gives what a killed run has left in NAME.part its name, where the name is free, else the name
/// under which such remains are kept. Does nothing where there is nothing, or a program still
/// writes it. \return the name; empty for nothing
std::string recover_file(const std::string& path, const OutputFile::Notice& notice);

/// The name under which the remains of a killed run are kept: "dir/s.xdf", written last at
/// 2026-01-31 12:00:00 UTC, becomes "dir/s.recovered-20260131T120000.xdf".
/// \param number  above 1, where that name is taken: "dir/s.recovered-20260131T120000-2.xdf"
[[nodiscard]] std::string recovered_name(const std::string& path,
                                         std::chrono::system_clock::time_point last_written,
                                         int number = 1);

}  // namespace merkel
