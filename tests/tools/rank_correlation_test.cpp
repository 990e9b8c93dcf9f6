#include "tools/studies/report/rank_correlation.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(RankCorrelation, IsOneForAnyRisingRelation) {
  const std::vector<double> x = {1.0, 2.0, 5.0, 9.0};
  EXPECT_DOUBLE_EQ(spearman(x, std::vector<double>{-3.0, 0.0, 0.1, 100.0}), 1.0);
  EXPECT_DOUBLE_EQ(spearman(x, std::vector<double>{4.0, 3.0, 2.0, 1.0}), -1.0);
  EXPECT_EQ(spearman(x, std::vector<double>{7.0, 7.0, 7.0, 7.0}), 0.0);
}

TEST(RankCorrelation, SharesRanksBetweenEqualValues) {
  // Ranks 1.5, 1.5, 3, 4 against 1, 2, 3, 4.
  EXPECT_NEAR(
      spearman(std::vector<double>{2.0, 2.0, 3.0, 4.0}, std::vector<double>{1.0, 2.0, 3.0, 4.0}),
      0.9486832980505138, 1e-12);
}

TEST(RankCorrelation, PartialTakesTheThirdVariableOut) {
  // y depends only on z, x on z with another order inside: the remaining correlation is weak.
  const std::vector<double> z = {1, 2, 3, 4, 5, 6, 7, 8};
  const std::vector<double> x = {2, 1, 4, 3, 6, 5, 8, 7};
  const std::vector<double> y = {1, 2, 3, 4, 5, 6, 8, 7};
  EXPECT_GT(spearman(x, y), 0.9);
  // (13/14 − 19/21·41/42) / √((1 − (19/21)²)(1 − (41/42)²))
  EXPECT_NEAR(partial_spearman(x, y, z), 40.0 / std::sqrt(6640.0), 1e-12);
}

}  // namespace
}  // namespace merkel
