#include "tools/scene/scene_table.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <system_error>
#include <type_traits>
#include <utility>

#include "core/parameters/nearest_name.hpp"

namespace merkel {
namespace {

// Each function reads a value of its type; on failure it leaves the value unchanged and returns
// what the node must be.

std::string_view read_value(const toml::node& node, const Field& /*field*/, double& value) {
  if (!node.is_number()) return "a number";
  value = *node.value<double>();
  return {};
}

std::string_view read_value(const toml::node& node, const Field& /*field*/, std::int64_t& value) {
  const auto number = node.value_exact<std::int64_t>();
  if (!number) return "a whole number";
  value = *number;
  return {};
}

std::string_view read_value(const toml::node& node, const Field& /*field*/, int& value) {
  const auto number = node.value_exact<std::int64_t>();
  if (!number) return "a whole number";
  if (*number < INT32_MIN || *number > INT32_MAX) return "a whole number within ±2147483647";
  value = static_cast<int>(*number);
  return {};
}

std::string_view read_value(const toml::node& node, const Field& /*field*/, std::uint64_t& value) {
  const auto number = node.value_exact<std::int64_t>();
  if (!number || *number < 0) return "a whole number, zero or more";
  value = static_cast<std::uint64_t>(*number);
  return {};
}

std::string_view read_value(const toml::node& node, const Field& /*field*/, bool& value) {
  const auto truth = node.value_exact<bool>();
  if (!truth) return "true or false";
  value = *truth;
  return {};
}

std::string_view read_value(const toml::node& node, const Field& field, std::string& value) {
  const auto number = node.value_exact<std::int64_t>();
  if (field.unit == kNameOrNumber && number && *number > 0) {
    value = std::to_string(*number);
    return {};
  }
  const auto text = node.value_exact<std::string>();
  if (!text) return "a text in quotes";
  value = *text;
  return {};
}

/// Whole nanoseconds, so that steps divide ticks exactly. NaN becomes 0 and an overflow the longest
/// time; the range check refuses both.
std::string_view read_value(const toml::node& node, const Field& field,
                            std::chrono::nanoseconds& value) {
  if (!node.is_number()) return "a number";
  const double ns = *node.value<double>() * nanoseconds_of_unit(field.unit);
  constexpr double kMax = 9e18;
  value = std::chrono::nanoseconds{std::isnan(ns) ? 0 : std::llround(std::clamp(ns, -kMax, kMax))};
  return {};
}

std::string_view read_value(const toml::node& node, const Field& /*field*/, Position& value) {
  const toml::array* const pair = node.as_array();
  if (pair == nullptr || pair->size() != 2 || !pair->get(0)->is_number() ||
      !pair->get(1)->is_number()) {
    return "two numbers: [x, y]";
  }
  value = {.x_mm = *pair->get(0)->value<double>(), .y_mm = *pair->get(1)->value<double>()};
  return {};
}

template <class T>
std::string_view read_value(const toml::node& node, const Field& field, std::vector<T>& values) {
  constexpr std::string_view kExpected =
      std::is_same_v<T, double> ? "a list of numbers, as in [5, 10]"
                                : "a list of pairs of numbers, as in [[15, 10], [16, 10]]";
  const toml::array* const list = node.as_array();
  if (list == nullptr) return kExpected;
  std::vector<T> read(list->size());
  for (std::size_t i = 0; i < list->size(); ++i) {
    if (!read_value(*list->get(i), field, read[i]).empty()) return kExpected;
  }
  values = std::move(read);
  return {};
}

template <class T>
std::string_view read_value(const toml::node& node, const Field& field, std::optional<T>& value) {
  T read{};
  const std::string_view expected = read_value(node, field, read);
  if (expected.empty()) value = read;
  return expected;
}

}  // namespace

void SceneTable::Findings::fail(const toml::source_region& where, const std::string& what) {
  if (error.empty()) error = file + ":" + std::to_string(where.begin.line) + ": " + what;
}

const toml::node* SceneTable::find(std::string_view key) {
  known_.emplace_back(key);
  const toml::node* const node = table_.get(key);
  if (node != nullptr) {
    const std::string full = name_.empty() ? std::string(key) : name_ + "." + std::string(key);
    findings_.line_of.emplace(full, node->source().begin.line);
  }
  return node;
}

void SceneTable::fail(std::string_view key, const toml::node& node,
                      const std::string& expectation) {
  findings_.fail(node.source(),
                 (name_.empty() ? "" : name_ + ".") + std::string(key) + " must be " + expectation);
}

SceneTable& SceneTable::read(const BoundFields& keys) {
  for (const BoundField& key : keys) {
    if (const auto* const choice = std::get_if<Choice>(&key.value)) {
      if (!has(key.field->key)) {
        known_.emplace_back(key.field->key);
        continue;
      }
      std::size_t index = choice->get(choice->value).value_or(0);
      word(key.field->key, key.words, index);
      choice->set(choice->value, index);
      continue;
    }
    const toml::node* const node = find(key.field->key);
    if (node == nullptr) continue;
    const std::string_view expected = std::visit(
        [&](const auto& value) -> std::string_view {
          if constexpr (std::is_same_v<decltype(value), const Choice&>) {
            return {};
          } else {
            return read_value(*node, *key.field, *value);
          }
        },
        key.value);
    if (!expected.empty()) fail(key.field->key, *node, std::string(expected));
  }
  return *this;
}

SceneTable& SceneTable::text(std::string_view key, std::string& value) {
  if (const toml::node* const node = find(key)) {
    const auto expected = read_value(*node, {}, value);
    if (!expected.empty()) fail(key, *node, std::string(expected));
  }
  return *this;
}

SceneTable& SceneTable::word(std::string_view key, const std::vector<std::string>& words,
                             std::size_t& value) {
  if (const toml::node* const node = find(key)) {
    const auto text = node->value_exact<std::string>();
    const auto found = text ? std::find(words.begin(), words.end(), *text) : words.end();
    if (found == words.end()) {
      std::string list;
      for (const std::string& word : words) {
        list.append(list.empty() ? "\"" : ", \"").append(word).append("\"");
      }
      const std::string nearest = text ? nearest_name(*text, words) : "";
      fail(key, *node,
           "one of " + list + (nearest.empty() ? "" : "; did you mean \"" + nearest + "\"?"));
    } else {
      value = static_cast<std::size_t>(found - words.begin());
    }
  }
  return *this;
}

void SceneTable::refuse(std::string_view key, const std::string& reason) {
  if (const toml::node* const node = find(key)) {
    findings_.fail(node->source(),
                   (name_.empty() ? "" : name_ + ".") + std::string(key) + " " + reason);
  }
}

void SceneTable::finish() {
  for (const auto& [key, node] : table_) {
    if (std::find(known_.begin(), known_.end(), key.str()) != known_.end()) continue;
    const std::string kind = node.is_table() || node.is_array_of_tables() ? "table" : "key";
    const std::string full =
        name_.empty() ? std::string(key.str()) : name_ + "." + std::string(key.str());
    findings_.fail(key.source(),
                   "the " + kind + " " + full + " is unknown" +
                       did_you_mean(key.str(), known_, "; the known ones are: " + listed(known_)));
  }
}

std::string beside_scene(const std::string& scene_file, const std::string& name) {
  std::error_code ignored;
  const std::string beside = (std::filesystem::path(scene_file).parent_path() / name).string();
  return std::filesystem::exists(beside, ignored) ? beside : name;
}

}  // namespace merkel
