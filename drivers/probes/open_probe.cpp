#include "drivers/probes/open_probe.hpp"

#include "drivers/probes/fused_probe.hpp"
#include "drivers/probes/open_device.hpp"
#include "drivers/probes/replay_probe.hpp"
#include "drivers/probes/sim_probe.hpp"
#include "drivers/uri.hpp"

namespace merkel {

Expected<std::unique_ptr<Probe>, SetupError> open_probe(std::string_view text) {
  if (text.starts_with("fused:")) return FusedProbe::open(text);
  const auto uri = Uri::parse(text);
  if (!uri) return Unexpected<SetupError>(uri.error());
  if (uri->scheme == "replay") return ReplayProbe::open(*uri);
  if (uri->scheme == "sim") return SimProbe::open(*uri);
  if (uri->scheme == "serial") return open_serial_device(*uri);
  if (uri->scheme == "hid") return open_hid_device(*uri);
  if (uri->scheme == "usb") return open_usb_device(*uri);
  return bad_input(
      "\"" + uri->text + "\": there is no probe scheme \"" + uri->scheme +
      "\"; known are replay:FILE, sim:SHAPE, serial:DEVICE?protocol=NAME, hid:VID:PID, "
      "usb:VID:PID and fused:URI|URI");
}

}  // namespace merkel
