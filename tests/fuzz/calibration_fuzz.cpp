// Arbitrary bytes as a calibration (TOML). Built and run by fuzz.sh with libFuzzer.

#include <cmath>

#include "drivers/calibration/probe_calibration.hpp"
#include "drivers/protocols/unit_factors.hpp"
#include "tests/fuzz/memory_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  static MemoryFile file;
  const auto calibration = read_calibration(file.hold(data, size));
  if (!calibration) return calibration.error().sentence.empty() ? std::abort(), 0 : 0;
  for (const auto& [key, factor] : calibration->factors) {
    if (!std::isfinite(factor) || factor == 0.0 || !UnitFactors::is_key(key)) std::abort();
  }
  for (const auto& channel : calibration->channels) {
    if (!channel) continue;
    if (!std::isfinite(channel->gain) || !std::isfinite(channel->zero) || channel->gain == 0.0) {
      std::abort();
    }
  }
  return 0;
}
