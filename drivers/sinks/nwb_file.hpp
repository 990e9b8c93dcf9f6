#pragma once

#include <array>
#include <chrono>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "drivers/sample_channels.hpp"
#include "drivers/sessions/afferent_table.hpp"
#include "drivers/sinks/run_journal.hpp"
#include "drivers/sinks/time_base.hpp"

namespace merkel {

/// What NWB and DANDI want to know of an experiment: `experimenter` and `keywords` (lists,
/// separated by ";"), what it is about, the place, and the subject.
inline constexpr std::array<std::string_view, 9> kNwbFacts = {"experiment_description",
                                                              "experimenter",
                                                              "institution",
                                                              "lab",
                                                              "keywords",
                                                              "subject_id",
                                                              "species",
                                                              "sex",
                                                              "age"};

/// The content of an NWB file (Neurodata Without Borders 2.7).
struct NwbContent {
  /// A measured quantity of a probe.
  struct Channel {
    std::string name;         ///< "depth", "force", …
    std::string unit;         ///< NWB's name of it: meters, newtons
    float conversion = 1.0F;  ///< from the values to that unit
    std::string meaning;
    const SampleChannel* press = nullptr;  ///< null: a further column
    std::size_t extra = 0;                 ///< index of that in DeliveredSample::further
  };
  struct Probe {
    std::string name;  ///< for display
    std::vector<Channel> channels;
  };
  struct Electrode {
    std::string name;
    std::string description;  ///< its field and encoder
  };
  std::string scene;  ///< name
  std::string scene_text;
  std::string notes;  ///< the other facts of the run, NAME = VALUE lines
  /// Facts of the experiment, from the sink's options (kNwbFacts): name and value.
  std::vector<std::pair<std::string, std::string>> general;
  std::vector<Probe> probes;
  std::vector<Electrode> electrodes;
  std::vector<AfferentRow> afferents;
  std::vector<std::string> patches;  ///< their names

  std::chrono::nanoseconds tick{0};   ///< of the run
  std::chrono::nanoseconds start{0};  ///< of the run since 1970-01-01 UTC
  std::chrono::nanoseconds zero{0};   ///< time 0 of the file since 1970-01-01 UTC
};

/// Writes a whole NWB file: units with spike times, positions and fields of the afferents; the
/// samples of the probes and the commands of the electrodes as the presented stimulus; contacts,
/// trials (from mark to mark; without marks, the contacts), events and pulses of sync lines as
/// intervals. Each afferent is observed from the begin of the first tick of its run to the end of
/// the last one, and samples of other times are left out. Uses bounded memory. On failure, leaves
/// no file of that name and returns the reason.
[[nodiscard]] Expected<void, std::string> write_nwb(const std::string& path,
                                                    const NwbContent& content, const TimeBase& time,
                                                    RunJournal& journal, bool overwrite);

}  // namespace merkel
