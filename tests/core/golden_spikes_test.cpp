// Compares the spikes of a sliding press, for every neuron, method and precision, with a table
// that is the same for all processors: tests/golden/core_spikes.csv. Unlike golden.py, it needs
// only the core library. MERKEL_WRITE_GOLDEN=1 rewrites the table.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/scene/tactile_model.hpp"

namespace merkel {
namespace {

constexpr const char* kTable = "tests/golden/core_spikes.csv";

struct Case {
  std::string name;
  TactileModel::Parameters parameters;
};

std::vector<Case> all_cases() {
  std::vector<Case> cases;
  TactileModel::Parameters lattice;
  lattice.patches[0].receptors.placement = ReceptorParameters::Placement::kLattice;
  for (const std::string& method : integration_method_names()) {
    for (const auto precision : {Precision::kDouble, Precision::kFloat}) {
      TactileModel::Parameters p = lattice;
      p.afferent = HodgkinHuxleyAfferent{.method = *integration_method_named(method),
                                         .precision = precision};
      cases.push_back({method + "-" + std::string(name_of(precision)), p});
      p.network.gain = 0.0;
      cases.push_back({method + "-" + std::string(name_of(precision)) + "-alone", p});
    }
  }
  TactileModel::Parameters general = lattice;
  std::get<HodgkinHuxleyAfferent>(general.afferent).neuron.beta_n.slope_mV *= 1.001;
  cases.push_back({"general-slopes", general});
  cases.push_back({"random-placement", {}});
  TactileModel::Parameters driven = lattice;
  set_kind(driven, NeuronKind::kIntegrateAndFire);
  driven.network.gain = 0.0;
  driven.noise()->sigma = 0.5;
  cases.push_back({"integrate_and_fire", driven});
  TactileModel::Parameters pin = lattice;
  pin.indenters[0].tip = PinTip{};
  cases.push_back({"pin", pin});
  return cases;
}

/// Number of spikes, and a hash of all their times and neurons (FNV-1a).
std::string digest_of(const TactileModel::Parameters& parameters) {
  auto model = TactileModel::create(parameters);
  if (!model) return model.error().key + " " + model.error().reason;
  std::uint64_t hash = 0xcbf29ce484222325U;
  const auto add = [&](std::uint64_t word) {
    for (int byte = 0; byte < 8; ++byte) {
      hash = (hash ^ ((word >> (8 * byte)) & 0xffU)) * 0x100000001b3U;
    }
  };
  std::size_t count = 0;
  for (int tick = 0; tick < 200; ++tick) {
    // Down, along the finger, up: only sums and products, which give the same bits everywhere.
    const double down = std::min({tick / 40.0, 1.0, (200 - tick) / 40.0});
    const ContactInput input{.depth_mm = 1.5 * down, .x_mm = 5.0 + 0.1 * tick, .y_mm = 9.0};
    for (const SpikeEvent& spike : model->step({&input, 1}, tick * parameters.tick)) {
      add(static_cast<std::uint64_t>(spike.time.count()));
      add(spike.neuron);
      ++count;
    }
  }
  std::ostringstream text;
  text << count << "," << std::hex << hash;
  return text.str();
}

TEST(GoldenSpikes, AreTheSameOnEveryProcessor) {
  const bool write = std::getenv("MERKEL_WRITE_GOLDEN") != nullptr;
  std::map<std::string, std::string> expected;
  std::ifstream table(kTable);
  ASSERT_TRUE(write || table) << kTable << " is missing: run the test in the project's folder";
  for (std::string line; std::getline(table, line);) {
    const std::size_t comma = line.find(',');
    if (comma != std::string::npos) expected[line.substr(0, comma)] = line.substr(comma + 1);
  }
  std::ostringstream written;
  written << "case,spikes,fnv1a_of_times_and_neurons\n";
  for (const Case& each : all_cases()) {
    const std::string digest = digest_of(each.parameters);
    written << each.name << "," << digest << "\n";
    EXPECT_TRUE(write || digest == expected[each.name]) << each.name << " gives " << digest;
  }
  if (write) std::ofstream(kTable) << written.str();
}

}  // namespace
}  // namespace merkel
