#include "core/printed.hpp"

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(Printed, ALongNameDoesNotCutTheSentence) {
  const std::string name(2000, 'x');
  EXPECT_EQ(printed("%s: %.1f %%", name.c_str(), 2.5), name + ": 2.5 %");
}

}  // namespace
}  // namespace merkel
