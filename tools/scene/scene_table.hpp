#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/files/toml.hpp"

namespace merkel {

/// Reads the keys of one table of a scene file. Each key that is asked for is known; finish() names
/// one that was not asked for. Only the first thing wrong is kept, as "file:line: …".
class SceneTable {
 public:
  /// Shared by all tables of a file.
  struct Findings {
    std::string file;
    std::string error;
    std::map<std::string, std::uint32_t> line_of;
    void fail(const toml::source_region& where, const std::string& what);
  };

  SceneTable(const toml::table& table, std::string name, Findings& findings)
      : table_(table), name_(std::move(name)), findings_(findings) {}

  /// Each leaves `value` alone where the key is absent.
  SceneTable& number(std::string_view key, double& value);
  SceneTable& numbers(std::string_view key, std::vector<double>& values);
  /// A list of lists of two numbers.
  SceneTable& pairs(std::string_view key, std::vector<std::array<double, 2>>& values);
  SceneTable& whole(std::string_view key, std::int64_t& value);
  SceneTable& whole(std::string_view key, int& value);
  SceneTable& seed(std::string_view key, std::uint64_t& value);
  SceneTable& truth(std::string_view key, bool& value);
  SceneTable& text(std::string_view key, std::string& value);
  /// One of `words`; `value` becomes its index.
  SceneTable& word(std::string_view key, const std::vector<std::string>& words, std::size_t& value);
  /// Notes a key as known that was not asked for.
  SceneTable& known(std::string_view key);
  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }
  /// The key's value, noted as known; null where absent.
  const toml::node* find(std::string_view key);
  /// Refuses a key's value: "table.key <reason>".
  void refuse(std::string_view key, const std::string& reason);
  /// Names a key that is not known.
  void finish();

 private:
  void fail(std::string_view key, const toml::node& node, const std::string& expectation);

  const toml::table& table_;
  std::string name_;
  Findings& findings_;
  std::vector<std::string> known_;
};

}  // namespace merkel
