#include "core/scene/patch_layout.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/scene/tactile_model.hpp"
#include "core/scene/tactile_patch.hpp"

namespace merkel {
namespace {

TEST(PatchLayout, ASubregionHasTheReceptorsInIt) {
  const auto layout = layout_of({});
  ASSERT_TRUE(layout);
  ASSERT_EQ(layout->afferents.size(), 20U);
  EXPECT_EQ(layout->receptors.size(), 450U);
  for (std::size_t n = 0; n < layout->afferents.size(); ++n) {
    const AfferentSite& site = layout->afferents[n];
    std::size_t count = 0;
    for (const Receptor& receptor : layout->receptors) {
      if (receptor.neuron != n + 1) continue;
      ++count;
      EXPECT_LE(std::hypot(receptor.x_mm - site.x_mm, receptor.y_mm - site.y_mm), site.radius_mm);
    }
    EXPECT_EQ(site.receptors, count);
  }
  EXPECT_EQ(layout->afferents[0].x_mm, 3.0);
  EXPECT_EQ(layout->afferents[0].y_mm, 2.5);
  EXPECT_EQ(layout->afferents[0].radius_mm, std::hypot(3.0, 2.5));
}

TEST(PatchLayout, FieldsAreAtTheirCentres) {
  const auto layout = layout_of({.layout = ReceptorLayout::kFields,
                                 .field = {.receptors = 5, .radius_mm = 0.5},
                                 .centres = {{15.0, 10.0}, {17.0, 9.0}}});
  ASSERT_TRUE(layout);
  ASSERT_EQ(layout->afferents.size(), 2U);
  EXPECT_EQ(layout->afferents[1].x_mm, 17.0);
  EXPECT_EQ(layout->afferents[1].y_mm, 9.0);
  EXPECT_EQ(layout->afferents[1].radius_mm, 0.5);
  EXPECT_EQ(layout->afferents[1].receptors, 5U);
  EXPECT_EQ(layout->receptors.size(), 10U);
}

TEST(PatchLayout, MatchesTheModel) {
  for (const ReceptorLayout which : {ReceptorLayout::kSubregions, ReceptorLayout::kFields}) {
    TactileModel::Parameters parameters;
    parameters.patches.front().layout = which;
    parameters.network.gain = 0.0;
    const auto layout = layout_of(parameters.patches.front());
    const auto model = TactileModel::create(parameters);
    ASSERT_TRUE(layout && model);
    EXPECT_EQ(model->neurons(), layout->afferents.size());
    const auto own = model->patches().front().drive().receptors();
    ASSERT_EQ(own.size(), layout->receptors.size());
    // The model groups its receptors by afferent.
    auto sorted = layout->receptors;
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const Receptor& a, const Receptor& b) { return a.neuron < b.neuron; });
    EXPECT_TRUE(
        std::equal(own.begin(), own.end(), sorted.begin(), [](const auto& a, const auto& b) {
          return a.x_mm == b.x_mm && a.y_mm == b.y_mm && a.neuron == b.neuron;
        }));
  }
}

}  // namespace
}  // namespace merkel
