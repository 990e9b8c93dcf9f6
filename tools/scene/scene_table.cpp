#include "tools/scene/scene_table.hpp"

#include <algorithm>
#include <cstddef>

#include "core/parameters/nearest_name.hpp"

namespace merkel {

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

SceneTable& SceneTable::known(std::string_view key) {
  known_.emplace_back(key);
  return *this;
}

void SceneTable::fail(std::string_view key, const toml::node& node,
                      const std::string& expectation) {
  findings_.fail(node.source(),
                 (name_.empty() ? "" : name_ + ".") + std::string(key) + " must be " + expectation);
}

SceneTable& SceneTable::number(std::string_view key, double& value) {
  if (const toml::node* const node = find(key)) {
    if (const auto number = node->value<double>(); node->is_number() && number) {
      value = *number;
    } else {
      fail(key, *node, "a number");
    }
  }
  return *this;
}

SceneTable& SceneTable::numbers(std::string_view key, std::vector<double>& values) {
  const toml::node* const node = find(key);
  if (node == nullptr) return *this;
  const toml::array* const list = node->as_array();
  std::vector<double> read;
  bool numeric = list != nullptr;
  for (std::size_t i = 0; numeric && i < list->size(); ++i) {
    const toml::node& item = *list->get(i);
    numeric = item.is_number();
    if (numeric) read.push_back(*item.value<double>());
  }
  if (numeric) {
    values = std::move(read);
  } else {
    fail(key, *node, "a list of numbers, as in [5, 5, 5]");
  }
  return *this;
}

SceneTable& SceneTable::pairs(std::string_view key, std::vector<std::array<double, 2>>& values) {
  const toml::node* const node = find(key);
  if (node == nullptr) return *this;
  const toml::array* const list = node->as_array();
  bool all = list != nullptr;
  for (std::size_t i = 0; all && i < list->size(); ++i) {
    const toml::array* const pair = list->get(i)->as_array();
    all = pair != nullptr && pair->size() == 2 && pair->get(0)->is_number() &&
          pair->get(1)->is_number();
    if (all) values.push_back({*pair->get(0)->value<double>(), *pair->get(1)->value<double>()});
  }
  if (!all) fail(key, *node, "a list of pairs of numbers, as in [[15, 10], [16, 10]]");
  return *this;
}

SceneTable& SceneTable::whole(std::string_view key, std::int64_t& value) {
  if (const toml::node* const node = find(key)) {
    if (const auto number = node->value_exact<std::int64_t>()) {
      value = *number;
    } else {
      fail(key, *node, "a whole number");
    }
  }
  return *this;
}

SceneTable& SceneTable::whole(std::string_view key, int& value) {
  std::int64_t wide = value;
  whole(key, wide);
  if (wide < INT32_MIN || wide > INT32_MAX) {
    fail(key, *table_.get(key), "a whole number of ordinary size");
  } else {
    value = static_cast<int>(wide);
  }
  return *this;
}

SceneTable& SceneTable::seed(std::string_view key, std::uint64_t& value) {
  if (const toml::node* const node = find(key)) {
    const auto number = node->value_exact<std::int64_t>();
    if (number && *number >= 0) {
      value = static_cast<std::uint64_t>(*number);
    } else {
      fail(key, *node, "a whole number, zero or more");
    }
  }
  return *this;
}

SceneTable& SceneTable::truth(std::string_view key, bool& value) {
  if (const toml::node* const node = find(key)) {
    if (const auto truth = node->value_exact<bool>()) {
      value = *truth;
    } else {
      fail(key, *node, "true or false");
    }
  }
  return *this;
}

SceneTable& SceneTable::text(std::string_view key, std::string& value) {
  if (const toml::node* const node = find(key)) {
    if (const auto text = node->value_exact<std::string>()) {
      value = *text;
    } else {
      fail(key, *node, "a text in quotes");
    }
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
    const std::string nearest = nearest_name(key.str(), known_);
    std::string list;
    for (const std::string& known : known_) list.append(list.empty() ? "" : ", ").append(known);
    const std::string kind = node.is_table() || node.is_array_of_tables() ? "table" : "key";
    const std::string full =
        name_.empty() ? std::string(key.str()) : name_ + "." + std::string(key.str());
    findings_.fail(key.source(), "the " + kind + " " + full + " is not known" +
                                     (nearest.empty() ? "; known here are: " + list
                                                      : ": did you mean " + nearest + "?"));
  }
}

}  // namespace merkel
