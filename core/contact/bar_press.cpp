#include "core/contact/bar_press.hpp"

#include <algorithm>
#include <cmath>

namespace merkel {
namespace {

constexpr double kLengthFactor = 1.65;

}  // namespace

BarTip touching_part(BarTip tip, double skin_radius_mm, double depth_mm) {
  tip.length_mm =
      std::min(tip.length_mm, 2.0 * std::sqrt(kLengthFactor * skin_radius_mm * depth_mm));
  return tip;
}

double whole_length_depth_mm(const BarTip& tip, double skin_radius_mm) {
  return tip.length_mm * tip.length_mm / (4.0 * kLengthFactor * skin_radius_mm);
}

std::vector<QuadratureNode> press_increments(double from_mm, double to_mm, int count) {
  auto nodes = gauss_legendre(count, std::sqrt(from_mm), std::sqrt(to_mm));
  for (QuadratureNode& node : nodes) node = {node.x * node.x, 2.0 * node.x * node.weight};
  return nodes;
}

BarContact loads_under_bars(const BarTip& tip, const SkinParameters& skin, double depth_mm,
                            double finest_mm) {
  const double modulus = SkinMaterial(skin).reduced_modulus_kPa();
  BarContact all;
  if (!(depth_mm > 0.0)) return all;
  const auto parts = std::isinf(skin.radius_mm)
                         ? std::vector<QuadratureNode>{{.x = depth_mm, .weight = depth_mm}}
                         : press_increments(0.0, depth_mm, 16);
  for (const QuadratureNode& part : parts) {
    BarContact contact =
        BarContact::solve(touching_part(tip, skin.radius_mm, part.x), modulus, finest_mm);
    for (LineLoad& load : contact.loads) {
      load.force_per_length_mN_per_mm *= part.weight;
      all.loads.push_back(load);
    }
    all.force_mN_per_mm += contact.force_mN_per_mm * part.weight / depth_mm;
  }
  return all;
}

}  // namespace merkel
