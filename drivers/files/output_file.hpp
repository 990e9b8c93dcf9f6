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

/// Writes all output files. A file gets its name only when it is complete.
///
/// Bytes go to NAME.part, which is locked against other writers and readable up to the last flush
/// even after a crash. close() syncs it to the disk and renames it to NAME, but never replaces a
/// file that has appeared there in the meantime. A NAME.part without a writer was left by a killed
/// run; it is renamed (`recovered_name`).
///
/// An existing device or pipe (/dev/stdout, a FIFO) is written directly. "-" is the standard
/// output.
class OutputFile {
 public:
  /// Receives a message for the user when a file of a killed run is recovered.
  using Notice = std::function<void(const std::string&)>;

  /// Longest time in the buffer, provided that calls are made.
  static constexpr std::chrono::milliseconds kFlushAfter{100};

  /// In error(), before the name of the part.
  static constexpr std::string_view kEarlierDataIn = "; earlier data is in ";

  /// Fails if the file was read (ReadFiles), exists (unless `overwrite`), cannot be created, or is
  /// being written by another program; for a FIFO, if no program reads it within 10 s.
  [[nodiscard]] static Expected<OutputFile, SetupError> create(const std::string& path,
                                                               bool overwrite,
                                                               const Notice& notice = {});
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  /// Without close(), the written data stays in NAME.part; a file with only a header is removed.
  ~OutputFile();

  /// Buffers bytes; flushes if the buffer is full or the last flush was kFlushAfter ago.
  /// False after an error.
  [[nodiscard]] bool write(std::string_view bytes);
  /// Marks the bytes so far as a header, which is worthless alone.
  void end_header() noexcept { header_bytes_ = written_bytes_ + buffer_.size(); }
  /// Writes all buffered bytes out, or none of them. False after an error.
  [[nodiscard]] bool flush();
  /// Flushes if the last flush was kFlushAfter ago. False after an error.
  [[nodiscard]] bool flush_if_due();
  /// Replaces bytes that are already in the file, such as a header with a count. Regular files
  /// only. False after an error.
  [[nodiscard]] bool rewrite(std::uint64_t place, std::string_view bytes);
  /// Flushes, syncs to the disk and renames. False after an error.
  [[nodiscard]] bool close();
  /// Removes the file; its data is elsewhere.
  void remove() noexcept;
  /// Makes a write that waits for a pipe's reader fail at once. Thread: any.
  void give_up() noexcept { given_up_->store(true, std::memory_order_relaxed); }

  /// True if the buffer is empty.
  [[nodiscard]] bool settled() const noexcept { return buffer_.empty(); }
  /// The last error: "cannot write NAME: No space left on device; …".
  [[nodiscard]] const std::string& error() const noexcept { return error_; }
  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  /// The new name of a killed run's file; empty if there was none.
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
  std::string part_;  ///< empty if the path is written directly
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

/// Renames the NAME.part of a killed run to NAME if that name is free, else to a recovered name.
/// Does nothing if there is no such file or a program still writes it. \return the new name, or an
/// empty string
std::string recover_file(const std::string& path, const OutputFile::Notice& notice);

/// The new name of a killed run's file: "dir/s.xdf", last written at 2026-01-31 12:00:00 UTC,
/// becomes "dir/s.recovered-20260131T120000.xdf".
/// \param number  above 1 if the name is taken: "dir/s.recovered-20260131T120000-2.xdf"
[[nodiscard]] std::string recovered_name(const std::string& path,
                                         std::chrono::system_clock::time_point last_written,
                                         int number = 1);

/// Gives a file that a failed run left its recovered name; does nothing if there is none.
void set_aside(const std::string& path);

/// True if an output is written directly and cannot be read back: the standard output, a device or
/// a pipe.
[[nodiscard]] bool is_special_output(const std::string& path);

/// Fails if the file was read (ReadFiles), or exists, unless `overwrite`: for work that begins long
/// before OutputFile::create.
[[nodiscard]] Expected<void, SetupError> check_writable(const std::string& path, bool overwrite);

}  // namespace merkel
