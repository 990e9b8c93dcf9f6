#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/contact/indenter.hpp"
#include "core/expected.hpp"
#include "realtime/input/contact_decision.hpp"

namespace merkel {

class PressTrace;

/// A press of an afferent, and the measured part of its response.
struct Stimulus {
  Indenter indenter;           ///< tip and control
  double level = 0.0;          ///< of the hold: depth, mm, or force, mN, depending on the control
  double ramp_s = 0.05;        ///< from touch to the hold
  double offset_mm = 0.0;      ///< from the receptive field's centre to the tip's axis
  bool offset_across = false;  ///< across the finger instead of along it
  double amplitude_mm = 0.0;   ///< of a sine on top of the hold, from zero to its peak
  double frequency_hz = 0.0;
  double settle_s = 0.0;  ///< from touch to the start of the sine and of the count
  double count_s = 1.0;   ///< duration of the count
  /// If set, the response is the fraction by which the rate falls between the `count_s` that begin
  /// at `decline_from_s` of the hold and the last `count_s` before this time of the hold.
  std::optional<double> decline_over_s;
  double decline_from_s = 0.0;

  /// A recorded press that replaces ramp, hold and sine; null: none.
  std::shared_ptr<const PressTrace> trace;
  double afferent_x_mm = 15.0;  ///< of the receptive field's centre, in the trace's coordinates
  double afferent_y_mm = 10.0;

  [[nodiscard]] double end_s() const noexcept {
    return decline_over_s ? ramp_s + *decline_over_s : settle_s + count_s;
  }
};

/// Flat round pins on a hexagonal lattice that fill a disc, and are lowered together into the
/// finger before some of them are raised above the others: the probe array of Vega-Bermudez &
/// Johnson (1999).
struct PinArray {
  std::size_t pins = 73;
  double diameter_mm = 0.5;
  double spacing_mm = 0.89;
  double background_mm = 1.6;  ///< depth of all pins

  static constexpr std::size_t kMaxPins = 400;
  friend bool operator==(const PinArray&, const PinArray&) = default;
};

/// Published measurements that differ in one variable.
struct DataSet {
  struct Point {
    double x = 0.0;
    double measured = 0.0;
    Stimulus stimulus;
  };
  std::string name;     ///< for example "curvature × force, 0.098 N"
  std::string section;  ///< section of the file, for example "curvature_force"
  std::string x_name;   ///< the variable, with its unit
  std::string y_name;   ///< "rate_hz" or "decline"
  std::string cite;
  std::vector<Point> points = {};
  bool fit = true;  ///< false: an independent check, ignored by `merkel fit`
};

/// Recorded presses of one afferent with their spikes.
struct RecordedTrials {
  std::string name;  ///< for example "curvature × force, 0.098 N"
  std::string cite;
  std::string trace_file;
  std::string spikes_file;  ///< empty if the data file holds the spikes
  Stimulus stimulus;
  std::shared_ptr<const PressTrace> trace;    ///< set by loading
  std::vector<std::vector<double>> spikes_s;  ///< by trial, since the first sample; set by loading
  double frequency_hz = 0.0;                  ///< of a vibration, for phase locking
  double cost_per_s = 100.0;                  ///< cost of moving a spike, Victor & Purpura
  double tau_s = 0.01;                        ///< time constant, van Rossum
  double bin_s = 0.02;                        ///< of the PSTH
  bool fit = true;                            ///< as DataSet::fit
};

/// The content of a data file.
struct Recordings {
  std::vector<DataSet> sets;
  /// Areas of the receptive field by the depth of a fine pin.
  struct FieldAreas {
    PinArray array;  ///< around the pin; of one pin: bare skin
    struct Point {
      double depth_mm = 0.0;  ///< below the array
      double area_mm2 = 0.0;
    };
    std::vector<Point> points = {};
  };
  std::vector<FieldAreas> field_areas;
  /// Impulses when several pins of an array are pressed deeper, relative to the middle one alone.
  struct Surround {
    PinArray array;
    double depth_mm = 0.0;  ///< below the array
    struct Point {
      std::size_t pins = 0;
      double rate_ratio = 0.0;
    };
    std::vector<Point> points = {};
  };
  std::vector<Surround> surrounds;
  std::optional<double> most_trial_sd;  ///< impulses
  std::vector<double> time_constants_ms;
  /// Regularity of firing: intervals at a steady rate.
  struct Intervals {
    double mean_ms = 0.0;
    double sd_ms = 0.0;
  };
  std::vector<Intervals> intervals;
  std::vector<RecordedTrials> trials;
};

/// Reads a data file (format in tools/README.md). Fails with the field and the remedy.
/// \param contact  of its traces (PressTrace)
[[nodiscard]] Expected<Recordings, SetupError> read_recordings(
    const std::string& path, const ContactDecision::Parameters& contact);
/// The same from its text; `name` stands for the file in messages.
[[nodiscard]] Expected<Recordings, SetupError> parse_recordings(const std::string& text,
                                                                const std::string& name);
/// The recordings that are built into the program.
[[nodiscard]] Recordings published_recordings();
/// The recordings of a file; of an empty path, the published ones.
[[nodiscard]] Expected<Recordings, SetupError> recordings_named(
    const std::string& path, const ContactDecision::Parameters& contact);

}  // namespace merkel
