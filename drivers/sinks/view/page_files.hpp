#pragma once

#include <span>
#include <string_view>

namespace merkel {

/// A file of the live page, built into the library.
struct PageFile {
  std::string_view name;
  std::string_view content;
};

[[nodiscard]] std::span<const PageFile> page_files() noexcept;

}  // namespace merkel
