// Arbitrary bytes as a URI of a probe or a sink, as an address, and as a Host header. Built and
// run by fuzz.sh with libFuzzer.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "drivers/transports/host_name.hpp"
#include "drivers/uri.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto address = HostAndPort::parse(text);
  if (address) {
    if (address->host.empty() || address->port == 0) std::abort();
    static_cast<void>(address->loopback());
  }
  const auto uri = Uri::parse(text);
  if (!uri) return uri.error().sentence.empty() ? std::abort(), 0 : 0;
  if (uri->scheme.empty() || uri->text != text) std::abort();
  UriOptions options(*uri);
  const double rate = options.number("rate_hz", 25.0, 1.0, 30.0);
  const auto baud = options.whole("baud", 9600, 50, 1'000'000);
  if (!(rate >= 1.0 && rate <= 30.0) || baud < 50 || baud > 1'000'000) std::abort();
  const std::string word = options.word("clock", "mapped", "mapped|device");
  if (word != "mapped" && word != "device") std::abort();
  static_cast<void>(options.finish());
  return 0;
}
