#include "tools/filled_text.hpp"

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(FilledText, HasLinesOnlyForWhatTheFactsSay) {
  const Json latency = {
      {"count", 2}, {"p50_us", 1.0}, {"p99_us", 2.5}, {"p99.9_us", 3.0}, {"max_us", 4.0}};
  Json loop = {{"sample_to_spike", nullptr},
               {"sample_to_command", nullptr},
               {"wait", "sleep"},
               {"margin_us", nullptr},
               {"priority", nullptr},
               {"demoted", false},
               {"cpu", 0},
               {"memory_locked", false},
               {"page_faults", 3},
               {"involuntary_switches", 0},
               {"queue", nullptr},
               {"wake_up", latency},
               {"tick", nullptr},
               {"processor", latency},
               {"publish", latency}};
  const std::string measured = "p50 1.0, p99 2.5, p99.9 3.0, max 4.0 µs\n";
  EXPECT_EQ(filled_text("loop", loop),
            "loop: sleep wait, SCHED_OTHER, on core 0, memory not locked; 3 page faults, 0 "
            "involuntary context switches\n"
            "  wake-up: " +
                measured + "  tick: not measured\n  processor time of a tick: " + measured +
                "  publish: " + measured);
  loop["priority"] = 80;
  loop["margin_us"] = 49.6;
  loop["cpu"] = nullptr;
  loop["memory_locked"] = true;
  loop["sample_to_spike"] = latency;
  loop["recent_sample_to_spike"] = latency;
  loop["queue"] = latency;
  const std::string all = filled_text("loop", loop);
  EXPECT_EQ(all.find("from a sample's arrival to its spike: p50 1.0, p99 2.5, p99.9 3.0, max 4.0 "
                     "µs; in the last seconds p50 1.0, p99 2.5 µs\n"
                     "loop: sleep wait (margin 50 µs), SCHED_FIFO 80, memory locked; 3 page"),
            0U)
      << all;
  EXPECT_NE(all.find("  delay: not measured\n  queue (jitter buffer): p50"), std::string::npos);
}

TEST(FilledText, RepeatsASectionForEachElementAndMarksWhatIsMissing) {
  Json facts = {{"fired", 2}, {"all", 3}, {"shown", 2}, {"in_part", true}};
  facts["most_active"] = {{{"neuron", 7},
                           {"receptors", 12},
                           {"mean_distance_mm", 1.234},
                           {"spikes", 5},
                           {"rate_hz", 2.0},
                           {"contact_rate_hz", 10.0}},
                          {{"neuron", 1},
                           {"receptors", 3},
                           {"mean_distance_mm", 0.5},
                           {"spikes", 1},
                           {"rate_hz", 0.5},
                           {"contact_rate_hz", nullptr}}};
  EXPECT_EQ(filled_text("afferents", facts),
            "afferents: 2 of 3 fired; the 2 most active (--all prints every one):\n"
            "neuron receptors mean_distance_mm spikes contact_hz whole_run_hz\n"
            "     7        12             1.23      5       10.0          2.0\n"
            "     1         3             0.50      1          -          0.5\n");
  facts["shown"] = 0;
  EXPECT_EQ(filled_text("afferents", facts), "afferents: 2 of 3 fired\n");
}

TEST(FilledText, CountsInWordsAndRoundsForSentences) {
  EXPECT_EQ(filled_text("timing", {{"rate_hz", 12345.6}, {"jitter_ms", 0.1234}, {"delay_ms", 2.2}}),
            "rate: 12346 samples/s with 0.123 ms of jitter; loop delay in a run: 2.2 ms\n");
  const auto device = [](int readings) {
    return filled_text("device", {{"readings", readings},
                                  {"device_clock", true},
                                  {"drift_ppm", 1.5},
                                  {"jitter_us", 2.0},
                                  {"latency_us", 30.0},
                                  {"clock_mapped", true},
                                  {"reboots", 1},
                                  {"outages", 0},
                                  {"outage_s", 0.0},
                                  {"rate_hz", 500.0}});
  };
  EXPECT_EQ(device(1).find("  device: 1 reading (500.0 per s"), 0U) << device(1);
  EXPECT_NE(device(2).find("2 readings ("), std::string::npos);
  EXPECT_NE(
      device(2).find("; 1 reboot, 0 outages of 0.000 s\n  its clock: +1.5 ppm, mapped with 2.0 µs"),
      std::string::npos)
      << device(2);
}

}  // namespace
}  // namespace merkel
