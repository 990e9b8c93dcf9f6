#include "drivers/transports/usb_name.hpp"

#include <array>
#include <charconv>
#include <cstdio>
#include <optional>
#include <utility>

namespace merkel {
namespace {

std::optional<std::uint16_t> hexadecimal(std::string_view text) {
  std::uint16_t number = 0;
  const char* const end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, number, 16);
  if (result.ec != std::errc{} || result.ptr != end || text.size() > 4) return std::nullopt;
  return number;
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

std::string UsbName::text() const {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%04x:%04x", vendor, product);
  return text.data();
}

std::string usb_node(long bus, long address) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "/dev/bus/usb/%03ld/%03ld", bus, address);
  return text.data();
}

}  // namespace merkel
