#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// A probe or sink URI: scheme:path?key=value&key=value. The path is used literally (file and
/// device names are not decoded or made canonical); the last '?' starts the options.
struct Uri {
  std::string text;
  std::string scheme;
  std::string path;
  std::map<std::string, std::string, std::less<>> options;

  /// Fails without a scheme, or if an option lacks '=' or its name, or is given twice.
  [[nodiscard]] static Expected<Uri, SetupError> parse(std::string_view text);
};

/// Reads the options of a URI one by one, then reports unknown options.
///
/// \code
///   UriOptions options(uri);
///   const double depth = options.number("depth_mm", 1.5, 0.0, 100.0);
///   if (auto done = options.finish(); !done) return done.error();
/// \endcode
class UriOptions {
 public:
  explicit UriOptions(const Uri& uri) : uri_(uri) {}

  /// A finite number in [low, high].
  double number(std::string_view key, double fallback, double low, double high);
  /// A whole number in [low, high].
  std::int64_t whole(std::string_view key, std::int64_t fallback, std::int64_t low,
                     std::int64_t high);
  std::string text(std::string_view key, std::string_view fallback);
  /// One of several words, separated by '|' in `words`.
  std::string word(std::string_view key, std::string_view fallback, std::string_view words);
  [[nodiscard]] bool given(std::string_view key) const { return uri_.options.contains(key); }
  /// The names of the given options that satisfy a condition.
  template <class Condition>
  [[nodiscard]] std::vector<std::string> keys(const Condition& condition) const {
    std::vector<std::string> names;
    for (const auto& [name, value] : uri_.options) {
      if (condition(name)) names.push_back(name);
    }
    return names;
  }

  /// Returns the first error in the options; also fails on an unknown option.
  [[nodiscard]] Expected<void, SetupError> finish() const;

 private:
  const std::string* find(std::string_view key);
  void fail(std::string_view key, std::string_view expectation);

  const Uri& uri_;
  std::set<std::string, std::less<>> known_;
  std::string error_;
};

}  // namespace merkel
