#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"
#include "drivers/probe.hpp"
#include "drivers/probes/probe_channels.hpp"

namespace merkel {

/// Opens the probe of a URI: replay:FILE, sim:SHAPE, serial:DEVICE?protocol=NAME, hid:VID:PID,
/// usb:VID:PID, udp:HOST:PORT, tcp:HOST:PORT, fused:URI|URI. With the option live=1, a recording
/// plays like a device: in real time, losing samples that are not read. What follows '#' chooses
/// channels of the device (probe_channels.hpp). Real-time: no.
[[nodiscard]] Expected<std::unique_ptr<Probe>, SetupError> open_probe(std::string_view uri);

/// Opens a device once for several probes: one output for each. Real-time: no.
[[nodiscard]] Expected<std::unique_ptr<Probe>, SetupError> open_device(const DeviceUri& device);

/// The files that the probe of a URI reads: recordings and calibrations, of the members of a fused
/// probe too.
[[nodiscard]] std::vector<std::string> files_of_probe(std::string_view uri);

}  // namespace merkel
