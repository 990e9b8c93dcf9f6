#include "tools/studies/score/scorecard.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <fmt/core.h>

#include "drivers/files/csv_text.hpp"
#include "tools/studies/report/csv_table.hpp"
#include "tools/studies/score/array_responses.hpp"
#include "tools/studies/score/recorded_trials.hpp"
#include "tools/studies/score/regularity.hpp"
#include "tools/studies/score/score.hpp"
#include "tools/studies/score/trials.hpp"

namespace merkel {
namespace {

std::string cell(double value, int decimals = 2) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, decimals) : "–";
}

std::string in_unit(const DataSet& set, double value) {
  return set.y_name == "decline" ? cell(100.0 * value, 1) + " %" : cell(value) + " Hz";
}

/// Which data sets to show: those that goodwin was fitted to, the others, or a user's own.
enum class Sets { kFitted, kNotFitted, kOwn };

bool belongs(const DataSet& set, Sets sets) {
  return sets == Sets::kOwn || fitted_to(set) == (sets == Sets::kFitted);
}

/// Published errors of other models are those on the bundled recordings.
std::string table_of_sets(const std::vector<SetScore>& scores, Sets sets) {
  std::string text;
  std::size_t skipped = 0;
  for (const SetScore& score : scores) {
    if (!belongs(*score.set, sets)) continue;
    const PeerScores peers = peers_of(sets == Sets::kOwn ? "" : score.set->name);
    text += fmt::format("| {} | {} | {} | {} | {} | {} | {} |\n", score.set->name,
                        score.set->points.size() - score.skipped, in_unit(*score.set, score.rmse),
                        cell(score.r2, 3), cell(score.R2, 3), cell(peers.touchsim, 1),
                        cell(peers.ouyang, 1));
    skipped += score.skipped;
  }
  if (text.empty()) return "";
  text = "| data | points | RMSE | r² | R² | TouchSim | Ouyang |\n|---|---|---|---|---|---|---|\n" +
         text + "\n";
  if (skipped > 0) {
    text += fmt::format(
        "Skipped: {} conditions with a flat plate, which would touch all of the flat skin: "
        "set skin.radius_mm to score them.\n\n",
        skipped);
  }
  return text;
}

const char* unit_of_level(const DataSet& holds) { return holds.x_name == "force_N" ? "N" : "mm"; }

std::string declines(const std::vector<SetScore>& scores, Sets sets) {
  std::string text;
  for (const SetScore& score : scores) {
    if (score.set->y_name != "decline" || !belongs(*score.set, sets)) continue;
    for (std::size_t i = 0; i < score.predicted.size(); ++i) {
      text += fmt::format("- {}, {:g} {}: {:.1f} % (recorded {:.0f} %)\n", score.set->name,
                          score.set->points[i].x, unit_of_level(*score.set),
                          100.0 * score.predicted[i], 100.0 * score.set->points[i].measured);
    }
  }
  return text;
}

class Scorecard {
 public:
  Scorecard(const ReportFolder& folder, ReportTables& tables, std::size_t trials,
            std::size_t threads, const TactileModel::Parameters& scene,
            const Recordings& recordings, std::string data)
      : folder_(folder),
        tables_(tables),
        trials_(trials),
        threads_(threads),
        scene_(scene),
        recordings_(recordings),
        data_(std::move(data)) {}

  Expected<std::string, SetupError> make(const Scene& named) {
    const auto scores = score_sets(scene_, recordings_.sets, trials_, folder_.progress, threads_);
    if (!scores) return bad_input(named.sentence(scores.error()));
    const auto part = [&](const std::string& heading, Sets sets) {
      const std::string body = table_of_sets(*scores, sets) + declines(*scores, sets);
      return body.empty() ? body : "## " + heading + "\n\n" + body + "\n";
    };
    std::string text =
        "r² is the squared correlation. R² = 1 − SSE/SST also penalises a wrong gain or "
        "offset.\n\n" +
        (data_.empty()
             ? part("Data to which goodwin was fitted (g, k1 and k3)", Sets::kFitted) +
                   part("Not fitted: an independent check", Sets::kNotFitted)
             : part("Data of " + data_ + " (independent if the scene was not fitted to them)",
                    Sets::kOwn));
    if (!recordings_.trials.empty()) {
      const auto trials = score_trials(scene_, recordings_, trials_, tables_);
      if (!trials) return trials;
      text += "## Recorded presses and their spikes\n\n" + *trials;
    }
    text += "## Other measures, not fitted\n\n";
    write_conditions(*scores);
    write_holds(*scores);
    double largest_sd = 0.0;
    for (const SetScore& score : *scores) {
      if (score.set->section != "curvature_force") continue;
      for (const double sd : score.count_sd) {
        if (std::isfinite(sd)) largest_sd = std::max(largest_sd, sd);
      }
    }
    if (largest_sd > 0.0) {
      text += fmt::format(
          "- trial-to-trial SD of the count, curvature × force: at most {:.2f} impulses{}\n",
          largest_sd, recorded_sd());
    }
    auto arrays = pin_arrays(named);
    if (!arrays) return arrays;
    text += *arrays;
    if (!recordings_.time_constants_ms.empty() && scene_.energy_driven()) {
      text += fmt::format("- time constants of adaptation: {:g} and {:g} ms (recorded",
                          scene_.adaptation.fast_ms, scene_.adaptation.slow_ms);
      for (const double tau : recordings_.time_constants_ms) text += fmt::format(" {:g}", tau);
      text += " ms)\n";
    }
    return scene_.energy_driven() ? text + regularity() : text;
  }

 private:
  /// Receptive fields, and several pins at once.
  Expected<std::string, SetupError> pin_arrays(const Scene& named) const {
    const auto below = [](const PinArray& array) {
      return array.pins > 1 ? fmt::format(" in an array of {} at {:g} mm depth", array.pins,
                                          array.background_mm)
                            : std::string();
    };
    std::string text;
    for (const Recordings::FieldAreas& areas : recordings_.field_areas) {
      const auto found = field_areas(scene_, areas, trials_, threads_);
      if (!found) return bad_input(named.sentence(found.error()));
      for (std::size_t i = 0; i < found->size(); ++i) {
        text += fmt::format(
            "- one pin {:g} mm deep{}: receptive field {:.1f} mm² (recorded {:.1f} mm²), {:.1f} "
            "impulses in its middle\n",
            areas.points[i].depth_mm, below(areas.array), (*found)[i].area_mm2,
            areas.points[i].area_mm2, (*found)[i].response);
      }
    }
    for (const Recordings::Surround& surround : recordings_.surrounds) {
      const auto found = surround_ratios(scene_, surround, trials_, threads_);
      if (!found) return bad_input(named.sentence(found.error()));
      for (std::size_t i = 0; i < found->size(); ++i) {
        text +=
            fmt::format("- {} pins {:g} mm deep{}: {} × the response to one (recorded {:.2f})\n",
                        surround.points[i].pins, surround.depth_mm, below(surround.array),
                        cell((*found)[i]), surround.points[i].rate_ratio);
      }
    }
    return text;
  }

  std::string recorded_sd() const {
    return recordings_.most_trial_sd
               ? fmt::format(" (recorded: below {:g})", *recordings_.most_trial_sd)
               : "";
  }

  void write_conditions(const std::vector<SetScore>& scores) {
    CsvTable& sets = tables_.at("sets.csv");
    CsvTable& table = tables_.at("conditions.csv");
    for (const SetScore& score : scores) {
      const DataSet& set = *score.set;
      sets.row({set.name}, {static_cast<double>(set.points.size() - score.skipped), score.rmse,
                            score.r2, score.R2, fitted_to(set) ? 1.0 : 0.0});
      for (std::size_t i = 0; i < set.points.size(); ++i) {
        if (!std::isfinite(score.predicted[i])) continue;  // skipped
        table.row({set.name, set.section, set.x_name},
                  {set.points[i].x, set.points[i].measured, score.predicted[i], score.count_sd[i]});
      }
    }
  }

  /// Writes rate over time for each hold with a recorded decline.
  void write_holds(const std::vector<SetScore>& scores) {
    CsvTable& table = tables_.at("holds.csv");
    for (const SetScore& score : scores) {
      if (score.set->y_name != "decline") continue;
      for (const DataSet::Point& point : score.set->points) {
        auto model = Trials::create(scene_, point.stimulus, trials_);
        if (!model) continue;  // score_sets has already rejected it
        const auto times = model->run(point.stimulus);
        constexpr double kBin_s = 0.25;
        std::vector<double> bins(static_cast<std::size_t>(point.stimulus.end_s() / kBin_s));
        for (const auto& train : times) {
          for (const double t : train) {
            const auto bin = static_cast<std::size_t>(t / kBin_s);
            if (bin < bins.size()) bins[bin] += 1.0;
          }
        }
        for (std::size_t k = 0; k < bins.size(); ++k) {
          table.row({score.set->name, shortest_decimal(point.x), unit_of_level(*score.set)},
                    {(static_cast<double>(k) + 0.5) * kBin_s - point.stimulus.ramp_s,
                     bins[k] / (kBin_s * static_cast<double>(times.size()))});
        }
      }
    }
  }

  std::string regularity() {
    CsvTable& intervals = tables_.at("intervals.csv");
    CsvTable& curve = tables_.at("rate_by_drive.csv");
    std::string text;
    for (const double rate : {10.0, 20.0, 40.0}) {
      const Regularity found = regularity_at(scene_, rate);
      text +=
          fmt::format("- intervals at {:.1f} Hz: CV {:.3f}; SD of the count in a second {:.2f}\n",
                      found.rate_hz, found.cv, found.count_sd);
      for (const double interval : found.intervals_ms) intervals.row({rate, interval});
    }
    for (const Recordings::Intervals& recorded : recordings_.intervals) {
      const Regularity found = regularity_at(scene_, 1e3 / recorded.mean_ms);
      text += fmt::format("- intervals at {:.1f} Hz: CV {:.3f} ({:.3f} in the data)\n",
                          found.rate_hz, found.cv, recorded.sd_ms / recorded.mean_ms);
    }
    for (const DriveRate& at : rates_by_drive(scene_)) curve.row({at.drive_hz, at.rate_hz});
    return text;
  }

  const ReportFolder& folder_;
  ReportTables& tables_;
  std::size_t trials_;
  std::size_t threads_;
  const TactileModel::Parameters& scene_;
  const Recordings& recordings_;
  std::string data_;  ///< file of the recordings; empty: the bundled ones
};

}  // namespace

TableHeads scorecard_tables(const Scene& scene, const Recordings& recordings) {
  TableHeads heads = {{"sets.csv", "set,points,rmse,r2,R2,fitted"},
                      {"conditions.csv", "set,section,x_name,x,measured,predicted,count_sd"},
                      {"holds.csv", "set,level,unit,time_s,rate_hz"}};
  if (!recordings.trials.empty()) {
    heads.insert(heads.end(), kTrialTables.begin(), kTrialTables.end());
  }
  if (scene.model.energy_driven()) {
    heads.insert(heads.end(), {{"intervals.csv", "rate_hz,interval_ms"},
                               {"rate_by_drive.csv", "drive_hz,rate_hz"}});
  }
  return heads;
}

Expected<std::string, SetupError> scorecard(const Scene& scene, const Recordings& recordings,
                                            const std::string& data, std::size_t trials,
                                            std::size_t threads, const ReportFolder& folder,
                                            ReportTables& tables) {
  return Scorecard(folder, tables, trials, threads, scene.model, recordings, data).make(scene);
}

}  // namespace merkel
