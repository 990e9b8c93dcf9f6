#include <map>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/tools/program.hpp"

namespace merkel {
namespace {

nlohmann::json bench(const std::string& method) {
  const auto run =
      run_program({"bench", "--neurons", "20", "--step-us", "20", "--method", method, "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return nlohmann::json::parse(run.out);
}

// The times are of this machine; the other figures follow from them.
TEST(Bench, TheFiguresOfAPopulationFollowFromItsTime) {
  const auto result = bench("crank_nicolson");
  ASSERT_EQ(result["populations"].size(), 4U);
  std::map<std::string, double> operations, bound_ns;  // of a neuron's step
  for (const auto& row : result["populations"]) {
    const auto value = [&](const char* key) { return row[key].get<double>(); };
    const std::string precision = row["precision"];
    const double peak = result["fma_peak_gflops"][precision];
    const double ns = value("ns_per_neuron_step");
    ASSERT_GT(ns, 0.0);
    EXPECT_GT(value("gflops"), 0.0);
    EXPECT_NEAR(value("ns_per_step") / (20.0 * ns), 1.0, 1e-9);
    EXPECT_NEAR(value("times_real_time") * value("ns_per_step") / 20e3, 1.0, 1e-9);
    EXPECT_NEAR(value("fraction_of_peak") * peak / value("gflops"), 1.0, 1e-9);
    // Rows of one precision have the same operations and bound, which is beyond the peak.
    const auto known = operations.try_emplace(precision, value("gflops") * ns).first;
    EXPECT_NEAR(known->second / (value("gflops") * ns), 1.0, 1e-9);
    const auto bound = bound_ns.try_emplace(precision, value("fraction_of_port_bound") * ns).first;
    EXPECT_NEAR(bound->second / (value("fraction_of_port_bound") * ns), 1.0, 1e-9);
    EXPECT_GE(bound->second, known->second / peak);
    EXPECT_EQ(row["threads"], 1);
  }
  EXPECT_EQ(operations.size(), 2U);
  // The operations of other methods are not counted.
  const auto euler = bench("forward_euler");
  for (const auto& row : euler["populations"]) EXPECT_FALSE(row.contains("gflops"));
}

}  // namespace
}  // namespace merkel
