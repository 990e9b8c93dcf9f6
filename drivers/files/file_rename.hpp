#pragma once

#include <string>

namespace merkel {

/// Renames a file; never replaces an existing one.
/// \return 0, EEXIST if `to` exists, or another errno
[[nodiscard]] int rename_without_replacing(const std::string& from, const std::string& to);

/// Syncs a directory to the disk, so that a rename survives a power cut.
/// \param path  of a file in the directory
/// \return 0 or an errno
[[nodiscard]] int sync_directory_of(const std::string& path);

}  // namespace merkel
