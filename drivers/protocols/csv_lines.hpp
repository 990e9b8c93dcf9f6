#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/protocols/simulated_device.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// Lines of numbers, as most sketches for HX711 and the like print them.
/// Options: `columns` names what stands in each column, separated by commas: `time_s`, `time_ms` or
/// `time_us` (the device's clock), `seq` (a counter), a channel with its unit (`force_N`,
/// `force_gF`, `force_z_mN`, `depth_mm`, `depth_um`, `x_mm`, `y_mm`, `z_mm`), or `-` for one to be
/// left out; without it, the device's own header line names them, or labels and units in the lines
/// themselves ("Force: 0.300 N"). `separator` (comma, semicolon, tab, space) and `decimal` (point,
/// comma) are found by themselves. `rate_hz` is its rate, where known; `seq_bits` and `clock_bits`
/// say when those counters wrap (32).
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_csv_lines(UriOptions& options);

/// How many of the lines in a stream are numbers and nothing else, whatever their columns.
[[nodiscard]] std::size_t lines_of_numbers(std::span<const std::uint8_t> bytes);

/// \param channels  ProbeSample::Channel bits of the trace
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_csv_device(std::uint32_t channels);

}  // namespace merkel
