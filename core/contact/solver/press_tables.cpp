#include "core/contact/solver/press_tables.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <queue>
#include <utility>

#include "core/contact/solver/rigid_contact.hpp"
#include "core/contact/solver/tip_heights.hpp"
#include "core/math/cubic_interpolation.hpp"

namespace merkel {
namespace {

constexpr double kPixelsPerEllipse = 48.0;  ///< across
constexpr double kMinMargin_mm = 6.0;
constexpr double kMaxMargin_mm = 10.0;
constexpr double kMaxMarginNodes = 150.0;  ///< where nodes are close, a smaller margin
constexpr RigidContact::Accuracy kTableAccuracy{.tolerance = 7e-4, .most_iterations = 300};

// Depths of tables.
constexpr double kFirstTables = 6.0;
constexpr std::size_t kMaxTables = 48;
constexpr double kShallowest_mm = 0.02;
constexpr double kForceMisfit = 0.006;
constexpr double kStressMisfit = 0.01;

double press_square(double x) { return x * x; }

/// Nodes over a contact and its margin: as many as fill the transform that the least margin needs.
std::size_t nodes_around(std::size_t contact, double node_mm) {
  const double half_mm = 0.5 * static_cast<double>(contact) * node_mm;
  std::size_t nodes =
      pixels_over(half_mm + std::min(kMinMargin_mm, kMaxMarginNodes * node_mm), node_mm);
  const std::size_t most = pixels_over(half_mm + kMaxMargin_mm, node_mm);
  const std::size_t room = padded_pixels(contact + nodes - 1);
  while (nodes + 2 <= most && contact + nodes + 1 <= room) nodes += 2;
  return nodes;
}

/// Stresses are compared by their distortion, which energy densities are made of.
double distortion(const CartesianStress& s) {
  return (press_square(s.sigma_x - s.sigma_y) + press_square(s.sigma_y - s.sigma_z) +
          press_square(s.sigma_z - s.sigma_x)) /
             6.0 +
         press_square(s.tau_xy) + press_square(s.tau_yz) + press_square(s.tau_zx);
}

/// How far the mean of two tables is from the one between them, in tolerances.
double misfit(const PressTables::Table& lower, const PressTables::Table& middle,
              const PressTables::Table& upper) {
  const double force = std::fabs(
      0.5 * (lower.force_mN_per_mm + upper.force_mN_per_mm) / middle.force_mN_per_mm - 1.0);
  double off = 0.0;
  double largest = 0.0;
  for (std::size_t i = 0; i < middle.nodes.size(); ++i) {
    CartesianStress mean = lower.nodes[i].stress();
    mean += upper.nodes[i].stress();
    const CartesianStress exact = middle.nodes[i].stress();
    CartesianStress difference = mean * 0.5;
    difference += exact * -1.0;
    off = std::max(off, distortion(difference));
    largest = std::max(largest, distortion(exact));
  }
  return std::max(force / kForceMisfit, std::sqrt(off / largest) / kStressMisfit);
}

/// Presses a tip to one depth after another.
class Presser {
 public:
  Presser(const PressedTip& tip, const LayeredMedium& medium, double receptor_depth_mm,
          PressTables& press);

  /// The table of a depth.
  PressTables::Table table(double depth_mm);

 private:
  struct Level {
    ContactPixels pixels;
    RigidContact solver;
  };
  /// The solver for depths of one octave.
  Level& level_of(double depth_mm);
  void touch(PressTables::Table& table);
  void solve(PressTables::Table& table);
  void deposit();

  const PressedTip& tip_;
  const LayeredMedium& medium_;
  double receptor_depth_mm_;
  PressTables& press_;
  PixelGrid loaded_;  ///< nodes on which the pressure is deposited
  PixelKernels kernels_;
  std::vector<GridSpectrum> fields_;
  GridSpectrum spectrum_;
  std::vector<double> image_;
  std::vector<double> loads_;
  std::vector<double> sharpened_;
  std::map<int, std::unique_ptr<Level>> levels_;
  ContactPixels contact_;  ///< of the last solution
  std::vector<double> pressure_;
};

/// Nodes over the contact, and those that a deposit needs around it.
PixelGrid nodes_of(const PressedTip& tip, double receptor_depth_mm) {
  const double node_mm = std::max(receptor_depth_mm / kNodesPerDepth,
                                  finest_pixel_mm(tip.half_width_mm, tip.half_length_mm));
  return {.pixel_mm = node_mm,
          .columns = pixels_over(tip.half_width_mm, node_mm) + 6,
          .rows = pixels_over(tip.half_length_mm, node_mm) + 6};
}

PixelGrid window_of(const PixelGrid& loaded) {
  return {.pixel_mm = loaded.pixel_mm,
          .columns = nodes_around(loaded.columns, loaded.pixel_mm),
          .rows = nodes_around(loaded.rows, loaded.pixel_mm)};
}

Presser::Presser(const PressedTip& tip, const LayeredMedium& medium, double receptor_depth_mm,
                 PressTables& press)
    : tip_(tip),
      medium_(medium),
      receptor_depth_mm_(receptor_depth_mm),
      press_(press),
      loaded_(nodes_of(tip, receptor_depth_mm)),
      kernels_(medium, receptor_depth_mm, loaded_, window_of(loaded_)),
      spectrum_(kernels_.transform().make_spectrum()),
      loads_(loaded_.pixels()),
      sharpened_(loaded_.pixels()) {
  press.grid = window_of(loaded_);
  image_.resize(press.grid.pixels());
  for (std::size_t f = 0; f < kPixelFields; ++f) {
    fields_.push_back(kernels_.kernel(static_cast<PixelField>(f)));
  }
}

Presser::Level& Presser::level_of(double depth_mm) {
  const int octave = tip_.proportional ? 0 : std::ilogb(tip_.deepest_mm / depth_mm);
  std::unique_ptr<Level>& level = levels_[octave];
  if (level) return *level;
  const ContactPixels pixels =
      contact_pixels(tip_, std::ldexp(tip_.deepest_mm, -octave), receptor_depth_mm_);
  const auto shifted = [middle = pixels.middle, &gap = tip_.gap](double x, double y) {
    return gap(middle.x_mm + x, middle.y_mm + y);
  };
  level = std::make_unique<Level>(
      Level{pixels, RigidContact(medium_, height_map(shifted, pixels.grid))});
  return *level;
}

void Presser::touch(PressTables::Table& table) {
  const HertzEllipse& ellipse = *tip_.ellipse;
  const double root = std::sqrt(table.depth_mm);
  const double across = 2.0 * std::min(ellipse.half_x(), ellipse.half_y());
  const double pixel = root * std::max(across / kPixelsPerEllipse,
                                       finest_pixel_mm(ellipse.half_x(), ellipse.half_y()));
  contact_ = {.grid = {.pixel_mm = pixel,
                       .columns = pixels_over(ellipse.half_x() * root, pixel),
                       .rows = pixels_over(ellipse.half_y() * root, pixel)},
              .middle = {}};
  pressure_.resize(contact_.grid.pixels());
  ellipse.fill(table.depth_mm, contact_.grid, pressure_);
  table.force_mN_per_mm = ellipse.force() * root;
  table.area_mm2 = std::numbers::pi * ellipse.half_x() * ellipse.half_y() * table.depth_mm;
  table.peak_pressure_kPa = ellipse.peak_pressure() * root;
}

void Presser::solve(PressTables::Table& table) {
  Level& level = level_of(table.depth_mm);
  const RigidContact::Solution solution = level.solver.press(table.depth_mm, kTableAccuracy);
  ++press_.solutions;
  press_.error = std::max(press_.error, solution.error);
  table.force_mN_per_mm = solution.force_mN / table.depth_mm;
  table.area_mm2 = solution.area_mm2;
  table.peak_pressure_kPa = solution.peak_pressure_kPa;
  contact_ = level.pixels;
  pressure_.assign(level.solver.pressure_kPa().begin(), level.solver.pressure_kPa().end());
}

/// Spreads the pressure over the nodes, so that its moments stay the same up to the third: the
/// second moment of a pixel is that of a node's own disc, less a part of the second differences.
void Presser::deposit() {
  const PixelGrid& grid = contact_.grid;
  const double share = press_square(grid.pixel_mm / loaded_.pixel_mm);
  std::fill(loads_.begin(), loads_.end(), 0.0);
  const auto place = [&](double at_mm, std::size_t count) {
    return at_mm / loaded_.pixel_mm + 0.5 * static_cast<double>(count - 1);
  };
  for (std::size_t row = 0; row < grid.rows; ++row) {
    const double y = place(contact_.middle.y_mm + grid.y_mm(row), loaded_.rows);
    const auto j = static_cast<std::size_t>(y);
    const auto along_y = cubic_weights(y - static_cast<double>(j));
    for (std::size_t column = 0; column < grid.columns; ++column) {
      const double pressure = pressure_[row * grid.columns + column];
      if (!(pressure > 0.0)) continue;
      const double x = place(contact_.middle.x_mm + grid.x_mm(column), loaded_.columns);
      const auto i = static_cast<std::size_t>(x);
      const auto along_x = cubic_weights(x - static_cast<double>(i));
      for (std::size_t b = 0; b < 4; ++b) {
        double* const to = loads_.data() + (j + b - 1) * loaded_.columns + i - 1;
        for (std::size_t a = 0; a < 4; ++a) to[a] += share * pressure * along_x[a] * along_y[b];
      }
    }
  }
  const double sharpen = 0.125 / std::numbers::pi - share / 24.0;
  const std::size_t columns = loaded_.columns;
  for (std::size_t at = 0; at < loads_.size(); ++at) {
    const std::size_t i = at % columns;
    const std::size_t j = at / columns;
    if (i == 0 || j == 0 || i + 1 == columns || j + 1 == loaded_.rows) continue;
    sharpened_[at] =
        loads_[at] - sharpen * (loads_[at - 1] + loads_[at + 1] + loads_[at - columns] +
                                loads_[at + columns] - 4.0 * loads_[at]);
  }
}

PressTables::Table Presser::table(double depth_mm) {
  PressTables::Table table{.depth_mm = depth_mm};
  tip_.ellipse ? touch(table) : solve(table);
  deposit();
  table.nodes.resize(press_.grid.pixels());
  kernels_.transform().forward(sharpened_, loaded_.columns, loaded_.rows, spectrum_);
  for (std::size_t f = 0; f < kPixelFields; ++f) {
    kernels_.transform().convolve(spectrum_, fields_[f], press_.grid.columns, press_.grid.rows,
                                  image_);
    for (std::size_t i = 0; i < image_.size(); ++i) {
      table.nodes[i].values[f] = static_cast<float>(image_[i] / depth_mm);
    }
  }
  if (depth_mm == tip_.deepest_mm) {
    press_.contact = contact_;
    press_.pressure_kPa = pressure_;
  }
  return table;
}

/// Two tables, and the one half-way between them in √d.
struct Interval {
  std::shared_ptr<PressTables::Table> lower, middle, upper;
  double misfit = 0.0;

  bool operator<(const Interval& other) const { return misfit < other.misfit; }
};

}  // namespace

PressTables press_tables(const PressedTip& tip, const LayeredMedium& medium,
                         double receptor_depth_mm) {
  PressTables press;
  Presser presser(tip, medium, receptor_depth_mm, press);
  using Shared = std::shared_ptr<PressTables::Table>;
  std::map<double, Shared> tables;
  const auto solved = [&](double depth_mm) {
    Shared& table = tables[depth_mm];
    if (!table) table = std::make_shared<PressTables::Table>(presser.table(depth_mm));
    return table;
  };
  PressTables::Table none;
  none.nodes.assign(press.grid.pixels(), GridNode{});
  tables[0.0] = std::make_shared<PressTables::Table>(std::move(none));
  std::priority_queue<Interval> intervals;
  const auto add = [&](Shared lower, Shared upper) {
    if (upper->depth_mm <= kShallowest_mm) return;
    Shared middle =
        solved(press_square(0.5 * (std::sqrt(lower->depth_mm) + std::sqrt(upper->depth_mm))));
    const double off = misfit(*lower, *middle, *upper);
    intervals.push({std::move(lower), std::move(middle), std::move(upper), off});
  };
  for (double k = 1.0; k <= kFirstTables && !tip.proportional; ++k) {
    const auto depth_mm = [&](double table) {
      return tip.deepest_mm * press_square(table / kFirstTables);
    };
    add(solved(depth_mm(k - 1.0)), solved(depth_mm(k)));
  }
  while (!intervals.empty() && intervals.top().misfit > 1.0 && tables.size() < kMaxTables) {
    const Interval worst = intervals.top();
    intervals.pop();
    add(worst.lower, worst.middle);
    add(worst.middle, worst.upper);
  }
  solved(tip.deepest_mm);
  press.tables.reserve(tables.size());
  for (const auto& [depth_mm, table] : tables) press.tables.push_back(std::move(*table));
  return press;
}

}  // namespace merkel
