#pragma once

#include <string>

namespace merkel {

/// Renames a file and never replaces one.
/// \return 0, EEXIST where `to` exists, or another errno
[[nodiscard]] int rename_without_replacing(const std::string& from, const std::string& to);

/// Forces a directory's entries to the disk: after a rename, a power cut leaves one of both names.
/// \param path  of a file in it
/// \return 0 or an errno
[[nodiscard]] int sync_directory_of(const std::string& path);

}  // namespace merkel
