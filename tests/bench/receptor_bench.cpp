// What does the drive of a patch cost for a moving sphere, by number of receptors and precision?
#include <vector>

#include <benchmark/benchmark.h>

#include "core/contact/hertz_contact.hpp"
#include "core/receptors/receptor_drive.hpp"

namespace merkel {
namespace {

void receptor_drive(benchmark::State& state) {
  const auto precision = static_cast<Precision>(state.range(0));
  const auto contacts = static_cast<std::size_t>(state.range(2));
  const auto receptors = *place_receptors({.count = state.range(1)}, {});
  ReceptorDrive drive(receptors, 20, {.precision = precision, .most_contacts = contacts});
  const HertzContact law(2.0, std::numeric_limits<double>::infinity(),
                         SkinMaterial(SkinParameters{}).reduced_modulus_kPa());
  std::vector<PlacedContact> placed(contacts, {.contact = law.at_depth(1.5), .y_mm = 10.0});
  double x_mm = 0.0;
  for (auto _ : state) {
    x_mm = x_mm < 30.0 ? x_mm + 0.01 : 0.0;
    for (PlacedContact& contact : placed) contact.x_mm = x_mm;
    drive.compute(placed);
    benchmark::DoNotOptimize(drive.output().data());
  }
  state.SetItemsProcessed(state.iterations() * state.range(1));
}
BENCHMARK(receptor_drive)
    ->ArgNames({"float", "receptors", "contacts"})
    ->ArgsProduct({{0, 1}, {450, 12'600}, {1, 2}});

}  // namespace
}  // namespace merkel
