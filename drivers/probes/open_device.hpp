#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/probe.hpp"
#include "drivers/probes/channel_selection.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// Opens a device. \param device  the probes that it feeds
using OpenDevice = Expected<std::unique_ptr<Probe>, SetupError>(const Uri& uri,
                                                                const DeviceUri& device);

/// Opens serial:DEVICE?protocol=NAME&baud=RATE&… with the options of the protocol and those of
/// every device (DeviceProbe::settings_from).
OpenDevice open_serial_device;

/// Opens udp:HOST:PORT?protocol=ati_rdt|csv or tcp:HOST:PORT?protocol=csv|hbf1. For csv over udp,
/// the address is one of this machine, and the first sender is the device. Otherwise it is the
/// device's address.
OpenDevice open_network_device;

/// Opens hid:VID:PID?fields=…&serial=…&backend=hidraw|libusb (protocols/hid_fields.hpp).
OpenDevice open_hid_device;

/// Opens usb:VID:PID?protocol=NAME&serial=…&interface=0&in=129&out=1&transfer=bulk|interrupt.
OpenDevice open_usb_device;

/// Opens lsl:NAME?host=HOST&columns=…, a stream of the Lab Streaming Layer: of this machine, unless
/// `host` names another. Its channels are read by their labels and units, or as `columns` names
/// them. Defined only if merkel was built with liblsl (MERKEL_WITH_LSL).
OpenDevice open_lsl_device;

/// Opens comedi:/dev/comedi0?channels=0,1&columns=force_V,position_V&rate_hz=10000&range=-5:5&
/// reference=ground|common|differential|other, the analog inputs of a data-acquisition card.
/// Defined only if merkel was built with comedilib (MERKEL_WITH_COMEDI).
OpenDevice open_comedi_device;

/// Opens redis:HOST:PORT?stream=NAME&fields=…, the entries of a Redis stream (RedisEntries).
/// Defined only if merkel was built with hiredis (MERKEL_WITH_HIREDIS).
OpenDevice open_redis_device;

}  // namespace merkel
