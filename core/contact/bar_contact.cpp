#include "core/contact/bar_contact.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <Eigen/Dense>

namespace merkel {
namespace {

using std::numbers::pi;

/// One bar's share of the unknowns: the line loads at its Gauss-Chebyshev nodes.
struct Bar {
  double centre;
  double half_width;
  int nodes;
  Eigen::Index first;  ///< index of its first load

  [[nodiscard]] double angle(int node) const { return pi * (node + 0.5) / nodes; }
  [[nodiscard]] double x(int node) const { return centre + half_width * std::cos(angle(node)); }
};

/// −∫ ln|x−ξ| times the interpolated pressure of a bar, at its own node `at`, for a unit load at
/// its node `of`.
double own_logarithm(const Bar& bar, int at, int of) {
  // The pressure of a unit load is Σ_k c_k T_k/√(1−t²) with c_k = (2−δ_k0)·cos(kθ)/(π·half_width),
  // and ∫ ln|t'−t|·T_k(t)/√(1−t²) dt = −π·ln 2 for k = 0, −π·T_k(t')/k else.
  double sum = std::numbers::ln2 - std::log(bar.half_width);
  for (int k = 1; k < bar.nodes; ++k) {
    sum += 2.0 * std::cos(k * bar.angle(of)) * std::cos(k * bar.angle(at)) / k;
  }
  return sum;
}

/// The error of the rule at the distance z falls as e^{−2n·asinh(z/half_width)}. Returns n for an
/// error of 1e-8.
int nodes_of(double half_width_mm, double finest_mm) {
  const double wanted = std::ceil(9.3 / std::asinh(finest_mm / half_width_mm));
  return static_cast<int>(std::clamp(wanted, 12.0, 64.0));
}

}  // namespace

std::size_t BarTip::loads(double finest_mm) const noexcept {
  return std::accumulate(widths_mm.begin(), widths_mm.end(), std::size_t{0},
                         [=](std::size_t sum, double width) {
                           return sum + static_cast<std::size_t>(nodes_of(0.5 * width, finest_mm));
                         });
}

FieldTable BarTip::fields() {
  static constexpr Field kFields[] = {
      {"bar_widths_mm", "mm", positive(100.0), "width of each bar, along x",
       at<&BarTip::widths_mm>},
      {"bar_gaps_mm", "mm", positive(100.0), "gap between neighbouring bars, one fewer than bars",
       at<&BarTip::gaps_mm>},
      {"bar_length_mm", "mm", positive(1e3), "length of the bars, along y",
       at<&BarTip::length_mm>}};
  return {"probe", kFields};
}

Expected<void, ParameterError> BarTip::check() const {
  ParameterCheck all;
  all.require(!widths_mm.empty() && widths_mm.size() <= kMostBars, "probe.bar_widths_mm",
              "must list from 1 to 40 widths")
      .require(gaps_mm.size() + 1 == std::max<std::size_t>(widths_mm.size(), 1),
               "probe.bar_gaps_mm", "must list one gap fewer than there are bars");
  for (const double gap : gaps_mm) {
    all.require(gap > 0.0 && std::isfinite(gap), "probe.bar_gaps_mm",
                "must be positive: merge bars that touch or overlap, or widen the gap");
  }
  return all.fields(*this).result();
}

double BarTip::total_width_mm() const noexcept {
  return std::accumulate(widths_mm.begin(), widths_mm.end(), 0.0) +
         std::accumulate(gaps_mm.begin(), gaps_mm.end(), 0.0);
}

double BarTip::centre_mm(std::size_t bar) const noexcept {
  double x = -0.5 * total_width_mm();
  for (std::size_t i = 0; i < bar; ++i) x += widths_mm[i] + gaps_mm[i];
  return x + 0.5 * widths_mm[bar];
}

BarContact BarContact::solve(const BarTip& tip, double reduced_modulus_kPa, double finest_mm) {
  std::vector<Bar> bars;
  Eigen::Index unknowns = 0;
  for (std::size_t i = 0; i < tip.widths_mm.size(); ++i) {
    const double half_width = 0.5 * tip.widths_mm[i];
    const int nodes = nodes_of(half_width, finest_mm);
    bars.push_back({tip.centre_mm(i), half_width, nodes, unknowns});
    unknowns += nodes;
  }

  const double c = 0.5 * tip.length_mm;
  Eigen::MatrixXd matrix(unknowns, unknowns);
  for (const Bar& at : bars) {
    for (int i = 0; i < at.nodes; ++i) {
      for (const Bar& of : bars) {
        for (int j = 0; j < of.nodes; ++j) {
          const double s = at.x(i) - of.x(j);
          // asinh(c/|s|) = ln(c+√(c²+s²)) − ln|s|
          const double kernel = &at == &of
                                    ? std::log(c + std::hypot(c, s)) + own_logarithm(of, i, j)
                                    : std::asinh(c / std::fabs(s));
          matrix(at.first + i, of.first + j) = 2.0 / (pi * reduced_modulus_kPa) * kernel;
        }
      }
    }
  }
  const Eigen::VectorXd loads = matrix.partialPivLu().solve(Eigen::VectorXd::Ones(unknowns));

  BarContact contact;
  for (const Bar& bar : bars) {
    for (int i = 0; i < bar.nodes; ++i) {
      contact.loads.push_back({.x_mm = bar.x(i),
                               .half_length_mm = c,
                               .force_per_length_mN_per_mm = loads(bar.first + i)});
      contact.force_mN_per_mm += loads(bar.first + i) * tip.length_mm;
    }
  }
  return contact;
}

}  // namespace merkel
