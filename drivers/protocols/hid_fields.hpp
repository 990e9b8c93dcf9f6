#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/protocols/hid_field_map.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// The map of a URI's options. `fields` lists it as CHANNEL_UNIT:OFFSET:BITS:SIGN:SCALE, separated
/// by commas: the first bit after the report number, 1 to 32 bits, s or u, and what one count is in
/// the unit, such as `force_N:0:16:s:0.001,depth_um:16:16:u:1`. Further names are `time_us`,
/// `time_ms` (the device's clock, which wraps at its bits) and `seq` (a counter). Without it there
/// are no fields, and the report descriptor is to be asked. `report_id` (0: reports have no
/// number).
[[nodiscard]] Expected<HidFieldMap, SetupError> read_hid_fields(UriOptions& options);

/// HID input reports, read by a map of their fields; every call of take() is one report.
[[nodiscard]] std::unique_ptr<Protocol> make_hid_fields(HidFieldMap map);

}  // namespace merkel
