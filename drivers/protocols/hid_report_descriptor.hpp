#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "core/expected.hpp"
#include "drivers/protocols/hid_field_map.hpp"

namespace merkel {

/// The fields of a HID report descriptor that have a physical meaning. A field with a unit of force
/// is a force; of length, a position (usages X, Y, Z) or else the depth; of time, the device's
/// clock. A force of the sensor page without a unit is in N. The first field of each kind counts,
/// from the wanted report or else from the first one that measures anything. Safe for any bytes.
/// \return the map or an error
/// USB-IF, Device Class Definition for HID 1.11, 6.2.2; HID Usage Tables 1.4, 4 and 16
[[nodiscard]] Expected<HidFieldMap, std::string> map_report_descriptor(
    std::span<const std::uint8_t> descriptor, std::optional<std::uint8_t> wanted_report = {});

}  // namespace merkel
