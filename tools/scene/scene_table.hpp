#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/parameters/field.hpp"
#include "drivers/files/toml.hpp"

namespace merkel {

/// Reads the keys of one table of a scene file. finish() reports keys that were not read as
/// unknown. Only the first error is kept, as "file:line: …".
class SceneTable {
 public:
  /// Shared by all tables of a file.
  struct Findings {
    std::string file;
    std::string error = {};
    std::map<std::string, std::uint32_t> line_of = {};
    void fail(const toml::source_region& where, const std::string& what);
  };

  SceneTable(const toml::table& table, std::string name, Findings& findings)
      : table_(table), name_(std::move(name)), findings_(findings) {}

  /// Reads the keys that the table has; other values stay unchanged. Does not check ranges.
  SceneTable& read(const BoundFields& keys);
  SceneTable& text(std::string_view key, std::string& value);
  /// Reads one of `words` and sets `value` to its index.
  SceneTable& word(std::string_view key, const std::vector<std::string>& words, std::size_t& value);
  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }
  /// The key's value; null if absent. Marks the key as known.
  const toml::node* find(std::string_view key);
  /// Refuses a key's value: "table.key <reason>".
  void refuse(std::string_view key, const std::string& reason);
  /// Reports an unknown key.
  void finish();

 private:
  void fail(std::string_view key, const toml::node& node, const std::string& expectation);

  const toml::table& table_;
  std::string name_;
  Findings& findings_;
  std::vector<std::string> known_;
};

/// Calls `read` for the table `key`, or for each table of the array `key`.
template <class Read>
void for_each_table(SceneTable& root, std::string_view key, SceneTable::Findings& findings,
                    Read read) {
  const toml::node* const node = root.find(key);
  if (node == nullptr) return;
  if (const toml::table* const one = node->as_table()) {
    read(*one);
  } else if (const toml::array* const several = node->as_array();
             several != nullptr && several->is_array_of_tables()) {
    for (const toml::node& each : *several) read(*each.as_table());
  } else {
    findings.fail(node->source(), std::string(key) + " must be a table: write [" +
                                      std::string(key) + "], or [[" + std::string(key) +
                                      "]] once for each of them");
  }
}

/// Calls `read` for the table `key`, if there is one.
template <class Read>
void with_table(SceneTable& root, std::string_view key, SceneTable::Findings& findings, Read read) {
  const toml::node* const node = root.find(key);
  if (node == nullptr) return;
  if (const toml::table* const table = node->as_table()) {
    read(SceneTable(*table, std::string(key), findings));
  } else {
    findings.fail(node->source(),
                  std::string(key) + " must be a table: write [" + std::string(key) + "]");
  }
}

/// A file that a scene names: beside the scene's file, or else as it is.
[[nodiscard]] std::string beside_scene(const std::string& scene_file, const std::string& name);

}  // namespace merkel
