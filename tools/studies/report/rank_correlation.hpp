#pragma once

#include <span>

namespace merkel {

/// Spearman's rank correlation; equal values share their mean rank. 0 if one side is constant.
[[nodiscard]] double spearman(std::span<const double> x, std::span<const double> y);

/// Partial rank correlation of x and y, given z:
/// (r_xy − r_xz·r_yz)/√((1−r_xz²)(1−r_yz²)); 0 if z explains everything.
[[nodiscard]] double partial_spearman(std::span<const double> x, std::span<const double> y,
                                      std::span<const double> z);

}  // namespace merkel
