#include "drivers/transports/usb_name.hpp"

#include <optional>
#include <utility>

#include "core/printed.hpp"
#include "drivers/parsed_number.hpp"

namespace merkel {
namespace {

std::optional<std::uint16_t> hexadecimal(std::string_view text) {
  return text.size() > 4 ? std::nullopt : parsed_number<std::uint16_t>(text, 16);
}

}  // namespace

Expected<UsbName, SetupError> UsbName::parse(std::string_view text, std::string serial_number) {
  const auto colon = text.find(':');
  const auto vendor = hexadecimal(text.substr(0, colon));
  const auto product =
      colon == std::string_view::npos ? std::nullopt : hexadecimal(text.substr(colon + 1));
  if (!vendor || !product) {
    return bad_input("\"" + std::string(text) +
                     "\" is not a USB device: write VID:PID in hexadecimal, for example 16c0:0486; "
                     "merkel probes lists the devices");
  }
  return UsbName{*vendor, *product, std::move(serial_number)};
}

std::string UsbName::text() const { return printed("%04x:%04x", vendor, product); }

std::string usb_node(long bus, long address) {
  return printed("/dev/bus/usb/%03ld/%03ld", bus, address);
}

}  // namespace merkel
