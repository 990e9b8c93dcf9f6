#include <algorithm>
#include <cmath>
#include <type_traits>

#include "core/parameters/nearest_name.hpp"
#include "core/scene/model_fields.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {

std::string toml_string(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string result = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      result.append("\\").push_back(c);
    } else if (byte < 0x20 || byte == 0x7F) {
      result.append("\\u00").push_back(kDigits[byte >> 4U]);
      result.push_back(kDigits[byte & 15U]);
    } else {
      result.push_back(c);
    }
  }
  return result + "\"";
}

namespace {

/// A value as text for a scene file; empty for an optional that is not set.
struct TextOf {
  const BoundField& key;

  std::string operator()(double value) const {
    return std::isnan(value) ? "nan" : readable_decimal(value + 0.0);  // no −0
  }
  std::string operator()(int value) const { return std::to_string(value); }
  std::string operator()(std::int64_t value) const { return std::to_string(value); }
  std::string operator()(std::uint64_t value) const { return std::to_string(value); }
  std::string operator()(bool value) const { return value ? "true" : "false"; }
  std::string operator()(const std::string& value) const { return toml_string(value); }
  std::string operator()(std::chrono::nanoseconds value) const {
    return readable_decimal(static_cast<double>(value.count()) /
                            nanoseconds_of_unit(key.field->unit));
  }
  std::string operator()(const Position& value) const {
    return "[" + (*this)(value.x_mm) + ", " + (*this)(value.y_mm) + "]";
  }
  template <class T>
  std::string operator()(const std::vector<T>& values) const {
    return "[" + listed(values, *this) + "]";
  }
  template <class T>
  std::string operator()(const std::optional<T>& value) const {
    return value ? (*this)(*value) : std::string();
  }
  std::string of_choice(const Choice& choice) const {
    const auto index = choice.get(choice.value);
    if (!index || *index >= key.words.size() || key.words[*index].empty()) return {};
    return toml_string(key.words[*index]);
  }
};

std::string text_of(const BoundField& key) {
  if (const auto* const text = std::get_if<std::string*>(&key.value)) {
    if ((*text)->empty() && !key.field->absent.empty()) return {};
  }
  return std::visit(
      [&](const auto& value) {
        if constexpr (std::is_same_v<decltype(value), const Choice&>) {
          return TextOf{key}.of_choice(value);
        } else {
          return TextOf{key}(*value);
        }
      },
      key.value);
}

/// Unit and range as text, for example "mm, > 0 to 1000, or inf".
std::string limits_of(const Field& field) {
  std::string text(field.unit);
  const std::string range = field.range.text();
  return text.append(text.empty() || range.empty() ? "" : ", ").append(range);
}

std::string line_of(const BoundField& key) {
  const Field& field = *key.field;
  const std::string value = text_of(key);
  std::string line =
      value.empty() ? "# " + std::string(field.key) + " =" : std::string(field.key) + " = " + value;
  // Bytes are columns here: no multi-byte character precedes the comment.
  line.resize(std::max<std::size_t>(line.size() + 2, 32), ' ');
  line.append("# ").append(field.meaning);
  if (const std::string limits = limits_of(field); !limits.empty()) line += " (" + limits + ")";
  if (value.empty()) line.append("; if not set: ").append(field.absent);
  return line + "\n";
}

void append_rows(std::string& text, const BoundFields& keys) {
  for (const BoundField& key : keys) {
    const Field& field = *key.field;
    const std::string value = text_of(key);
    text.append("| `").append(field.key).append("` | ");
    text.append(value.empty() ? std::string(field.absent) : "`" + value + "`").append(" | ");
    text.append(field.unit).append(" | ").append(field.range.text()).append(" | ");
    text.append(field.meaning).append(" |\n");
  }
}

constexpr std::string_view kColumns =
    "| key | default | unit | range | meaning |\n|---|---|---|---|---|\n";

}  // namespace

std::string scene_text(const Scene& scene) {
  Scene copy = scene;
  std::string text =
      "# A complete scene: every key with its value, unit, range and meaning. A missing key has\n"
      "# the preset's value.\n\n";
  text += "preset = " + toml_string(scene.preset) + "\n";
  for (const SceneSection& section : sections_of(copy)) {
    text += "\n" + section.heading;
    if (!section.meaning.empty()) text += "  # " + section.meaning;
    text += "\n";
    for (const BoundField& key : section.keys) text += line_of(key);
  }
  for (const std::string& uri : scene.sinks) text += "\n[[sink]]\nuri = " + toml_string(uri) + "\n";
  return text;
}

std::string scene_keys_text() {
  std::string text =
      "# Keys of scene files\n\n"
      "Generated by `merkel scene --keys`. Every key is optional. Defaults are those of the preset "
      "`paper`; the top-level\nkey `preset` selects another:\n\n" +
      preset_list("- `", "`: ") +
      "\n`merkel scene NAME` prints a preset as a complete scene file. `[[device]]`, `[[probe]]`, "
      "`[[skin.layer]]`, `[[receptors]]`, `[[electrode_group]]`, `[[electrode]]` and `[[sink]]`\nmay be repeated; `[[sink]]` has one key, "
      "`uri`.\n";
  Scene scene = *preset_scene("paper");
  scene.encoding.electrodes.push_back({.name = "E1"});
  scene.encoding.groups.emplace_back();
  scene.encoding.stimulator.name = "of this scene";
  scene.model.skin.layers.count = 1;
  scene.devices.push_back({});
  for (const SceneSection& section : sections_of(scene)) {
    const auto heading = [&](std::string_view key, std::string_view kind) {
      text.append("\n## `").append(section.heading).append("`, `").append(key);
      text.append(" = \"").append(kind).append("\"`\n\n").append(kColumns);
    };
    if (section.heading != "[neuron]") {
      text.append("\n## `").append(section.heading).append("`: ").append(section.meaning);
      text.append("\n\n").append(kColumns);
      append_rows(text, section.keys);
      if (section.heading != "[[probe]]") continue;
      Indenter turned;
      text.append("\n## `[[probe]]`, all tips but `sphere`\n\n").append(kColumns);
      append_rows(text, bind_fields(turned));
      for (std::size_t kind = 1; kind < kTipNames.size(); ++kind) {
        Tip tip = default_tip(kind);
        heading("tip", kTipNames[kind]);
        append_rows(text, std::visit([](auto& own) { return bind_fields(own); }, tip));
      }
      continue;
    }
    const BoundFields kind = neuron_kind_fields(scene.model);
    for (std::size_t k = 0; k < kind.front().words.size(); ++k) {
      Scene other = scene;
      set_kind(other.model, static_cast<NeuronKind>(k));
      heading("kind", kind.front().words[k]);
      append_rows(text, neuron_fields(other.model));
    }
  }
  return text;
}

}  // namespace merkel
