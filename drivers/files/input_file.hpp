#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// The files that a command has read. As long as it exists, no OutputFile replaces one of them, by
/// whatever name or link. The program has one for its command; a program that uses the libraries
/// makes one around its set-up and run. Thread: any.
class ReadFiles {
 public:
  ReadFiles();
  ReadFiles(const ReadFiles&) = delete;
  ReadFiles& operator=(const ReadFiles&) = delete;
  ~ReadFiles();

  /// Ends the set-up: files that are read later are not noted, those noted so far stay protected.
  void complete();

  /// Notes a file in each object whose set-up lasts. Every reader of files calls it.
  static void note(const std::string& path);
  /// Fails if the regular file or folder `path` was read: writing it would destroy the input.
  [[nodiscard]] static Expected<void, SetupError> check_not_read(const std::string& path);

 private:
  struct Name {
    std::string given;
    std::string resolved;  ///< absolute, without links
  };
  std::vector<Name> names_;
  bool complete_ = false;
};

/// Reads a whole file, which it notes in ReadFiles. A pipe or device is read up to its end. Fails
/// with "cannot read the WHAT PATH: …" if it is a folder, unreadable, or larger than `most_bytes`.
[[nodiscard]] Expected<std::string, SetupError> read_whole_file(const std::string& path,
                                                                const std::string& what,
                                                                std::size_t most_bytes);

}  // namespace merkel
