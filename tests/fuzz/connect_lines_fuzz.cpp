// Arbitrary lines through what merkel connect recognises in them; what it proposes must be options
// that the protocol csv accepts. Built and run by fuzz.sh with libFuzzer.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "drivers/protocols/protocol_makers.hpp"
#include "tools/connect/array_scene.hpp"
#include "tools/connect/csv_readings.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  std::vector<std::string> lines(1);
  for (std::size_t i = 0; i < size; ++i) {
    if (data[i] == '\n') {
      lines.emplace_back();
    } else {
      lines.back() += static_cast<char>(data[i]);
    }
  }
  for (const Reading& reading : readings_of_lines(lines, 1.0)) {
    const auto uri = Uri::parse("serial:x?" + reading.options());
    if (!uri) std::abort();
    const std::size_t taxels = taxels_among(channels_of(uri->text));
    if (taxels > 0 && ArrayLayout::of(taxels, uri->text).rows == 0) std::abort();
    UriOptions options(*uri);
    static_cast<void>(options.text("protocol", ""));
    if (!make_csv_lines(options) || !options.finish()) std::abort();
  }
  return 0;
}
