// Arbitrary bytes as a trace (CSV). Built and run by fuzz.sh with libFuzzer.

#include <vector>

#include "drivers/protocols/trace_file.hpp"
#include "drivers/sample_limits.hpp"
#include "tests/fuzz/memory_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  static MemoryFile file;
  auto trace = TraceReader::open(file.hold(data, size));
  if (!trace) return trace.error().sentence.empty() ? std::abort(), 0 : 0;
  std::vector<ProbeSample> samples(7);
  bool first = true;
  std::chrono::nanoseconds last{0};
  for (auto count = trace->read(samples); count && *count > 0; count = trace->read(samples)) {
    for (std::size_t i = 0; i < *count; ++i) {
      if (!plausible(samples[i]) || samples[i].channels != trace->channels()) std::abort();
      if (!first && samples[i].time <= last) std::abort();
      last = samples[i].time;
      first = false;
    }
  }
  return 0;
}
