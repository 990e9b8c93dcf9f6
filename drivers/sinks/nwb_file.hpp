#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "drivers/sinks/afferent_table.hpp"

namespace merkel {

/// What an NWB file (Neurodata Without Borders 2.7) is made of.
struct NwbContent {
  /// File of rows, each a letter and its fields, times in s of the file:
  /// `s,TIME,NEURON` a spike; `p,TIME,PROBE,VALUE…` a sample, with a value for each of `channels`;
  /// `m,TIME,LABEL` a mark; `e,TIME,LENGTH,SUBJECT,KIND` an event. Lines with '#' are comments.
  std::string rows;
  /// One of the measured quantities of a probe.
  struct Channel {
    std::string name;         ///< "depth", "force", …
    std::string unit;         ///< of NWB: metres, newtons
    float conversion = 1.0F;  ///< from the values to that unit
    std::string meaning;
  };
  struct OfProbe {
    std::string name;  ///< for people
    std::vector<Channel> channels;
  };
  std::vector<OfProbe> probes;
  std::vector<AfferentRow> afferents;
  std::string description;  ///< of the run, a sentence
  std::string scene;        ///< name
  std::string scene_text;
  std::string notes;                  ///< everything else that was noted, NAME = VALUE lines
  std::chrono::nanoseconds start{0};  ///< of the run since 1970-01-01 UTC
  std::chrono::nanoseconds zero{0};   ///< the instant of time 0 of the file, likewise
};

/// Writes a whole NWB file: units with spike times, positions and fields of the afferents; what the
/// probes measured as the presented stimulus; contacts, trials (from mark to mark; without marks
/// the contacts) and events as intervals. Bounded memory. On failure nothing of that name is left,
/// and a sentence says why.
[[nodiscard]] Expected<void, std::string> write_nwb(const std::string& path,
                                                    const NwbContent& content, bool overwrite);

}  // namespace merkel
