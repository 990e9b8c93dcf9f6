// Arbitrary bytes as a recorded session (XDF): as a whole file or, if the first byte is odd, after
// the headers of a valid one. Built and run by fuzz.sh with libFuzzer; session_seeds.py makes the
// initial corpus.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "drivers/sample_limits.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "tests/fuzz/memory_file.hpp"

namespace {

void check(bool holds) {
  if (!holds) std::abort();
}

/// The headers of a session, written by the sink.
std::string good_headers() {
  using namespace merkel;
  const auto path = std::filesystem::temp_directory_path() /
                    ("merkel-fuzz-" + std::to_string(::getpid()) + ".xdf");
  const auto uri = Uri::parse("xdf:" + path.string());
  SinkSetup setup{.overwrite = true, .allow_remote = false, .run = {}};
  setup.run.model.indenters.front().tip = TaxelArray{};  // all streams
  const auto sink = open_xdf_sink(*uri, setup);
  check(sink.has_value() && (*sink)->begin({}).has_value());
  std::ifstream file(path.string() + ".part", std::ios::binary);
  const std::string headers{std::istreambuf_iterator<char>(file), {}};
  std::filesystem::remove(path.string() + ".part");
  check(headers.size() > 100);
  return headers;
}

void check_items(const merkel::SessionChunk& chunk) {
  using namespace merkel;
  check(count_of(chunk) > 0);
  for (const SpikeEvent& spike : chunk.spikes) check(spike.neuron > 0);
  for (const TickRecord& tick : chunk.ticks) {
    check(!name_of(tick.state).empty());
    check(plausible(tick.contact.depth_mm, SampleLimits::kDepth_mm));
    check(plausible(tick.contact.force_mN, SampleLimits::kForce_mN));
  }
  for (const auto& item : chunk.samples) check(plausible(item.sample));
  for (const LoopEvent& event : chunk.events) check(!name_of(event.kind).empty());
  for (const TaxelBlock& block : chunk.taxels) {
    check(block.count >= 1 && block.count <= TaxelBlock::kTaxels);
    for (const float kPa : block.pressure_kPa) check(kPa >= 0.0F);
  }
  for (const auto& item : chunk.frames) {
    check(!name_of(item.frame.kind).empty());
    check(item.frame.content().size() <= RawFrame::kMaxBytes);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  static const std::string headers = good_headers();
  static MemoryFile file;
  if (size == 0) return 0;
  std::string bytes = (data[0] & 1U) != 0U ? headers : std::string();
  bytes.append(reinterpret_cast<const char*>(data) + 1, size - 1);
  auto session = SessionReader::open(
      file.hold(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()));
  if (!session) {
    check(!session.error().sentence.empty());
    return 0;
  }
  SessionChunk chunk;
  std::size_t chunks = 0;
  for (;;) {
    const auto more = session->next(chunk);
    if (!more) {
      check(!more.error().sentence.empty());
      break;
    }
    if (!*more) break;
    check_items(chunk);
    ++chunks;
  }
  check(chunks <= size);
  return 0;
}
