#pragma once

#include <string>
#include <vector>

#include "tools/studies/score/json_fields.hpp"
#include "tools/studies/score/recordings.hpp"

namespace merkel {

/// Readers of the sections of a data file; tools/README.md describes their fields. Each appends to
/// `recordings` and throws JsonFault at a field that is wrong.

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

/// Reads bars by their widths and gaps, or by the places of their edges along x. Returns the place
/// of the row's middle on the axis of the positions: 0 for widths and gaps.
double read_bars(JsonFields& fields, Indenter& indenter);

/// A number for each x. \param field  for messages.  \param x_name  what the numbers belong to
[[nodiscard]] std::vector<double> series(const JsonFields::Json& values, const std::string& field,
                                         std::size_t count, const std::string& x_name);

}  // namespace merkel
