#include "tools/studies/score/recordings.hpp"

#include <string>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "tests/text_has.hpp"

namespace merkel {
namespace {

std::string fault_of(const std::string& text) {
  const auto read = parse_recordings(text, "d.json");
  return read ? "accepted" : read.error().sentence;
}

std::string spheres(const std::string& fields) {
  return R"({"curvature_force": {"cite": "x", )" + fields + "}}";
}

TEST(Recordings, ThePublishedOnesAreAllThere) {
  const Recordings recordings = published_recordings();
  ASSERT_EQ(recordings.sets.size(), 7U);
  const DataSet& light = recordings.sets[0];
  EXPECT_EQ(light.name, "curvature × force, 0.098 N");
  ASSERT_EQ(light.points.size(), 7U);
  EXPECT_EQ(light.points[6].x, 694.0);
  EXPECT_EQ(light.points[6].measured, 84.0);
  EXPECT_NEAR(light.points[6].stimulus.indenter.sphere()->radius_mm, 1000.0 / 694.0, 1e-12);
  EXPECT_TRUE(std::isinf(light.points[0].stimulus.indenter.sphere()->radius_mm));
  EXPECT_EQ(light.points[0].stimulus.indenter.control, Indenter::Control::kForce);
  EXPECT_NEAR(light.points[0].stimulus.level, 98.0, 1e-9);
  EXPECT_NE(light.cite.find("Goodwin"), std::string::npos);
  const DataSet& vibration = recordings.sets[3];
  EXPECT_EQ(vibration.name, "vibration, 100 Hz");
  EXPECT_EQ(vibration.points[4].stimulus.frequency_hz, 100.0);
  EXPECT_NEAR(vibration.points[4].stimulus.amplitude_mm, 0.1939, 1e-12);
  const Stimulus& hold = recordings.sets[4].points[0].stimulus;
  EXPECT_EQ(hold.decline_over_s, 12.0);
  EXPECT_NEAR(hold.ramp_s, 0.65 / 0.4, 1e-12);
  const DataSet& force_hold = recordings.sets[6];
  EXPECT_EQ(force_hold.name, "fall of rate from 1 to 4 s of hold");
  EXPECT_EQ(force_hold.x_name, "force_N");
  EXPECT_FALSE(force_hold.fit);
  EXPECT_NEAR(force_hold.points[0].stimulus.level, 147.0, 1e-9);
  EXPECT_EQ(force_hold.points[0].stimulus.decline_from_s, 1.0);
  ASSERT_EQ(recordings.field_areas.size(), 1U);
  EXPECT_EQ(recordings.field_areas[0].points.size(), 5U);
  EXPECT_EQ(recordings.field_areas[0].array.pins, 73U);
  ASSERT_EQ(recordings.surrounds.size(), 2U);
  EXPECT_EQ(recordings.surrounds[1].array.background_mm, 3.0);
  EXPECT_EQ(recordings.surrounds[1].points[1].pins, 7U);
  EXPECT_EQ(recordings.most_trial_sd, 1.0);
  EXPECT_EQ(recordings.time_constants_ms.size(), 3U);
  EXPECT_EQ(recordings.intervals.size(), 3U);
}

TEST(Recordings, BarsMayBeGivenByTheirEdges) {
  const auto read = parse_recordings(R"({"bar_profile": {"cite": "b", "bar_edges_mm":
    [[-4, -1], [0, 1.5], [3, 6]], "position_mm": [-2, 0.5], "rate_hz": {"1.0mm": [10, 20]}}})",
                                     "d.json");
  ASSERT_TRUE(read) << read.error().sentence;
  const Stimulus& stimulus = read->sets[0].points[1].stimulus;
  EXPECT_EQ(std::get<BarTip>(stimulus.indenter.tip).widths_mm,
            (std::vector<double>{3.0, 1.5, 3.0}));
  EXPECT_EQ(std::get<BarTip>(stimulus.indenter.tip).gaps_mm, (std::vector<double>{1.0, 1.5}));
  // The centre of the row is at 1 mm, half a millimetre to the right of the afferent.
  EXPECT_EQ(stimulus.offset_mm, 0.5);
  for (const char* const edges :
       {"[]", "[[1, 0]]", "[[0, 2], [1, 3]]", "[[0, 2], [2, 3]]", "[[0]]", "[0, 1]"}) {
    const std::string fault =
        fault_of(R"({"bar_profile": {"cite": "b", "bar_edges_mm": )" + std::string(edges) +
                 R"(, "position_mm": [0], "rate_hz": {"1mm": [1]}}})");
    EXPECT_TRUE(has(fault, "bar_edges_mm must be a list of")) << edges << fault;
  }
}

TEST(Recordings, OtherConditionsHaveAFormToo) {
  const auto read = parse_recordings(R"({
    "lateral_offset": [{"cite": "a", "curvature_per_m": 340, "offset_mm": [-1, 0, 2],
                        "rate_hz": {"15gwt_0.147N": [10, 40, 5]}}],
    "bar_profile": {"cite": "b", "bar_widths_mm": [3, 1.5], "bar_gaps_mm": [2], "bar_length_mm": 12,
                    "position_mm": [-2, 0.5], "rate_hz": {"1.0mm": [10, 20]}, "ramp_ms": 20,
                    "count_s": 0.5},
    "vibration": {"cite": "c", "probe_diameter_mm": 2, "pre_indentation_mm": 0.1,
                  "50Hz": {"um": [100], "hz": [12]}},
    "hold_adaptation": {"cite": "d", "ramp_mm_per_s": 1, "decline_over_first_5s": {"1.3mm": 0.36}}
  })",
                                     "d.json");
  ASSERT_TRUE(read) << read.error().sentence;
  ASSERT_EQ(read->sets.size(), 4U);
  EXPECT_EQ(read->sets[0].points[2].stimulus.offset_mm, 2.0);
  EXPECT_NEAR(read->sets[0].points[2].stimulus.level, 147.0, 1e-9);
  const Stimulus& bars = read->sets[1].points[0].stimulus;
  EXPECT_EQ(bars.indenter.tip_name(), "bars");
  EXPECT_EQ(bars.indenter.control, Indenter::Control::kDepth);
  EXPECT_EQ(bars.offset_mm, 2.0);
  EXPECT_EQ(bars.count_s, 0.5);
  EXPECT_NEAR(bars.ramp_s, 0.02, 1e-12);
  const Stimulus& sine = read->sets[2].points[0].stimulus;
  EXPECT_EQ(sine.level, 0.1);
  EXPECT_EQ(std::get<PinTip>(sine.indenter.tip).diameter_mm, 2.0);
  EXPECT_GT(sine.settle_s, 0.3);
  EXPECT_EQ(read->sets[3].points[0].stimulus.decline_over_s, 5.0);
}

TEST(Recordings, ErrorsNameTheFieldAndTheRemedy) {
  EXPECT_EQ(fault_of("{"), "d.json:1: this is not valid JSON");
  EXPECT_EQ(fault_of("[1e999]"), "d.json: holds a number that is too large");
  EXPECT_EQ(fault_of("{}"), "d.json: holds no data: add a section such as curvature_force");
  EXPECT_EQ(fault_of(R"({"curvature_forse": {}})"),
            "d.json: the field curvature_forse is unknown: did you mean curvature_force?");
  EXPECT_EQ(fault_of(spheres(R"("curvature_per_m": [1], "rate_hz": {"0.1N": [3]}, "depht": 1)"))
                .substr(0, 56),
            "d.json: the field curvature_force.depht is unknown; the ");
  EXPECT_EQ(fault_of(spheres(R"("curvature_per_m": [1], "rate_hz": {"10gwt_0.098": [3]})")),
            "d.json: curvature_force.rate_hz.10gwt_0.098 must end in a number with its unit, as in "
            "\"20gwt_0.196N\"");
  EXPECT_EQ(fault_of(spheres(R"("curvature_per_m": [1], "rate_hz": {"10gwt_-0.098N": [3]})")),
            "d.json: curvature_force.rate_hz.10gwt_-0.098N must have a positive number before N");
  EXPECT_EQ(fault_of(spheres(R"("curvature_per_m": [1], "rate_hz": {"0.1N": [-3]})")),
            "d.json: curvature_force.rate_hz.0.1N must be zero or positive, but is -3");
  EXPECT_EQ(fault_of(spheres(R"("curvature_per_m": [1, 2], "rate_hz": {"0.1N": [3]})")),
            "d.json: curvature_force.rate_hz.0.1N must have as many numbers as curvature_per_m: 2, "
            "but has 1");
  EXPECT_EQ(fault_of(R"({"vibration": {"cite": "x", "20": {"um": [1], "hz": [1]}}})"),
            "d.json: vibration.20 has no unit: add one to the name, as in \"20Hz\" or \"0.65mm\"");
  EXPECT_EQ(fault_of(R"({"vibration": {"20Hz": {"um": [1], "hz": [1]}}})"),
            "d.json: vibration.cite is missing: give the source of the data");
  EXPECT_EQ(fault_of(R"({"hold_adaptation": {"cite": "x",
                         "decline_over_first_12s": {"0.65mm": 38}}})"),
            "d.json: hold_adaptation.decline_over_first_12s.0.65mm must be a fraction of the rate, "
            "from -1 to 1");
  EXPECT_EQ(fault_of(R"({"bar_profile": {"cite": "x", "bar_widths_mm": [3, 3],
                         "position_mm": [0], "rate_hz": {"1mm": [3]}}})"),
            "d.json: bar_profile.bar_gaps_mm must list one gap fewer than there are bars");
}

TEST(Recordings, SurviveRandomText) {
  Random random(3);
  const std::string likely = "{}[]\":,0123456789-+.eE \"curvature_force\"rate_hzNm";
  for (int k = 0; k < 3000; ++k) {
    std::string text = k % 2 == 0 ? R"({"curvature_force": {"cite": "x", )" : "";
    for (int i = 0; i < 60; ++i) {
      text += k % 5 == 0 ? static_cast<char>(random.next() & 0xFFU)
                         : likely[random.next() % likely.size()];
    }
    static_cast<void>(parse_recordings(text, "d.json"));
  }
}

}  // namespace
}  // namespace merkel
