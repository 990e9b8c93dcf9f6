#include "core/contact/solver/tip_heights.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace merkel {
namespace {

constexpr double kNoTip = std::numeric_limits<double>::infinity();
constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;
constexpr int kCoarseSamples = 5;  ///< in each direction of a pixel, to find rims
constexpr int kFineSamples = 16;   ///< in each direction, to measure coverage

/// The height of a flat end whose rim is rounded, at a distance inside the rim.
double flat_end(double inside_mm, double edge_radius_mm) {
  if (inside_mm < 0.0) return kNoTip;
  const double into = edge_radius_mm - inside_mm;
  if (into <= 0.0) return 0.0;
  return edge_radius_mm - std::sqrt(std::max(0.0, edge_radius_mm * edge_radius_mm - into * into));
}

/// A ridge or apex with the slope of its flanks, rounded by a circle that meets them tangentially;
/// the lowest point is at 0.
double rounded_ridge(double distance_mm, double slope, double edge_radius_mm) {
  const double root = std::sqrt(1.0 + slope * slope);
  const double tangent = edge_radius_mm * slope / root;
  if (distance_mm <= tangent) {
    return edge_radius_mm - std::sqrt(edge_radius_mm * edge_radius_mm - distance_mm * distance_mm);
  }
  return edge_radius_mm * (1.0 - root) + slope * distance_mm;
}

double slope_of(double angle_deg) { return 1.0 / std::tan(0.5 * angle_deg * kRadiansPerDegree); }

/// The heights at k × k points of a pixel.
template <class Visit>
void sample_pixel(const TipHeight& tip, double x, double y, double pixel, int samples,
                  Visit visit) {
  for (int j = 0; j < samples; ++j) {
    for (int i = 0; i < samples; ++i) {
      visit(tip(x + ((i + 0.5) / samples - 0.5) * pixel, y + ((j + 0.5) / samples - 0.5) * pixel));
    }
  }
}

}  // namespace

TipHeight sphere_height(double radius_mm) {
  return [curvature = 0.5 / radius_mm](double x, double y) { return curvature * (x * x + y * y); };
}

TipHeight exact_sphere_height(double radius_mm) {
  return [=](double x, double y) {
    const double r2 = x * x + y * y;
    const double root2 = radius_mm * radius_mm - r2;
    return root2 < 0.0 ? kNoTip : r2 / (radius_mm + std::sqrt(root2));
  };
}

TipHeight pin_height(double diameter_mm, double edge_radius_mm) {
  return [=](double x, double y) {
    return flat_end(0.5 * diameter_mm - std::hypot(x, y), edge_radius_mm);
  };
}

TipHeight rectangles_height(std::vector<FlatRectangle> ends, double edge_radius_mm) {
  return [ends = std::move(ends), edge_radius_mm](double x, double y) {
    double lowest = kNoTip;
    for (const FlatRectangle& end : ends) {
      const double inside = std::min(0.5 * end.width_mm - std::fabs(x - end.x_mm),
                                     0.5 * end.length_mm - std::fabs(y - end.y_mm));
      lowest = std::min(lowest, flat_end(inside, edge_radius_mm));
    }
    return lowest;
  };
}

TipHeight dots_height(std::vector<Position> centres, double diameter_mm, double edge_radius_mm) {
  return [=, centres = std::move(centres)](double x, double y) {
    double nearest = kNoTip;
    for (const Position& centre : centres) {
      nearest = std::min(nearest, std::hypot(x - centre.x_mm, y - centre.y_mm));
    }
    return flat_end(0.5 * diameter_mm - nearest, edge_radius_mm);
  };
}

TipHeight wedge_height(double width_mm, double length_mm, double angle_deg, double edge_radius_mm) {
  return [=, slope = slope_of(angle_deg)](double x, double y) {
    if (std::fabs(x) > 0.5 * width_mm) return kNoTip;
    const double end = flat_end(0.5 * length_mm - std::fabs(y), edge_radius_mm);
    return rounded_ridge(std::fabs(x), slope, edge_radius_mm) + end;
  };
}

TipHeight cone_height(double diameter_mm, double angle_deg, double edge_radius_mm) {
  return [=, slope = slope_of(angle_deg)](double x, double y) {
    const double r = std::hypot(x, y);
    return r > 0.5 * diameter_mm ? kNoTip : rounded_ridge(r, slope, edge_radius_mm);
  };
}

TipHeight cylinder_height(double radius_mm, double length_mm) {
  return [=](double x, double y) {
    const bool beyond = std::fabs(x) > radius_mm || std::fabs(y) > 0.5 * length_mm;
    return beyond ? kNoTip : 0.5 / radius_mm * x * x;
  };
}

TipHeight map_height(const HeightMap& map) {
  return [map](double x, double y) {
    const PixelGrid& grid = map.grid;
    const double column = x / grid.pixel_mm + 0.5 * static_cast<double>(grid.columns - 1);
    const double row = y / grid.pixel_mm + 0.5 * static_cast<double>(grid.rows - 1);
    const double last_column = static_cast<double>(grid.columns - 1);
    const double last_row = static_cast<double>(grid.rows - 1);
    if (!(column >= -0.5 && column <= last_column + 0.5 && row >= -0.5 && row <= last_row + 0.5)) {
      return kNoTip;
    }
    const auto cell = [](double place, double last) {
      const double inside = std::clamp(place, 0.0, last);
      return std::pair(std::min(std::floor(inside), std::max(0.0, last - 1.0)), inside);
    };
    const auto [i, along_x] = cell(column, last_column);
    const auto [j, along_y] = cell(row, last_row);
    const auto nearest = [](double inside) {
      return static_cast<std::size_t>(std::floor(inside + 0.5));
    };
    const double here = map.height_mm[nearest(along_y) * grid.columns + nearest(along_x)];
    if (std::isinf(here)) return kNoTip;
    double sum = 0.0;
    for (std::size_t b = 0; b < 2; ++b) {
      for (std::size_t a = 0; a < 2; ++a) {
        const double wx = a == 0 ? 1.0 - (along_x - i) : along_x - i;
        const double wy = b == 0 ? 1.0 - (along_y - j) : along_y - j;
        if (wx * wy == 0.0) continue;
        const double corner = map.height_mm[(static_cast<std::size_t>(j) + b) * grid.columns +
                                            static_cast<std::size_t>(i) + a];
        // A wall stands at the border between two pixels.
        const bool wall = std::fabs(corner - here) > kRimRise * grid.pixel_mm;
        sum += wx * wy * (wall ? here : corner);
      }
    }
    return sum;
  };
}

TipHeight turned(TipHeight tip, double orientation_deg, double tilt_deg) {
  if (orientation_deg == 0.0 && tilt_deg == 0.0) return tip;
  const double c = std::cos(orientation_deg * kRadiansPerDegree);
  const double s = std::sin(orientation_deg * kRadiansPerDegree);
  return [=, slope = std::tan(tilt_deg * kRadiansPerDegree), tip = std::move(tip)](
             double x, double y) { return tip(c * x + s * y, c * y - s * x) + slope * x; };
}

TipHeight above_finger(TipHeight tip, double radius_along_mm, double radius_across_mm,
                       const Position& apex) {
  const double along = 1.0 / radius_along_mm;
  const double across = 1.0 / radius_across_mm;
  return [=, tip = std::move(tip)](double x, double y) {
    return tip(x, y) + along * x * (0.5 * x - apex.x_mm) + across * y * (0.5 * y - apex.y_mm);
  };
}

HeightMap height_map(const TipHeight& tip, const PixelGrid& grid) {
  HeightMap map{.grid = grid,
                .height_mm = std::vector<double>(grid.pixels(), kNoTip),
                .coverage = std::vector<double>(grid.pixels(), 0.0)};
  const double rise = kRimRise * grid.pixel_mm;
  for (std::size_t row = 0; row < grid.rows; ++row) {
    for (std::size_t column = 0; column < grid.columns; ++column) {
      const std::size_t i = row * grid.columns + column;
      const double x = grid.x_mm(column);
      const double y = grid.y_mm(row);
      double low = kNoTip;
      double high = 0.0;
      sample_pixel(tip, x, y, grid.pixel_mm, kCoarseSamples, [&](double height) {
        low = std::min(low, height);
        high = std::max(high, height);
      });
      if (std::isinf(low)) continue;
      if (high - low <= rise) {
        map.height_mm[i] = tip(x, y);
        map.coverage[i] = 1.0;
      } else {
        double sum = 0.0;
        int covered = 0;
        sample_pixel(tip, x, y, grid.pixel_mm, kFineSamples, [&](double height) {
          if (!(height - low <= rise)) return;
          sum += height;
          ++covered;
        });
        if (covered == 0) continue;
        map.height_mm[i] = sum / covered;
        map.coverage[i] = static_cast<double>(covered) / (kFineSamples * kFineSamples);
      }
    }
  }
  return map;
}

}  // namespace merkel
