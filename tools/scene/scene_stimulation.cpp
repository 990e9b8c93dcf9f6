#include "tools/scene/scene_stimulation.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "drivers/files/embedded_text.hpp"
#include "drivers/files/input_file.hpp"
#include "tools/scene/scene_keys.hpp"

namespace merkel {

extern const std::span<const EmbeddedText> kStimulatorProfiles;  ///< stimulators/*.toml
namespace {

using Findings = SceneTable::Findings;

/// The name of a table for messages: "electrode[E12]".
std::string labelled(const std::string& heading, const toml::table& table,
                     const std::string& fallback) {
  const auto own = table["name"].value<std::string>();
  return heading + "[" + (own && is_electrode_name(*own) ? *own : fallback) + "]";
}

void read_groups(SceneTable& root, Findings& findings, Scene& scene) {
  for_each_table(root, "electrode_group", findings, [&](const toml::table& table) {
    const std::size_t number = scene.encoding.groups.size();
    scene.encoding.groups.emplace_back();
    SceneTable(table, labelled("electrode_group", table, std::to_string(number + 1)), findings)
        .read(group_keys(scene, number))
        .finish();
  });
}

void read_electrodes(SceneTable& root, Findings& findings, Scene& scene) {
  for_each_table(root, "electrode", findings, [&](const toml::table& table) {
    const std::size_t number = scene.encoding.electrodes.size();
    Electrode& electrode = scene.encoding.electrodes.emplace_back();
    electrode.name = "E" + std::to_string(number + 1);
    SceneTable reader(table, labelled("electrode", table, electrode.name), findings);
    if (reader.has("group") && scene.encoding.groups.empty()) {
      reader.refuse("group",
                    "names a group, but the scene has none: add [[electrode_group]] with a name");
    }
    // The group decides which other keys an electrode has.
    BoundFields all = electrode_keys(scene, number);
    reader.read({all.begin(), all.begin() + 2});
    if (scene.encoding.groups.empty()) electrode.group.reset();
    if (electrode.group) {
      const BoundFields own = electrode_keys(scene, number);
      for (const BoundField& key : all) {
        const auto same = [&](const BoundField& other) {
          return other.field->key == key.field->key;
        };
        if (std::none_of(own.begin(), own.end(), same)) {
          reader.refuse(key.field->key, "is that of the group " +
                                            scene.encoding.groups[*electrode.group].pattern.name +
                                            ": set it there, or remove it");
        }
      }
      all = own;
    }
    reader.read({all.begin() + 2, all.end()}).finish();
  });
}

/// Reads the profile of a stimulator: a file of the program by its name, else a file of the user.
void read_profile(SceneTable& table, Findings& findings, Scene& scene) {
  std::string& profile = scene.encoding.stimulation.profile;
  if (profile.empty()) return;
  std::string names;
  std::string text;
  for (const EmbeddedText& each : kStimulatorProfiles) {
    const std::string_view name = each.name.substr(0, each.name.rfind('.'));
    names.append(names.empty() ? "" : ", ").append(name);
    if (name == profile) text = each.text;
  }
  std::string file = profile;
  if (text.empty()) {
    file = beside_scene(findings.file, profile);
    auto read = read_whole_file(file, "profile of a stimulator", kMaxTomlBytes);
    if (!read) {
      table.refuse("profile", "is neither a stimulator that merkel knows (" + names +
                                  ") nor a file that can be read: " + read.error().sentence);
      return;
    }
    text = std::move(*read);
  }
  const auto parsed = parse_toml(text);
  if (!parsed) {
    table.refuse("profile", "is not valid TOML: line " + std::to_string(parsed.error().line) +
                                ": " + parsed.error().reason);
    return;
  }
  Findings own{.file = file};
  SceneTable(*parsed, "", own).read(bind_fields(scene.encoding.stimulator)).finish();
  if (findings.error.empty()) findings.error = own.error;
  if (scene.encoding.stimulator.name.empty()) scene.encoding.stimulator.name = profile;
  profile.clear();  // the scene now holds its values
}

}  // namespace

void read_stimulation(SceneTable& root, Findings& findings, Scene& scene) {
  EncodingParameters& encoding = scene.encoding;
  read_groups(root, findings, scene);
  read_electrodes(root, findings, scene);
  with_table(root, "stimulation", findings, [&](SceneTable table) {
    table.read(bind_fields(encoding.stimulation));
    read_profile(table, findings, scene);
    table.finish();
  });
  with_table(root, "stimulator", findings, [&](SceneTable table) {
    table.read(bind_fields(encoding.stimulator));
    if (encoding.stimulator.name.empty()) encoding.stimulator.name = "of this scene";
    table.finish();
  });
  const auto complete = [&](Electrode& each) {
    if (each.frequency_Hz.empty()) each.frequency_Hz = encoding.stimulation.frequency_Hz;
  };
  for (ElectrodeGroup& group : encoding.groups) complete(group.pattern);
  for (Electrode& each : encoding.electrodes) complete(each);
  encoding.join_groups();
}

}  // namespace merkel
