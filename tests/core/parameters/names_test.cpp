#include <array>
#include <string>

#include <gtest/gtest.h>

#include "core/neurons/hodgkin_huxley/integration_method.hpp"
#include "core/parameters/nearest_name.hpp"

namespace merkel {
namespace {

TEST(NearestName, FindsTheIntendedKey) {
  const std::array<std::string, 3> keys = {"radius_mm", "delay_ms", "uri"};
  EXPECT_EQ(nearest_name("raduis_mm", keys), "radius_mm");
  EXPECT_EQ(nearest_name("delay", keys), "delay_ms");
  EXPECT_EQ(nearest_name("completely_different", keys), "");
  // One letter too many, or too few, is nearer than two others.
  const std::array<std::string, 2> tips = {"abcdef", "xycdefg"};
  EXPECT_EQ(nearest_name("abxcdef", tips), "abcdef");
  EXPECT_EQ(nearest_name("bcdef", tips), "abcdef");
  EXPECT_EQ(nearest_name("ycdefg", tips), "xycdefg");
  EXPECT_EQ(nearest_name("radus_mm", keys), "radius_mm");
}

TEST(IntegrationMethod, NamesReadBack) {
  EXPECT_EQ(integration_method_names().size(), 8U);
  for (int i = 0; i < 8; ++i) {
    const auto method = static_cast<IntegrationMethod>(i);
    EXPECT_EQ(integration_method_named(name_of(method)), method);
  }
  EXPECT_FALSE(integration_method_named("euler"));
}

}  // namespace
}  // namespace merkel
