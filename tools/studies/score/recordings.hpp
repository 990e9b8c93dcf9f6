#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/contact/indenter.hpp"
#include "core/expected.hpp"

namespace merkel {

/// How an afferent was pressed, and what of its answer was measured.
struct Stimulus {
  Indenter indenter;          ///< tip and control
  double level = 0.0;         ///< of the hold: mm of depth or mN of force, as the control says
  double ramp_s = 0.05;       ///< from touch to the hold
  double offset_mm = 0.0;     ///< of the tip's axis from the receptive field's centre
  double amplitude_mm = 0.0;  ///< of a sine on top of the hold, from zero to its peak
  double frequency_hz = 0.0;
  double settle_s = 0.0;  ///< from touch to the beginning of the sine, and of the count
  double count_s = 1.0;   ///< spikes are counted for so long from there
  /// Where set, the answer is the fraction by which the rate falls from the first `count_s` of the
  /// hold to the last `count_s` before so many seconds of it.
  std::optional<double> decline_over_s;

  [[nodiscard]] double end_s() const noexcept {
    return decline_over_s ? ramp_s + *decline_over_s : settle_s + count_s;
  }
};

/// Measurements that differ in one thing, as published.
struct DataSet {
  struct Point {
    double x = 0.0;
    double measured = 0.0;
    Stimulus stimulus;
  };
  std::string name;     ///< for example "curvature × force, 0.098 N"
  std::string section;  ///< of the file, for example "curvature_force"
  std::string x_name;   ///< what differs, with its unit
  std::string y_name;   ///< "rate_hz" or "decline"
  std::string cite;
  std::vector<Point> points;
};

/// What a data file holds.
struct Recordings {
  std::vector<DataSet> sets;
  /// Area of the receptive field by the depth of a fine pin.
  struct FieldArea {
    double depth_mm = 0.0;
    double area_mm2 = 0.0;
  };
  std::vector<FieldArea> field_areas;
  std::optional<double> most_trial_sd;  ///< impulses
  std::vector<double> time_constants_ms;
  /// Regularity of firing: intervals at a steady rate.
  struct Intervals {
    double mean_ms = 0.0;
    double sd_ms = 0.0;
  };
  std::vector<Intervals> intervals;
};

/// Reads a data file; its form is in tools/README.md. Fails with the field and what to mend.
[[nodiscard]] Expected<Recordings, SetupError> read_recordings(const std::string& path);
/// The same from its text; `name` stands for the file in messages.
[[nodiscard]] Expected<Recordings, SetupError> parse_recordings(const std::string& text,
                                                                const std::string& name);
/// Those that come with the program.
[[nodiscard]] Recordings published_recordings();
/// Those of a file, or where it is empty the published ones.
[[nodiscard]] Expected<Recordings, SetupError> recordings_named(const std::string& path);

}  // namespace merkel
