#include "tools/studies/reference/superposition.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace merkel::reference {
namespace {

using std::numbers::pi;

/// Integrates several functions at the same points.
template <std::size_t kCount>
using Values = std::array<double, kCount>;

/// Tanh-sinh over [a, b] of a vector-valued f(x, distance to the nearer end).
template <std::size_t kCount, class Function>
Values<kCount> tanh_sinh(Function f, double a, double b, double tolerance) {
  const double half = 0.5 * (b - a);
  Values<kCount> sum{};
  Values<kCount> magnitude{};
  const auto add = [&](double t) {
    const double u = 0.5 * pi * std::sinh(t);
    const double weight = 0.5 * pi * std::cosh(t) / (std::cosh(u) * std::cosh(u));
    const double from_end = std::exp(-std::fabs(u)) / std::cosh(u);  // 1 − |tanh u|
    if (weight * half == 0.0 || from_end == 0.0) return;
    const double x = u < 0.0 ? a + half * from_end : b - half * from_end;
    const Values<kCount> values = f(x, half * from_end, u < 0.0);
    for (std::size_t i = 0; i < kCount; ++i) {
      sum[i] += weight * values[i];
      magnitude[i] += weight * std::fabs(values[i]);
    }
  };
  constexpr double kReach = 4.0;
  double step = 0.5;
  for (double t = -kReach; t <= kReach; t += step) add(t);
  Values<kCount> last{};
  for (int level = 0; level < 8; ++level) {
    Values<kCount> result{};
    bool settled = level > 0;
    for (std::size_t i = 0; i < kCount; ++i) {
      result[i] = half * step * sum[i];
      settled = settled && std::fabs(result[i] - last[i]) <= tolerance * half * step * magnitude[i];
    }
    if (settled) return result;
    last = result;
    for (double t = -kReach + 0.5 * step; t < kReach; t += step) add(t);
    step *= 0.5;
  }
  for (double& value : last) value = 0.0;
  for (std::size_t i = 0; i < kCount; ++i) last[i] = half * step * sum[i];
  return last;
}

/// Integrates p·kernel over the disc. The kernel receives the distance ρ from the point (r, 0) and
/// the direction ψ from it, and is smooth in asinh(ρ/scale).
template <std::size_t kCount, class Kernel>
Values<kCount> over_disc(double p0, double a, double r, double scale, double tolerance,
                         Kernel kernel) {
  // Along the ray ψ, the disc lies between the distances c − e and c + e.
  const auto along_ray = [&](double cos_psi, double sin2_psi) -> Values<kCount> {
    const double centre = -r * cos_psi;
    const double e2 = a * a - r * r * sin2_psi;
    if (e2 <= 0.0) return {};
    const double extent = std::sqrt(e2);
    const double far = centre + extent;
    const double near = std::max(0.0, centre - extent);
    if (far <= 0.0) return {};
    const double t_near = std::asinh(near / scale);
    const double t_far = std::asinh(far / scale);
    return tanh_sinh<kCount>(
        [&](double t, double from_end, bool at_near) {
          const double rho = scale * std::sinh(t);
          // a² − |source|² = (far − ρ)(ρ − near'), with the nearer difference free of cancellation:
          // sinh x − sinh y = 2·cosh((x+y)/2)·sinh((x−y)/2).
          const double to_far =
              at_near ? far - rho
                      : 2.0 * scale * std::cosh(t_far - 0.5 * from_end) * std::sinh(0.5 * from_end);
          const double from_near = r < a     ? rho - (centre - extent)
                                   : at_near ? 2.0 * scale * std::cosh(t_near + 0.5 * from_end) *
                                                   std::sinh(0.5 * from_end)
                                             : rho - near;
          const double p = p0 * std::sqrt(std::max(0.0, to_far * from_near)) / a;
          Values<kCount> values = kernel(rho, cos_psi, sin2_psi);
          const double area = rho * scale * std::cosh(t);
          for (double& value : values) value *= p * area;
          return values;
        },
        t_near, t_far, 0.1 * tolerance);
  };
  // ψ from 0 to π covers both halves by symmetry. Outside, only directions to the disc count.
  const double widest = r > a ? std::asin(a / r) : pi;
  Values<kCount> total = tanh_sinh<kCount>(
      [&](double, double from_end, bool near_start) {
        // ψ = π − θ, θ from 0 to `widest`; θ's distance from its own ends is exact.
        const double theta = near_start ? from_end : widest - from_end;
        return along_ray(-std::cos(theta), std::sin(theta) * std::sin(theta));
      },
      0.0, widest, tolerance);
  for (double& value : total) value *= 2.0;
  return total;
}

}  // namespace

double integrate(const std::function<double(double)>& f, double a, double b, double tolerance) {
  return tanh_sinh<1>([&](double x, double, bool) { return Values<1>{f(x)}; }, a, b, tolerance)[0];
}

Stress superposed_stress(double p0, double a, double nu, double r, double z, double tolerance) {
  const auto total = over_disc<4>(
      p0, a, r, z, tolerance, [nu, z](double rho, double cos_psi, double sin2_psi) -> Values<4> {
        const double R = std::hypot(rho, z);
        const double R5 = R * R * R * R * R;
        const double radial =
            ((1.0 - 2.0 * nu) / (R * (R + z)) - 3.0 * z * rho * rho / R5) / (2.0 * pi);
        const double hoop =
            -(1.0 - 2.0 * nu) * (1.0 / (R * (R + z)) - z / (R * R * R)) / (2.0 * pi);
        const double vertical = -3.0 * z * z * z / (2.0 * pi * R5);
        const double shear = -3.0 * rho * z * z / (2.0 * pi * R5);
        const double cos2 = cos_psi * cos_psi;
        // Seen from the source, the point lies in the direction opposite to ψ.
        return {radial * cos2 + hoop * sin2_psi, radial * sin2_psi + hoop * cos2, vertical,
                -shear * cos_psi};
      });
  return {total[0], total[1], total[2], total[3]};
}

double superposed_displacement_mm(double p0, double a, double E, double r) {
  // The kernel 1/ρ cancels the area's ρ; any length of the problem can be the scale.
  return over_disc<1>(p0, a, r, a, 1e-13, [E](double rho, double, double) -> Values<1> {
    return {1.0 / (pi * E * rho)};
  })[0];
}

}  // namespace merkel::reference
