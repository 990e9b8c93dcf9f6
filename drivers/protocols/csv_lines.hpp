#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/protocols/simulated_device.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// Lines of numbers, as printed by most sketches for the HX711 and similar converters.
/// Options: `columns` names the columns, separated by commas: `time_s`, `time_ms` or `time_us` (the
/// device's clock), `seq` (a counter), a channel with its unit (`force_N`, `force_gF`,
/// `force_z_mN`, `depth_mm`, `depth_um`, `x_mm`, `y_mm`, `z_mm`), a name of its own with the unit
/// of a force or a length (`thumb_N`), or `-` to ignore a column; `t:time_s` is what the device
/// calls t. Without this option the names come from the device's header line, from labels in the
/// lines ("Force: 0.300 N", "thumb_N=0.2 palm_N=0.1"), or from the names in lines of JSON
/// ({"t":0.001,"thumb_N":0.2}). A header that comes later, and names in each line, are obeyed
/// (RowNames). `frame_lines` is the number of lines that are one reading (FrameLines).
/// `separator` (comma, semicolon, tab, space) and `decimal` (point, comma) are detected by default.
/// `rate_hz` is the nominal rate, if known. `seq_bits` and `clock_bits` give the width of the
/// counters, which wrap (32).
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_csv_lines(UriOptions& options);

/// The number of lines in a stream that consist only of numbers.
[[nodiscard]] std::size_t lines_of_numbers(std::span<const std::uint8_t> bytes);

/// \param channels  ProbeSample::Channel bits of the trace
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_csv_device(std::uint32_t channels);

}  // namespace merkel
