#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/protocols/hid_field_map.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// The field map of a URI's options. `fields` lists CHANNEL_UNIT:OFFSET:BITS:SIGN:SCALE, separated
/// by commas: the offset of the first bit after the report ID, 1 to 32 bits, s or u, and the value
/// of one count, as in `force_N:0:16:s:0.001,depth_um:16:16:u:1`. A channel may have a name of its
/// own, as in `thumb_N`. Further names are `time_us`, `time_ms` (the device's clock, which wraps at
/// its width) and `seq` (a counter). Without `fields`
/// the map is empty, and the report descriptor must give it. `report_id` selects a report (0:
/// reports have no ID).
[[nodiscard]] Expected<HidFieldMap, SetupError> read_hid_fields(UriOptions& options);

/// Decodes HID input reports by a field map; every call of take() is one report.
[[nodiscard]] std::unique_ptr<Protocol> make_hid_fields(HidFieldMap map);

}  // namespace merkel
