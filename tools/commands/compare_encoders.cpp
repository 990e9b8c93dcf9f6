#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "core/units.hpp"
#include "tools/commands/command.hpp"
#include "tools/filled_text.hpp"
#include "tools/json_text.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/studies/encoders/encoder_comparison.hpp"
#include "tools/studies/report/csv_table.hpp"
#include "tools/studies/report/report.hpp"

namespace merkel {
namespace {

struct CompareEncodersCommand {
  std::string touch;
  std::string scene;
  std::vector<std::string> encoders;
  std::string folder;  ///< of a report; empty: none
  bool overwrite = false;
  bool json = false;
};

/// The probes of the scene play a recording, or what a URI names.
Expected<Scene, SetupError> scene_with_touch(const CompareEncodersCommand& command) {
  auto scene = scene_named(command.scene);
  if (!scene) return scene;
  if (scene->encoding.electrodes.empty()) {
    return bad_input(
        "the scene has no electrodes: add [[electrode]] and [stimulation] to it (merkel scene "
        "--keys explains them)");
  }
  const bool is_uri = command.touch.starts_with("sim:") || command.touch.starts_with("replay:");
  std::vector<std::string> uris(scene->probes.size(), command.touch);
  for (std::size_t i = 0; i < uris.size() && !is_uri; ++i) {
    uris[i] = "replay:" + command.touch + (uris.size() > 1 ? "?probe=" + std::to_string(i) : "");
  }
  if (auto set = scene->set_probes(uris); !set) return Unexpected<SetupError>(set.error());
  return scene;
}

Expected<std::vector<EncodedTouch>, SetupError> encode_all(const CompareEncodersCommand& command) {
  const auto scene = scene_with_touch(command);
  if (!scene) return Unexpected<SetupError>(scene.error());
  std::vector<EncodedTouch> touches;
  for (const std::string& encoder : command.encoders) {
    auto touch = encode_touch(*scene, encoder);
    if (!touch) return Unexpected<SetupError>(touch.error());
    touches.push_back(std::move(*touch));
  }
  return touches;
}

Json json_of(const std::vector<EncodedTouch>& touches) {
  const auto number = [](double value) { return std::isnan(value) ? Json(nullptr) : Json(value); };
  Json all = Json::array();
  for (const EncodedTouch& touch : touches) {
    const EncoderFigures figures = figures_of(touch);
    all.push_back({{"encoder", figures.encoder},
                   {"charge_uC", figures.charge_uC},
                   {"peak_uA", figures.peak_uA},
                   {"peak_total_uA", figures.peak_total_uA},
                   {"onset_ratio", number(figures.onset_ratio)},
                   {"rate_correlation", number(figures.rate_correlation)}});
  }
  return all;
}

std::string table_of(const std::vector<EncodedTouch>& touches) {
  return filled_text("encoders", json_of(touches));
}

/// Writes the touch and the charge of each encoder over time.
void write_tables(const std::vector<EncodedTouch>& touches, ReportTables& tables) {
  constexpr std::chrono::milliseconds kBin{10};
  CsvTable& touch = tables.at("touch.csv");
  const std::chrono::nanoseconds start = touches.front().ticks.front().time - touches.front().tick;
  for (const TickRecord& tick : touches.front().ticks) {
    touch.row({units::s_from(tick.time - start), static_cast<double>(tick.probe),
               tick.press.contact.depth_mm, units::N_from_mN(tick.press.contact.force_mN)});
  }
  CsvTable& charge = tables.at("encoders.csv");
  for (const EncodedTouch& each : touches) {
    const std::vector<double> rate = charge_rate(each, kBin);
    for (std::size_t k = 0; k < rate.size(); ++k) {
      charge.row({each.encoder}, {static_cast<double>(k) * units::s_from(kBin), rate[k]});
    }
  }
}

int compare_encoders(const CompareEncodersCommand& command) {
  if (command.encoders.empty()) {
    std::string list;
    for (const std::string& name : encoder_names()) list += " --encoder " + name;
    return refuse("name the encoders to compare, for example" + list);
  }
  const auto touches = encode_all(command);
  if (!touches) return refuse(touches.error());
  if (command.folder.empty()) {
    std::fputs((command.json ? json_text(json_of(*touches)) : table_of(*touches)).c_str(), stdout);
    return kDone;
  }
  const ReportPart part{"encoders",
                        {{"touch.csv", "time_s,probe,depth_mm,force_N"},
                         {"encoders.csv", "encoder,time_s,charge_uC_per_s"}},
                        [&](const ReportFolder& /*folder*/, ReportTables& tables) {
                          write_tables(*touches, tables);
                          return table_of(*touches) + "\n![Charge over time](encoders.png)\n";
                        }};
  return make_report(
      {.folder = command.folder, .overwrite = command.overwrite},
      "# Encoders side by side\n\nThe touch of " + command.touch + " on " + command.scene + ".\n\n",
      {&part, 1}, "encoders");
}

}  // namespace

void add_compare_encoders_command(CommandLine& program) {
  auto command = std::make_shared<CompareEncodersCommand>();
  program
      .subcommand(
          "compare-encoders",
          "Encodes one touch with several encoders, each for all electrodes and groups of a scene, "
          "within the scene's limits: charge, peak current, onset ratio (charge per second in the "
          "first 100 ms of a touch over that from 200 ms on) and correlation with the rate of the "
          "afferents in bins of 50 ms. Research software; makes no claim about safety or percepts.",
          "compare-encoders session.xdf scene.toml --encoder linear_amplitude --encoder biomimetic "
          "--out encoders")
      .option("touch", command->touch, "Session (.xdf), trace (.csv), or a URI replay: or sim:")
      .required()
      .option("scene", command->scene, "Scene file with [[electrode]] and [stimulation]")
      .required()
      .list("--encoder", command->encoders, "Encoder, as in the key encoder; repeatable")
      .option("--out", command->folder, "Folder for a report with tables (CSV) and a picture")
      .flag("--overwrite", command->overwrite, "Replace existing files")
      .flag("--json", command->json, "Print the figures as JSON")
      .runs([command] { return compare_encoders(*command); });
}

}  // namespace merkel
