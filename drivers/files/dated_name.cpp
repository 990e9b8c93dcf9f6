#include "drivers/files/dated_name.hpp"

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "drivers/files/csv_text.hpp"
#include "drivers/files/utc_text.hpp"

namespace merkel {
namespace {

constexpr std::string_view kMark = "%t";
constexpr std::string_view kPart = ".part";

bool is_stamp(std::string_view text) {
  constexpr std::size_t kLength = 15;
  if (text.size() != kLength || text[8] != 'T') return false;
  return std::all_of(text.begin(), text.end(), [](char c) { return is_digit(c) || c == 'T'; });
}

}  // namespace

std::string dated_name(const std::string& pattern, std::chrono::system_clock::time_point now) {
  const auto mark = pattern.find(kMark);
  if (mark == std::string::npos) return pattern;
  return pattern.substr(0, mark) +
         utc_text(std::chrono::system_clock::to_time_t(now), "%Y%m%dT%H%M%S") +
         pattern.substr(mark + kMark.size());
}

std::vector<std::string> unfinished_names(const std::string& pattern) {
  std::vector<std::string> names;
  const auto slash = pattern.rfind('/');
  const std::string folder = slash == std::string::npos ? "" : pattern.substr(0, slash + 1);
  const std::string name = pattern.substr(folder.size());
  const auto mark = name.find(kMark);
  if (mark == std::string::npos) return names;
  const std::string before = name.substr(0, mark);
  const std::string after = name.substr(mark + kMark.size());
  std::error_code error;
  for (const auto& entry :
       std::filesystem::directory_iterator(folder.empty() ? "." : folder, error)) {
    const std::string found = entry.path().filename().string();
    if (!found.ends_with(after + std::string(kPart)) || !found.starts_with(before)) continue;
    if (found.size() < before.size() + after.size() + kPart.size()) continue;
    const std::size_t length = found.size() - before.size() - after.size() - kPart.size();
    if (!is_stamp(std::string_view(found).substr(before.size(), length))) continue;
    names.push_back(folder + found.substr(0, found.size() - kPart.size()));
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace merkel
