#include "tools/studies/score/recorded_trials.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <fmt/core.h>

#include "drivers/files/csv_text.hpp"
#include "drivers/files/line_reader.hpp"
#include "tools/studies/report/csv_table.hpp"
#include "tools/studies/report/spike_distance.hpp"
#include "tools/studies/score/press_trace.hpp"
#include "tools/studies/score/trials.hpp"

namespace merkel {
namespace {

using Trains = std::vector<std::vector<double>>;

/// Reads rows of time_s and the number of the trial or neuron.
Expected<Trains, SetupError> read_spikes(const std::string& path) {
  std::map<long, std::vector<double>> trains;
  bool of_neurons = false;
  const auto read = read_rows(path, [&](std::string_view row) -> const char* {
    of_neurons = of_neurons || row == "time_s,neuron";
    if (row == "time_s,trial" || row == "time_s,neuron") return nullptr;
    const auto time_s = parse_number(take_field(row));
    const auto trial = parse_number(take_field(row));
    if (!time_s || !trial || !std::isfinite(*time_s) || !(std::fabs(*trial) < 1e9) ||
        *trial != std::floor(*trial)) {
      return "each row must be a time in s and a trial number, as in 1.234,1";
    }
    trains[static_cast<long>(*trial)].push_back(*time_s);
    return nullptr;
  });
  if (!read) return Unexpected<SetupError>(read.error());
  Trains all;
  for (auto& [trial, train] : trains) {
    const long next = trains.begin()->first + static_cast<long>(all.size());
    if (trial != next && !of_neurons) {
      return bad_input(fmt::format(
          "{} has spikes of the trials {} and {}, but none of trial {}: if it had no spikes, write "
          "all trials as spike_times_s, with [] for it; if it was left out, number the others "
          "without a gap",
          path, next - 1, trial, next));
    }
    all.push_back(std::move(train));
  }
  if (all.empty()) return bad_input(path + " holds no spikes");
  return all;
}

/// Refuses spikes of which none is within the press: their times have another zero.
Expected<void, SetupError> check_times(const RecordedTrials& set, const std::string& trace) {
  const double begin_s = set.trace->begin_s();
  const double end_s = begin_s + set.trace->duration_s();
  double first_s = std::numeric_limits<double>::infinity();
  double last_s = -first_s;
  for (const auto& train : set.spikes_s) {
    for (const double time_s : train) {
      if (time_s >= begin_s && time_s <= end_s) return {};
      first_s = std::min(first_s, time_s);
      last_s = std::max(last_s, time_s);
    }
  }
  if (first_s > last_s) return {};
  return bad_input(fmt::format(
      "{}: its spikes are from {:.6g} to {:.6g} s, and none is within its trace {}, from {:.6g} to "
      "{:.6g} s: count both from the same zero (that of a session is its start)",
      set.name, first_s, last_s, trace, begin_s, end_s));
}

double rate_in(const Trains& trains, double begin, double end) {
  double count = 0.0;
  for (const auto& train : trains) {
    count += static_cast<double>(
        std::count_if(train.begin(), train.end(), [=](double t) { return t >= begin && t < end; }));
  }
  return count / (end - begin) / static_cast<double>(trains.size());
}

std::vector<double> within(const std::vector<double>& train, double begin, double end) {
  std::vector<double> part;
  std::copy_if(train.begin(), train.end(), std::back_inserter(part),
               [=](double t) { return t >= begin && t < end; });
  return part;
}

/// The mean over all pairs of trains, one from each side; of a side with itself, over different
/// trains.
template <class Distance>
double mean_distance(const Trains& a, const Trains& b, Distance distance) {
  double sum = 0.0;
  double pairs = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      if (&a == &b && i == j) continue;
      sum += distance(a[i], b[j]);
      pairs += 1.0;
    }
  }
  return pairs > 0.0 ? sum / pairs : std::numeric_limits<double>::quiet_NaN();
}

std::string number(double value, int decimals) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, decimals) : "–";
}

/// The distances of the model from the recorded trials, and of these from each other: the
/// yardstick.
std::string distances(const RecordedTrials& set, const Trains& model, CsvTable& table) {
  std::string text =
      "| spike distance | model to recorded | recorded to recorded |\n|---|---|---|\n";
  const auto add = [&](const std::string& name, auto distance) {
    const double of_model = mean_distance(model, set.spikes_s, distance);
    const double of_recorded = mean_distance(set.spikes_s, set.spikes_s, distance);
    text += "| " + name + " | " + number(of_model, 2) + " | " + number(of_recorded, 2) + " |\n";
    table.row({set.name, name}, {of_model, of_recorded});
  };
  using Train = std::vector<double>;
  add(fmt::format("Victor–Purpura, cost {:g}/s", set.cost_per_s),
      [&](const Train& a, const Train& b) {
        return victor_purpura_distance(a, b, set.cost_per_s);
      });
  add(fmt::format("van Rossum, τ {:g} ms", 1e3 * set.tau_s),
      [&](const Train& a, const Train& b) { return van_rossum_distance(a, b, set.tau_s); });
  return text + "\n";
}

std::string phase_table(const RecordedTrials& set, const Trains& model) {
  std::string text = "| phase | from s | to s | recorded Hz | model Hz |\n|---|---|---|---|---|\n";
  for (const PressTrace::Phase& phase : set.trace->phases()) {
    text += fmt::format("| {} | {:.3f} | {:.3f} | {:.2f} | {:.2f} |\n", phase.name, phase.begin_s,
                        phase.end_s, rate_in(set.spikes_s, phase.begin_s, phase.end_s),
                        rate_in(model, phase.begin_s, phase.end_s));
  }
  return text + "\n";
}

std::string locking(const RecordedTrials& set, const Trains& model) {
  if (!(set.frequency_hz > 0.0)) return "";
  double begin = 0.0;
  double end = set.trace->duration_s();
  for (const PressTrace::Phase& phase : set.trace->phases()) {
    if (phase.name == "ramp") begin = phase.end_s;
    if (phase.name == "release") end = phase.begin_s;
  }
  const auto strength = [&](const Trains& trains) {
    std::vector<double> all;
    for (const auto& train : trains) {
      const auto part = within(train, begin, end);
      all.insert(all.end(), part.begin(), part.end());
    }
    return vector_strength(all, set.frequency_hz);
  };
  return fmt::format("- phase locking at {:g} Hz (vector strength): recorded {}, model {}\n",
                     set.frequency_hz, number(strength(set.spikes_s), 3),
                     number(strength(model), 3));
}

/// R² of the simulated PSTH against the recorded one. Writes both as a table.
double write_psth(const RecordedTrials& set, const Trains& model, CsvTable& table) {
  std::vector<double> recorded;
  std::vector<double> simulated;
  for (double begin = 0.0; begin < set.trace->duration_s(); begin += set.bin_s) {
    recorded.push_back(rate_in(set.spikes_s, begin, begin + set.bin_s));
    simulated.push_back(rate_in(model, begin, begin + set.bin_s));
    table.row({set.name}, {begin + 0.5 * set.bin_s, recorded.back(), simulated.back()});
  }
  double squares = 0.0;
  double total = 0.0;
  double mean = 0.0;
  for (const double rate : recorded) mean += rate / static_cast<double>(recorded.size());
  for (std::size_t i = 0; i < recorded.size(); ++i) {
    squares += (recorded[i] - simulated[i]) * (recorded[i] - simulated[i]);
    total += (recorded[i] - mean) * (recorded[i] - mean);
  }
  return total > 0.0 ? 1.0 - squares / total : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

Expected<void, SetupError> load_trials(Recordings& recordings, const std::string& folder,
                                       const ContactDecision::Parameters& contact) {
  const auto resolved = [&](const std::string& path) {
    return path.starts_with("/") || folder.empty() ? path : folder + "/" + path;
  };
  for (RecordedTrials& set : recordings.trials) {
    auto trace = PressTrace::read(resolved(set.trace_file), contact);
    if (!trace) return Unexpected<SetupError>(trace.error());
    set.trace = std::make_shared<PressTrace>(std::move(*trace));
    set.stimulus.trace = set.trace;
    set.stimulus.indenter.control = set.trace->control();
    if (!set.spikes_file.empty()) {
      auto spikes = read_spikes(resolved(set.spikes_file));
      if (!spikes) return Unexpected<SetupError>(spikes.error());
      set.spikes_s = std::move(*spikes);
    }
    if (auto checked = check_times(set, resolved(set.trace_file)); !checked) return checked;
    for (auto& train : set.spikes_s) {
      for (double& time : train) time -= set.trace->begin_s();
      std::sort(train.begin(), train.end());
    }
    DataSet rates{.name = set.name,
                  .section = "trials",
                  .x_name = "phase_begin_s",
                  .y_name = "rate_hz",
                  .cite = set.cite,
                  .fit = set.fit};
    for (const PressTrace::Phase& phase : set.trace->phases()) {
      Stimulus stimulus = set.stimulus;
      stimulus.settle_s = phase.begin_s;
      stimulus.count_s = phase.end_s - phase.begin_s;
      rates.points.push_back({.x = phase.begin_s,
                              .measured = rate_in(set.spikes_s, phase.begin_s, phase.end_s),
                              .stimulus = stimulus});
    }
    if (rates.points.empty()) {
      return bad_input(resolved(set.trace_file) + " has no contact to compare");
    }
    recordings.sets.push_back(std::move(rates));
  }
  return {};
}

Expected<std::string, SetupError> score_trials(const TactileModel::Parameters& scene,
                                               const Recordings& recordings,
                                               std::size_t repetitions, ReportTables& tables) {
  CsvTable& spikes = tables.at("trials.csv");
  CsvTable& psth = tables.at("psth.csv");
  CsvTable& press = tables.at("press.csv");
  CsvTable& apart = tables.at("distances.csv");
  std::string text;
  for (const RecordedTrials& set : recordings.trials) {
    Stimulus whole = set.stimulus;
    whole.settle_s = 0.0;
    whole.count_s = set.trace->duration_s();
    auto trials = Trials::create(scene, whole, repetitions);
    if (!trials) return bad_input(trials.error().key + " " + trials.error().reason);
    const Trains model = trials->run(whole);
    const auto add = [&](const char* source, const Trains& trains) {
      for (std::size_t k = 0; k < trains.size(); ++k) {
        for (const double time : trains[k]) {
          spikes.row({set.name, source}, {static_cast<double>(k + 1), time});
        }
      }
    };
    add("recorded", set.spikes_s);
    add("model", model);
    const bool force = set.trace->control() == Indenter::Control::kForce;
    for (double t = 0.0; t <= set.trace->duration_s(); t += 0.005) {
      press.row({set.name, force ? "N" : "mm"}, {t, (force ? 1e-3 : 1.0) * set.trace->at(t).level});
    }
    const double r2 = write_psth(set, model, psth);
    text += fmt::format("### {}: {} recorded trials, {} of the model\n\n", set.name,
                        set.spikes_s.size(), model.size());
    text += phase_table(set, model) + distances(set, model, apart) + locking(set, model);
    text += fmt::format("- PSTH in bins of {:g} ms: R² = {}\n\n", 1e3 * set.bin_s, number(r2, 3));
  }
  return text;
}

}  // namespace merkel
