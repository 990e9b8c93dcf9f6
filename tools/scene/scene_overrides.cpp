#include "tools/scene/scene_overrides.hpp"

#include <algorithm>
#include <map>
#include <string_view>
#include <utility>
#include <variant>

#include "core/parameters/nearest_name.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/scene/scene_table.hpp"

namespace merkel {
namespace {

/// An error message without its "NAME:LINE: " prefix, because the user wrote no file.
std::string without_place(const std::string& sentence, const std::string& name) {
  if (!sentence.starts_with(name + ":")) return sentence;
  const auto place = sentence.find(": ");
  return place == std::string::npos ? sentence : sentence.substr(place + 2);
}

/// True for values that a scene file writes in quotes.
bool is_text(const BoundField& key) {
  return std::holds_alternative<Choice>(key.value) ||
         std::holds_alternative<std::string*>(key.value);
}

/// Whether a value is a text as a scene file writes it, as messages quote keys.
bool is_quoted(const std::string& value) {
  return value.size() > 1 && value.front() == value.back() &&
         (value.front() == '"' || value.front() == '\'');
}

/// A table with one key and its value; a text if it is nothing else in a scene file.
toml::table table_with(const BoundField& key, const std::string& value) {
  toml::table table;
  const bool literal = is_text(key) ? is_quoted(value) : value.find('#') == std::string::npos;
  if (literal && value.find_first_of("\r\n") == std::string::npos) {
    if (auto parsed = parse_toml("value = " + value); parsed && parsed->size() == 1) {
      parsed->get("value")->visit(
          [&](auto& node) { table.insert(key.field->key, std::move(node)); });
      return table;
    }
  }
  table.insert(key.field->key, value);
  return table;
}

Expected<void, SetupError> set_value(const std::string& name, const BoundField& key,
                                     const std::string& value) {
  const toml::table table = table_with(key, value);
  SceneTable::Findings findings;
  SceneTable(table, "value", findings).read({key});
  if (!findings.error.empty()) {
    // Without its place, ":0: value.radius_mm".
    std::string reason = findings.error.substr(findings.error.find(" must be "));
    if (!reason.ends_with('?')) reason += ", but is " + (value.empty() ? "empty" : value);
    return bad_input(name + reason);
  }
  if (const std::string fault = fault_of(key); !fault.empty()) return bad_input(name + " " + fault);
  return {};
}

}  // namespace

std::vector<NamedKey> named_keys(Scene& scene) {
  std::vector<NamedKey> keys;
  std::map<std::string, int> seen;
  for (const SceneSection& section : sections_of(scene)) {
    const std::string table = section.table();
    const int number = seen[table]++;
    const std::string prefix = number == 0 ? table : table + "[" + std::to_string(number) + "]";
    for (const BoundField& key : section.keys) {
      keys.push_back({prefix + "." + std::string(key.field->key), key});
    }
  }
  return keys;
}

Expected<BoundField, SetupError> key_named(Scene& scene, const std::string& given) {
  std::string name = given;
  if (const auto first = name.find("[0]."); first != std::string::npos) name.erase(first, 3);
  std::vector<std::string> names;
  for (const NamedKey& each : named_keys(scene)) {
    if (each.name == name) return each.key;
    names.push_back(each.name);
  }
  return bad_input("the scene has no key " + given +
                   did_you_mean(name, names, ": merkel scene --keys lists the keys of all scenes"));
}

Expected<Scene, SetupError> scene_of_keys(Scene changed, const Scene& before) {
  // A session has the heights of its shapes, but not their files; those of another name are read.
  for (std::size_t i = 0; i < changed.model.indenters.size(); ++i) {
    auto* const shape = std::get_if<ShapeTip>(&changed.model.indenters[i].tip);
    const auto* const known = std::get_if<ShapeTip>(&before.model.indenters[i].tip);
    if (shape != nullptr && (known == nullptr || known->file != shape->file)) shape->map = nullptr;
  }
  // Through its text, so that the scene is what a file of these keys is.
  auto parsed = parse_scene(scene_text(changed), "scene", heights_of(changed));
  if (!parsed) return bad_input(without_place(parsed.error().sentence, "scene"));
  parsed->file = changed.file;
  parsed->line_of.clear();
  return parsed;
}

Expected<SceneOverrides, SetupError> overrides_of(const std::vector<std::string>& texts) {
  SceneOverrides overrides;
  for (const std::string& text : texts) {
    const auto equals = text.find('=');
    if (equals == 0 || equals == std::string::npos) {
      return bad_input(
          "--set " + text +
          " is not KEY=VALUE, such as skin.radius_mm=8: merkel scene --keys lists the keys");
    }
    overrides.emplace_back(text.substr(0, equals), text.substr(equals + 1));
  }
  return overrides;
}

Expected<Scene, SetupError> with_overrides(const Scene& scene, const SceneOverrides& overrides) {
  if (overrides.empty()) return scene;
  Scene changed = scene;
  // Keys that select a tip or a kind of neuron decide which other keys there are.
  SceneOverrides sorted = overrides;
  std::stable_partition(sorted.begin(), sorted.end(), [](const auto& each) {
    return each.first.ends_with(".tip") || each.first.ends_with(".kind");
  });
  for (const auto& [name, value] : sorted) {
    const auto key = key_named(changed, name);
    if (!key) return Unexpected<SetupError>(key.error());
    if (auto set = set_value(name, *key, value); !set) return Unexpected<SetupError>(set.error());
  }
  const auto sets = [&](std::string_view name) {
    return std::any_of(overrides.begin(), overrides.end(),
                       [&](const auto& each) { return each.first == name; });
  };
  if (sets("skin.radius_mm") && !sets("skin.radius_along_mm")) {
    flatten_if_infinite(changed.model.skin);
  }
  return scene_of_keys(std::move(changed), scene);
}

}  // namespace merkel
