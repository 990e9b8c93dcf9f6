#pragma once

#include <span>

namespace merkel {

/// Spearman's rank correlation; equal values share their mean rank. 0 where one side is constant.
[[nodiscard]] double spearman(std::span<const double> x, std::span<const double> y);

/// The rank correlation of x and y that z does not explain:
/// (r_xy − r_xz·r_yz)/√((1−r_xz²)(1−r_yz²)); 0 where z explains everything.
[[nodiscard]] double partial_spearman(std::span<const double> x, std::span<const double> y,
                                      std::span<const double> z);

}  // namespace merkel
