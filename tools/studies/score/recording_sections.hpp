#pragma once

#include <string>
#include <vector>

#include "tools/studies/score/json_fields.hpp"
#include "tools/studies/score/recordings.hpp"

namespace merkel {

/// Readers of the sections of a data file; tools/README.md describes their fields. Each appends to
/// `recordings` and throws JsonFault for a wrong field.

void read_curvature_force(JsonFields fields, const std::string& cite, Recordings& recordings);
void read_lateral_offset(JsonFields fields, const std::string& cite, Recordings& recordings);
void read_bar_profile(JsonFields fields, const std::string& cite, Recordings& recordings);
void read_vibration(JsonFields fields, const std::string& cite, Recordings& recordings);
void read_hold_adaptation(JsonFields fields, const std::string& cite, Recordings& recordings);

void read_field_area(JsonFields fields, Recordings& recordings);
void read_surround(JsonFields fields, Recordings& recordings);
void read_kinetics(JsonFields fields, Recordings& recordings);
void read_intervals(JsonFields fields, Recordings& recordings);
void read_trials(JsonFields fields, const std::string& cite, Recordings& recordings);

/// Reads bars, given by widths and gaps or by the positions of their edges along x. Returns the
/// position of the row's centre on that axis: 0 for widths and gaps.
double read_bars(JsonFields& fields, Indenter& indenter);

/// Reads one number per x. \param field  for messages.  \param x_name  the list of x values
[[nodiscard]] std::vector<double> series(const Json& values, const std::string& field,
                                         std::size_t count, const std::string& x_name);

}  // namespace merkel
