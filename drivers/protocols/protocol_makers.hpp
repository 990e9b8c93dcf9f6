#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "core/expected.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/protocols/simulated_device.hpp"
#include "drivers/uri.hpp"

namespace merkel {

// The protocols of the table, one source file each, and the devices that speak them to tests and
// demonstrations. `channels` of a device are the ProbeSample::Channel bits of the trace it plays.

/// HBF1, the protocol of the project's firmware (drivers/firmware). The device's HELLO gives units
/// and scales, its latch the times, its sequence numbers the losses, and SYNC requests its clock.
/// Options: `rate_hz` (1 to 20000; default: the firmware's).
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_hbf1(UriOptions& options);
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_hbf1_device(std::uint32_t channels);

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

[[nodiscard]] std::unique_ptr<SimulatedDevice> make_csv_device(std::uint32_t channels);

/// Mark-10 force gauges of series 5 and 7 (GCL2, ASCII, 115200 Bd), streaming with units.
/// Compression is positive. Options: `rate_hz` (2, 5, 10, 25, 50, 125 or 250; default 250), `unit`
/// of readings without one.
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_mark10(UriOptions& options);
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_mark10_device();

/// Mark-10 test stands ESM301 and ESM303 with their gauge, polled: force, and travel, which is the
/// depth if it is zeroed at contact. Option: `rate_hz` (1 to 50; default 25).
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_esm(UriOptions& options);
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_esm_device(std::uint32_t channels);

/// GRBL 1.1 (115200 Bd): a small CNC machine that carries the indenter. The host sends `?`, and the
/// machine reports its position. Work coordinates are patch coordinates: set the work zero (G10
/// L20) with the tip on the skin at the corner of the patch, so that z = −depth. The user moves the
/// machine. Options: `rate_hz` (1 to 100; default 25), `unit` = mm or in if `$13` is not available.
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_grbl(UriOptions& options);
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_grbl_device();

/// OptoForce DAQ with a 3-axis sensor (1 000 000 Bd), streaming 16-byte frames. Options:
/// `counts_per_N` (for all axes, from the sensor's calibration sheet; or `counts_per_N_x`, `_y` and
/// `_z`), `rate_hz` (10 to 1000, a divisor of 1000; default 1000), `filter` (0 to 6; default 4).
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_optoforce(UriOptions& options);

/// A sensor with 1024 counts per N.
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_optoforce_device();

/// Zaber linear stages (ASCII protocol, 115200 Bd), polled for their position. Options:
/// `um_per_step` (length of a microstep, from the stage's data sheet; required), `axis` of the
/// patch (depth, x, y or z; default depth), `address` (1) and `stage_axis` (1) on the chain,
/// `rate_hz` (1 to 200; default 50).
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_zaber(UriOptions& options);

/// A stage with microsteps of 1/1024 mm.
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_zaber_device();

/// ATI Net F/T, raw data transfer over UDP: each datagram is one record of 36 bytes, big-endian:
/// RDT sequence, F/T sequence, status, Fx, Fy, Fz, Tx, Ty, Tz in counts. Compression is positive
/// Fz. Options: `counts_per_N` (default 1000000, the box's usual setting; its web page shows it),
/// `rate_hz` (the box's setting; its sequence numbers then serve as its clock). Torques are
/// ignored.
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_ati_rdt(UriOptions& options);
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_ati_rdt_device(std::uint32_t channels);

inline constexpr std::size_t kAtiRecordBytes = 36;

}  // namespace merkel
