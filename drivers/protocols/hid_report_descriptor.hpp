#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "core/expected.hpp"
#include "drivers/protocols/hid_field_map.hpp"

namespace merkel {

/// The fields that a HID report descriptor gives a physical meaning: what has the unit of a force
/// is a force, of a length a position (usages X, Y, Z) or else the depth, of a time the device's
/// clock; the sensor page's force without a unit is in N. The first of each kind counts, of the
/// wanted report or else of the first that measures anything. Takes any bytes. Or a sentence.
/// USB-IF, Device Class Definition for HID 1.11, 6.2.2; HID Usage Tables 1.4, 4 and 16
[[nodiscard]] Expected<HidFieldMap, std::string> map_report_descriptor(
    std::span<const std::uint8_t> descriptor, std::optional<std::uint8_t> wanted_report = {});

}  // namespace merkel
