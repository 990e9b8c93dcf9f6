#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"
#include "drivers/probe.hpp"
#include "drivers/probes/channel_selection.hpp"

namespace merkel {

/// Opens the probe of a URI: replay:FILE, sim:SHAPE, serial:DEVICE?protocol=NAME, hid:VID:PID,
/// usb:VID:PID, udp:HOST:PORT, tcp:HOST:PORT, fused:URI|URI. With the option live=1, a recording
/// plays like a device: in real time, losing samples that are not read. What follows '#' chooses
/// channels of the device (channel_selection.hpp). Real-time: no.
/// \param allow_remote  a port at which datagrams are received may be open to other machines
[[nodiscard]] Expected<std::unique_ptr<Probe>, SetupError> open_probe(std::string_view uri,
                                                                      bool allow_remote = false);

/// Opens a device once for several probes: one output for each. Real-time: no.
[[nodiscard]] Expected<std::unique_ptr<Probe>, SetupError> open_device(const DeviceUri& device);

/// The ProbeSample::Channel bits of a device's first probe, as far as its URI states them: by its
/// selection, protocol, columns or fields. 0: only the device knows. Real-time: no.
[[nodiscard]] std::uint32_t stated_channels(const DeviceUri& device);

}  // namespace merkel
