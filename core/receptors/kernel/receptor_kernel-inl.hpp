// Stress and energy density at many receptors (Eq. 3-5, corrected), and their currents (Eq. 7).
#if defined(CORE_AFFERENT_KERNEL_RECEPTOR_KERNEL_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef CORE_AFFERENT_KERNEL_RECEPTOR_KERNEL_INL_HPP
#undef CORE_AFFERENT_KERNEL_RECEPTOR_KERNEL_INL_HPP
#else
#define CORE_AFFERENT_KERNEL_RECEPTOR_KERNEL_INL_HPP
#endif

#include "core/receptors/kernel/receptor_kernel.hpp"
#include "core/simd/vector_math-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

/// The terms of Huber's closed form at kCount vectors of receptors, in units of p0. With
/// k = a²/(a²+u) and g = 1−t, the stresses of huber_stress.hpp are
/// σr = A + X − s((1−ν)k + (1+ν)g), σθ = −A + s((1−ν)k − (1+ν)g), σz = −X, τrz = −r·T.
template <class X>
struct HuberTerms {
  X A;
  X X_;
  X sc1k;  ///< s·(1−ν)·k
  X sc2g;  ///< s·(1+ν)·g
  X T;     ///< τrz = −r·T
  X r2;
  X dx;
  X dy;
};

template <class D, int kCount>
struct Receptors {
  using Real = hn::TFromD<D>;
  using Math = SideBySide<D, kCount>;
  using V = hn::Vec<D>;
  using X = VectorPack<D, kCount>;

  static HWY_INLINE V set(Real value) { return hn::Set(D(), value); }

  /// (1 − atan(y)/y)/y² as a function of y² in [0, 1]: Chebyshev interpolation, error 3e-17
  /// (double) and 2e-9 (float).
  static HWY_INLINE X arctangent_rest(const X& y2) {
    if constexpr (sizeof(Real) == 8) {
      constexpr double kRest[] = {
          0.3333333333333333,    -0.19999999999999554,   0.14285714285648404,
          -0.11111111107234799,  0.09090908969557403,    -0.07692305354678655,
          0.06666636435777692,   -0.05882074956371294,   0.05261265735709454,
          -0.04752086773576656,  0.04308119655330471,    -0.03872640214042632,
          0.033750132001619734,  -0.027567942297344678,  0.020238706986393514,
          -0.012756172907694298, 0.006575683344151699,   -0.002622977891906089,
          0.0007518472526973822, -0.0001368724853148122, 1.1832505417555692e-05};
      return Math::polynomial(y2, kRest);
    } else {
      constexpr double kRest[] = {
          0.3333333173306352,   -0.1999973932983558,   0.14278568748210602,
          -0.11033764115313455, 0.08656880430154522,   -0.06250169444749563,
          0.03587153898204336,  -0.013507771427020535, 0.002386997316724113};
      return Math::polynomial(y2, kRest);
    }
  }

  static HWY_INLINE HuberTerms<X> huber(const SphereField<Real>& f, const X& x, const X& y) {
    HuberTerms<X> h;
    h.dx = Math::sub(x, set(f.x));
    h.dy = Math::sub(y, set(f.y));
    h.r2 = Math::fused(h.dx, h.dx, Math::mul(h.dy, h.dy));
    const V one = set(Real(1));
    const X B = Math::add(h.r2, set(f.z2_minus_a2));
    const X root_D = Math::sqrt(Math::fused(B, B, set(Real(4) * f.a2_z2)));
    // u and w satisfy u·w = a²z² and u−w = B: the larger from a sum, the other from a quotient.
    const X larger = Math::mul(Math::add(root_D, Math::abs(B)), set(Real(0.5)));
    const X smaller = Math::div(set(f.a2_z2), larger);
    const X u = Math::select(Math::less(set(Real(0)), B), larger, smaller);
    const X root_u = Math::sqrt(u);
    const X s = Math::div(set(f.z), root_u);
    const X s2 = Math::mul(s, s);
    const X a2_plus_u = Math::add(u, set(f.a2));
    const X one_plus_s = Math::add(s, one);
    // 1/D, 1/(a²+u) and 1/(1+s) with one division.
    const X root_and_s = Math::mul(root_D, one_plus_s);
    const X inverse = Math::div(one, Math::mul(root_and_s, a2_plus_u));
    const X k = Math::mul(Math::mul(inverse, root_and_s), set(f.a2));
    const X inverse_D_s = Math::mul(inverse, a2_plus_u);
    const X inverse_D = Math::mul(inverse_D_s, one_plus_s);
    const X inverse_one_plus_s = Math::mul(inverse_D_s, root_D);

    // g = 1 − atan(y)/y with y = a/√u, from the polynomial in y² or, beyond 1, in 1/y².
    const X y2 = Math::mul(s2, set(f.a_over_z2));
    const X v = Math::mul(root_u, set(f.inverse_a));
    const X v2 = Math::mul(v, v);
    const X rest = arctangent_rest(Math::min(y2, v2));
    const X beyond =
        Math::fused_negative(v, set(Real(1.57079632679489661923)),
                             Math::fused(v2, Math::fused_negative(v2, rest, one), one));
    const X g = Math::select(Math::less(y2, one), Math::mul(y2, rest), beyond);

    h.X_ = Math::mul(Math::mul(s2, s), Math::mul(inverse_D, set(f.a2)));
    h.A = Math::mul(Math::mul(k, set(f.third)), Math::add(s, inverse_one_plus_s));
    h.sc1k = Math::mul(Math::mul(s, k), set(f.one_minus_nu));
    h.sc2g = Math::mul(Math::mul(s, g), set(f.one_plus_nu));
    h.T = Math::mul(Math::mul(s2, root_u), Math::mul(k, inverse_D));
    return h;
  }

  static HWY_INLINE X energy(const SphereField<Real>& f, const X& x, const X& y) {
    const HuberTerms<X> h = huber(f, x, y);
    const X r_theta = Math::add(Math::add(h.A, h.A), Math::sub(h.X_, Math::add(h.sc1k, h.sc1k)));
    const X theta_z = Math::add(Math::sub(h.X_, h.A), Math::sub(h.sc1k, h.sc2g));
    const X z_r = Math::sub(Math::add(h.sc1k, h.sc2g), Math::add(Math::add(h.X_, h.X_), h.A));
    const X shear2 = Math::mul(h.r2, Math::mul(h.T, h.T));
    X sum = Math::mul(shear2, set(Real(6)));
    sum = Math::fused(r_theta, r_theta, sum);
    sum = Math::fused(theta_z, theta_z, sum);
    sum = Math::fused(z_r, z_r, sum);
    const X trace = Math::add(h.sc2g, h.sc2g);
    return Math::fused(Math::mul(trace, trace), set(f.volumetric),
                       Math::mul(sum, set(f.distortional)));
  }

  static HWY_INLINE void add_stress(const SphereField<Real>& f, const X& x, const X& y,
                                    const StressArrays<Real>& sums, std::size_t i) {
    const HuberTerms<X> h = huber(f, x, y);
    const V p0 = set(f.p0);
    const V minus_p0 = set(-f.p0);
    const X sigma_r = Math::mul(Math::sub(Math::add(h.A, h.X_), Math::add(h.sc1k, h.sc2g)), p0);
    const X sigma_theta = Math::mul(Math::sub(Math::sub(h.sc1k, h.sc2g), h.A), p0);
    // On the axis, the direction is arbitrary: cos² = 1.
    const V one = set(Real(1));
    const X inverse_r2 = Math::div(one, Math::max(h.r2, set(Real(1e-30))));
    const auto off_axis = Math::less(set(Real(1e-30)), h.r2);
    const X xx = Math::select(off_axis, Math::mul(Math::mul(h.dx, h.dx), inverse_r2), one);
    const X yy = Math::sub(one, xx);
    const X xy = Math::select(off_axis, Math::mul(Math::mul(h.dx, h.dy), inverse_r2), set(Real(0)));
    const X shear = Math::mul(h.T, minus_p0);
    const auto add = [&](Real* sum, const X& value)
                         HWY_ATTR { Math::store(Math::add(Math::load(sum + i), value), sum + i); };
    add(sums.sigma_x, Math::fused(sigma_r, xx, Math::mul(sigma_theta, yy)));
    add(sums.sigma_y, Math::fused(sigma_r, yy, Math::mul(sigma_theta, xx)));
    add(sums.sigma_z, Math::mul(h.X_, minus_p0));
    add(sums.tau_xy, Math::mul(Math::sub(sigma_r, sigma_theta), xy));
    add(sums.tau_yz, Math::mul(shear, h.dy));
    add(sums.tau_zx, Math::mul(shear, h.dx));
  }

  static HWY_INLINE X energy_of(const StressArrays<Real>& sums, std::size_t i, Real distortional,
                                Real volumetric) {
    const X sx = Math::load(sums.sigma_x + i);
    const X sy = Math::load(sums.sigma_y + i);
    const X sz = Math::load(sums.sigma_z + i);
    const X xy = Math::load(sums.tau_xy + i);
    const X yz = Math::load(sums.tau_yz + i);
    const X zx = Math::load(sums.tau_zx + i);
    const X d_xy = Math::sub(sx, sy);
    const X d_yz = Math::sub(sy, sz);
    const X d_zx = Math::sub(sz, sx);
    X sum = Math::mul(Math::fused(xy, xy, Math::fused(yz, yz, Math::mul(zx, zx))), set(Real(6)));
    sum = Math::fused(d_xy, d_xy, sum);
    sum = Math::fused(d_yz, d_yz, sum);
    sum = Math::fused(d_zx, d_zx, sum);
    const X trace = Math::add(sx, Math::add(sy, sz));
    return Math::fused(Math::mul(trace, trace), set(volumetric), Math::mul(sum, set(distortional)));
  }
};

/// Calls work(count, i) for [first, last): two vectors at a time, then one.
template <class Real, class Work>
HWY_INLINE void over_receptors(const ReceptorArguments<Real>& a, const Work& work) {
  const hn::ScalableTag<Real> d;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t i = a.first;
  for (; i + lanes < a.last; i += 2 * lanes) {
    work(std::integral_constant<int, 2>(), i);
  }
  for (; i < a.last; i += lanes) work(std::integral_constant<int, 1>(), i);
}

template <class Real>
HWY_INLINE void sphere_energy_all(const SphereField<Real>& field,
                                  const ReceptorArguments<Real>& a) {
  const SphereField<Real> f = field;
  over_receptors(a, [&](auto count, std::size_t i) HWY_ATTR {
    using R = Receptors<hn::ScalableTag<Real>, decltype(count)::value>;
    R::Math::store(R::energy(f, R::Math::load(a.x + i), R::Math::load(a.y + i)), a.energy + i);
  });
}

template <class Real>
HWY_INLINE void add_stress_all(const SphereField<Real>& field, const ReceptorArguments<Real>& a,
                               const StressArrays<Real>& sums) {
  const hn::ScalableTag<Real> d;
  using R = Receptors<hn::ScalableTag<Real>, 1>;
  for (std::size_t i = a.first; i < a.last; i += hn::Lanes(d)) {
    R::add_stress(field, R::Math::load(a.x + i), R::Math::load(a.y + i), sums, i);
  }
}

template <class Real>
HWY_INLINE void stress_energy_all(const StressArrays<Real>& sums, const ReceptorArguments<Real>& a,
                                  double distortional, double volumetric) {
  const hn::ScalableTag<Real> d;
  using R = Receptors<hn::ScalableTag<Real>, 1>;
  for (std::size_t i = a.first; i < a.last; i += hn::Lanes(d)) {
    R::Math::store(
        R::energy_of(sums, i, static_cast<Real>(distortional), static_cast<Real>(volumetric)),
        a.energy + i);
  }
}

template <class Real>
HWY_INLINE void sigmoid_all(const SigmoidConstants<Real>& sigmoid, const ReceptorArguments<Real>& a,
                            Real* current) {
  const SigmoidConstants<Real> c = sigmoid;
  over_receptors(a, [&](auto count, std::size_t i) HWY_ATTR {
    using R = Receptors<hn::ScalableTag<Real>, decltype(count)::value>;
    using Math = typename R::Math;
    const auto e = Math::exponential(
        Math::fused_negative(Math::load(a.energy + i), R::set(c.gamma), R::set(c.gamma_lambda)));
    Math::store(Math::div(R::set(c.alpha), Math::add(e, R::set(Real(1)))), current + i);
  });
}

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#endif
