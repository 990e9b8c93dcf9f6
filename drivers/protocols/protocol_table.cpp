#include "drivers/protocols/protocol_table.hpp"

#include <array>
#include <vector>

#include "core/parameters/nearest_name.hpp"
#include "core/records/probe_sample.hpp"
#include "drivers/protocols/protocol_makers.hpp"

namespace merkel {
namespace {

constexpr std::uint32_t kDepth = ProbeSample::kDepth;
constexpr std::uint32_t kForce = ProbeSample::kForce;

const std::array<ProtocolEntry, 7> kTable = {{
    {"hbf1", "the project's own firmware", 500000, make_hbf1, make_hbf1_device, "",
     kDepth | kForce},
    {"csv", "lines of numbers; columns are recognised or named with columns=", 115200,
     make_csv_lines, make_csv_device, "", kDepth | kForce},
    {"mark10", "Mark-10 force gauge, series 5 and 7", 115200, make_mark10,
     [](std::uint32_t) { return make_mark10_device(); }, "", kForce},
    {"esm", "Mark-10 test stand ESM301, ESM303", 115200, make_esm, make_esm_device, "", kDepth,
     false, true},
    {"grbl", "GRBL 1.1 CNC machine as indenter", 115200, make_grbl,
     [](std::uint32_t) { return make_grbl_device(); }, "", kDepth, false, true},
    {"optoforce", "OptoForce DAQ, 3-axis force", 1000000, make_optoforce,
     [](std::uint32_t) { return make_optoforce_device(); }, "counts_per_N=1024", kForce},
    {"zaber", "Zaber linear stage", 115200, make_zaber,
     [](std::uint32_t) { return make_zaber_device(); }, "um_per_step=0.9765625", kDepth, false,
     true},
}};

const ProtocolEntry kAtiRdt = {
    "ati_rdt", "ATI Net F/T, only over UDP", 0, make_ati_rdt, make_ati_rdt_device, "", kForce,
    true};

}  // namespace

const ProtocolEntry& ati_rdt_entry() noexcept { return kAtiRdt; }

std::span<const ProtocolEntry> protocol_table() noexcept { return kTable; }

bool is_carried(const ProtocolEntry& entry, std::string_view scheme) noexcept {
  if (scheme == "udp") return entry.datagrams || entry.name == "csv";
  if (scheme == "tcp") return entry.name == "csv" || entry.name == "hbf1";
  return !entry.datagrams;
}

Expected<const ProtocolEntry*, SetupError> find_protocol(std::string_view name) {
  if (name == kAtiRdt.name) return &kAtiRdt;
  std::vector<std::string> names;
  for (const ProtocolEntry& entry : kTable) {
    if (entry.name == name) return &entry;
    names.emplace_back(entry.name);
  }
  if (name.empty())
    return bad_input("the option protocol is missing: add protocol= and one of " + listed(names));
  return bad_input("there is no protocol \"" + std::string(name) + "\"" +
                   did_you_mean(name, names, "; the known ones are " + listed(names)));
}

std::string_view likely_protocol(std::span<const std::uint8_t> bytes) {
  constexpr std::uint64_t kEnough = 2;
  std::string_view likely;
  std::uint64_t most = kEnough - 1;
  const auto try_entry = [&](const ProtocolEntry& entry) {
    const auto uri = Uri::parse("serial:?" + std::string(entry.options));
    if (!uri) return;
    UriOptions options(*uri);
    const auto protocol = entry.make(options);
    if (!protocol) return;
    DeviceStream stream;
    (*protocol)->begin(std::chrono::nanoseconds{0}, stream);
    (*protocol)->take(bytes, std::chrono::nanoseconds{1}, stream);
    // Lines with words and numbers are only csv if a number in them is measured.
    if (entry.name == "csv" && !(*protocol)->ready()) return;
    if (stream.counts.frames > most && stream.counts.frames > stream.counts.damaged) {
      most = stream.counts.frames;
      likely = entry.name;
    }
  };
  // Lines of numbers with units are csv only if no other protocol matches.
  for (const ProtocolEntry& entry : kTable) {
    if (entry.name != "csv") try_entry(entry);
  }
  if (likely.empty()) try_entry(**find_protocol("csv"));
  // Lines of numbers count as csv even without named columns.
  if (likely.empty() && lines_of_numbers(bytes) > 2 * kEnough) likely = "csv";
  return likely;
}

}  // namespace merkel
