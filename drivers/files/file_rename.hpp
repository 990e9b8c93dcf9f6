#pragma once

#include <string>

namespace merkel {

/// Whether a name is taken: by a file, a folder or a link, which may lead nowhere.
[[nodiscard]] bool file_exists(const std::string& path);

/// Renames a file; never replaces an existing one.
/// \return 0, EEXIST if `to` exists, or another errno
[[nodiscard]] int rename_without_replacing(const std::string& from, const std::string& to);

/// Renames a file, over an existing one only if `replace`. \return 0 or an errno
[[nodiscard]] int rename_to(const std::string& from, const std::string& to, bool replace);

/// Syncs a file to the disk. \return 0 or an errno
[[nodiscard]] int sync_file(int descriptor);
[[nodiscard]] int sync_file(const std::string& path);

/// Syncs a directory to the disk, so that a rename survives a power cut.
/// \param path  of a file in the directory
/// \return 0 or an errno
[[nodiscard]] int sync_directory_of(const std::string& path);

}  // namespace merkel
