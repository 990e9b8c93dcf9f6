// The gate rates and channels of the Hodgkin-Huxley neuron (Eq. 11-13, corrected) as vectors.
#if defined(CORE_NEURONS_HODGKIN_HUXLEY_RATES_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef CORE_NEURONS_HODGKIN_HUXLEY_RATES_INL_HPP
#undef CORE_NEURONS_HODGKIN_HUXLEY_RATES_INL_HPP
#else
#define CORE_NEURONS_HODGKIN_HUXLEY_RATES_INL_HPP
#endif

#include "core/neurons/hodgkin_huxley/kernel/hodgkin_huxley_kernel.hpp"
#include "core/simd/vector_math-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace merkel {
namespace HWY_NAMESPACE {

/// The constants, each broadcast to a vector once per call, before the loops.
template <class D>
struct VectorConstants {
  using Real = hn::TFromD<D>;
  using V = hn::Vec<D>;
  using Constants = NeuronConstants<Real>;

  HWY_INLINE explicit VectorConstants(const Constants& c)
      : one(set(Real(1))),
        half(set(Real(0.5))),
        highest(set(static_cast<Real>(Constants::kHalfRange_mV))),
        lowest(set(static_cast<Real>(-Constants::kHalfRange_mV))),
        offset(set(c.offset)),
        p_n_slope(set(c.p_n_slope)),
        p_n_at_centre(set(c.p_n_at_centre)),
        p_m_slope(set(c.p_m_slope)),
        p_m_at_centre(set(c.p_m_at_centre)),
        p_n_border(set(c.p_n_border)),
        p_m_border(set(c.p_m_border)),
        inverse_p_n(set(c.inverse_p_n)),
        inverse_p_m(set(c.inverse_p_m)),
        e_n(set(c.e_n)),
        e_m(set(c.e_m)),
        e_h(set(c.e_h)),
        beta_n(set(c.beta_n)),
        beta_m(set(c.beta_m)),
        alpha_h(set(c.alpha_h)),
        alpha_n_rate(set(c.alpha_n_rate)),
        alpha_m_rate(set(c.alpha_m_rate)),
        beta_h_rate(set(c.beta_h_rate)),
        g_L(set(c.g_L)),
        g_K(set(c.g_K)),
        g_Na(set(c.g_Na)),
        g_Ca(set(c.g_Ca)),
        gE_L(set(c.gE_L)),
        gE_K(set(c.gE_K)),
        gE_Na(set(c.gE_Na)),
        gE_Ca(set(c.gE_Ca)),
        capacitance_per_step(set(c.capacitance_per_step)),
        threshold(set(c.threshold)) {
    for (int k = 0; k < Constants::kTerms; ++k) b_series[k] = set(c.b_series[k]);
  }

  V one, half, highest, lowest;
  V offset, b_series[Constants::kTerms];
  V p_n_slope, p_n_at_centre, p_m_slope, p_m_at_centre;
  V p_n_border, p_m_border, inverse_p_n, inverse_p_m;
  V e_n, e_m, e_h, beta_n, beta_m, alpha_h, alpha_n_rate, alpha_m_rate, beta_h_rate;
  V g_L, g_K, g_Na, g_Ca, gE_L, gE_K, gE_Na, gE_Ca;
  V capacitance_per_step, threshold;

 private:
  static HWY_INLINE V set(Real value) { return hn::Set(D(), value); }
};

/// One gate's rates per step, over a common denominator: α·dt = p/D, (α+β)·dt = s/D, so that ẋ·dt =
/// (p − s·x)/D.
template <class X>
struct Fraction {
  X p;
  X s;
  X D;
};

template <class X>
struct RateFractions {
  Fraction<X> n;
  Fraction<X> m;
  Fraction<X> h;
};

/// The potential relative to the centre of its range, and e^{−w/720}.
template <class X>
struct Exponential {
  X w;
  X b;
};

/// The three gates.
template <class X>
struct GateValues {
  X n;
  X m;
  X h;
};

/// The Crank–Nicolson step of the gates, as fractions: x += change/denominator.
template <class X>
struct GateSteps {
  GateValues<X> change;
  GateValues<X> denominator;
};

/// Σ g and Σ g·E of all channels.
template <class X>
struct Channels {
  X conductance;
  X driven;
};

/// The right-hand sides of the neuron, for kCount vectors of D side by side.
template <class D, int kCount>
struct RightHandSide {
  using Real = hn::TFromD<D>;
  using Math = SideBySide<D, kCount>;
  using V = hn::Vec<D>;
  using X = VectorPack<D, kCount>;
  using Constants = NeuronConstants<Real>;

  static constexpr bool kDouble = sizeof(Real) == 8;

  /// Adds the inflow from the four neighbours to `driven`, for the neurons from i on.
  static HWY_INLINE X add_inflow(const CouplingArguments<Real>& net, int seen, std::size_t i,
                                 X driven) {
    const Real* const seen_V = net.seen[seen] + i;
    const auto flows_in = [&](const Real* conductances, std::ptrdiff_t offset) HWY_ATTR {
      driven = Math::fused(Math::load(conductances + i), Math::load(seen_V + offset), driven);
    };
    flows_in(net.from_previous_column, -1);
    flows_in(net.from_next_column, 1);
    flows_in(net.from_previous_row, -net.columns);
    flows_in(net.from_next_row, net.columns);
    return driven;
  }

  /// Replaces numerator and denominator of rate·x/(eˣ−1) near x = 0, where both vanish, by rate and
  /// 1 + x/2 + x²/6 + x³/24.
  static HWY_INLINE void extend_linoid(const X& x, V rate, Fraction<X>& gate) {
    constexpr double kSeries[] = {1.0, 1.0 / 2, 1.0 / 6, 1.0 / 24};
    const auto near = Math::less(Math::abs(x), Math::constant(kLinoidBorder<Real>));
    gate.p = Math::select(near, rate, gate.p);
    gate.D = Math::select(near, Math::polynomial(x, kSeries), gate.D);
  }

  /// w and b of NeuronConstants: the exponential that all rates share.
  static HWY_INLINE Exponential<X> shared_exponential(const X& potential,
                                                      const VectorConstants<D>& c) {
    Exponential<X> e;  // filled in place: compilers keep copied members on the stack
    e.w = Math::max(Math::min(Math::sub(potential, c.offset), c.highest), c.lowest);
    e.b = Math::fused(e.w, c.b_series[Constants::kTerms - 1], c.b_series[Constants::kTerms - 2]);
    for (int k = Constants::kTerms - 3; k >= 0; --k) e.b = Math::fused(e.b, e.w, c.b_series[k]);
    return e;
  }

  /// All rates from the powers of the shared exponential.
  static HWY_INLINE RateFractions<X> shared_rates(const Exponential<X>& exponential,
                                                  const VectorConstants<D>& c) {
    const auto& [w, b] = exponential;
    const X b2 = Math::mul(b, b);
    const X b4 = Math::mul(b2, b2);
    const X b9 = Math::mul(Math::mul(b4, b4), b);
    const X b18 = Math::mul(b9, b9);
    const X b36 = Math::mul(b18, b18);
    const X b40 = Math::mul(b36, b4);
    const X b72 = Math::mul(b36, b36);

    const V minus_one = hn::Neg(c.one);
    RateFractions<X> r;
    r.n.p = Math::fused(w, c.p_n_slope, c.p_n_at_centre);
    r.m.p = Math::fused(w, c.p_m_slope, c.p_m_at_centre);
    r.n.D = Math::fused(b72, c.e_n, minus_one);
    r.m.D = Math::fused(b72, c.e_m, minus_one);
    // In double precision, few potentials are near a singularity; in single precision, many are.
    if (!kDouble ||
        HWY_UNLIKELY(Math::any(Math::either(Math::less(Math::abs(r.n.p), c.p_n_border),
                                            Math::less(Math::abs(r.m.p), c.p_m_border))))) {
      extend_linoid(Math::mul(r.n.p, c.inverse_p_n), c.alpha_n_rate, r.n);
      extend_linoid(Math::mul(r.m.p, c.inverse_p_m), c.alpha_m_rate, r.m);
    }
    r.n.s = Math::fused(Math::mul(b9, c.beta_n), r.n.D, r.n.p);
    r.m.s = Math::fused(Math::mul(b40, c.beta_m), r.m.D, r.m.p);
    r.h.D = Math::fused(b72, c.e_h, c.one);
    r.h.p = Math::mul(Math::mul(b36, c.alpha_h), r.h.D);
    r.h.s = Math::add(r.h.p, c.beta_h_rate);
    return r;
  }

  /// The same with a separate exponential for each of the six rates: any slopes, any potential.
  static HWY_INLINE RateFractions<X> general_rates(const X& potential,
                                                   const NeuronConstants<Real>& c) {
    const auto set = [](Real value) HWY_ATTR { return hn::Set(D(), value); };
    const auto over_slope = [&](Real shift, Real inverse) HWY_ATTR {
      return Math::mul(Math::sub(set(shift), potential), set(inverse));
    };
    const auto decaying = [&](Real rate, Real inverse) HWY_ATTR {
      return Math::mul(Math::exponential(over_slope(c.V_rest, inverse)), set(rate));
    };
    const auto opening = [&](Real shift, Real inverse, Real rate, Real beta_rate,
                             Real beta_inverse) HWY_ATTR {
      Fraction<X> gate;
      const X x = over_slope(shift, inverse);
      gate.p = Math::mul(x, set(rate));
      gate.D = Math::sub(Math::exponential(x), set(Real(1)));
      extend_linoid(x, set(rate), gate);
      gate.s = Math::fused(decaying(beta_rate, beta_inverse), gate.D, gate.p);
      return gate;
    };
    RateFractions<X> r;
    r.n = opening(c.n_shift, c.n_inverse, c.alpha_n_rate, c.beta_n_rate, c.beta_n_inverse);
    r.m = opening(c.m_shift, c.m_inverse, c.alpha_m_rate, c.beta_m_rate, c.beta_m_inverse);
    r.h.D = Math::add(Math::exponential(over_slope(c.h_shift, c.h_inverse)), set(Real(1)));
    r.h.p = Math::mul(decaying(c.alpha_h_rate, c.alpha_h_inverse), r.h.D);
    r.h.s = Math::add(r.h.p, set(c.beta_h_rate));
    return r;
  }

  /// All rates.
  /// \param kShared  whether the neuron's slopes allow the shared exponential
  template <bool kShared>
  static HWY_INLINE RateFractions<X> rates(const X& potential, const VectorConstants<D>& c,
                                           const NeuronConstants<Real>& constants) {
    if constexpr (kShared) {
      return shared_rates(shared_exponential(potential, c), c);
    } else {
      return general_rates(potential, constants);
    }
  }
  /// The same, chosen at run time.
  static HWY_INLINE RateFractions<X> rates(const X& potential, const VectorConstants<D>& c,
                                           const NeuronConstants<Real>& constants) {
    return constants.shared_exponential ? rates<true>(potential, c, constants)
                                        : rates<false>(potential, c, constants);
  }

  static HWY_INLINE Channels<X> channels(const GateValues<X>& gates, const VectorConstants<D>& c) {
    const auto& [n, m, h] = gates;
    const X m2 = Math::mul(m, m);
    const X mh = Math::mul(m, h);
    const X n2 = Math::mul(n, n);
    const X n4 = Math::mul(n2, n2);
    return {Math::fused(mh, Math::fused(m2, c.g_Na, c.g_Ca), Math::fused(n4, c.g_K, c.g_L)),
            Math::fused(mh, Math::fused(m2, c.gE_Na, c.gE_Ca), Math::fused(n4, c.gE_K, c.gE_L))};
  }

  static HWY_INLINE GateValues<X> load_gates(const HodgkinHuxleyArguments<Real>& a, std::size_t i) {
    return {.n = Math::load(a.n + i), .m = Math::load(a.m + i), .h = Math::load(a.h + i)};
  }
  static HWY_INLINE void store_gates(const GateValues<X>& gates,
                                     const HodgkinHuxleyArguments<Real>& a, std::size_t i) {
    Math::store(gates.n, a.n + i);
    Math::store(gates.m, a.m + i);
    Math::store(gates.h, a.h + i);
  }

  /// (p − s·x)/(D + s·implicit) of each gate.
  static HWY_INLINE GateSteps<X> gate_steps(const RateFractions<X>& r, const GateValues<X>& x,
                                            V implicit) {
    return {.change = {.n = Math::fused_negative(r.n.s, x.n, r.n.p),
                       .m = Math::fused_negative(r.m.s, x.m, r.m.p),
                       .h = Math::fused_negative(r.h.s, x.h, r.h.p)},
            .denominator = {.n = Math::fused(r.n.s, implicit, r.n.D),
                            .m = Math::fused(r.m.s, implicit, r.m.D),
                            .h = Math::fused(r.h.s, implicit, r.h.D)}};
  }

  /// 1/x of three values with a single division.
  static HWY_INLINE GateValues<X> inverses(const GateValues<X>& x, V one) {
    const auto& [n, m, h] = x;
    const X nm = Math::mul(n, m);
    const X inverse = Math::div(one, Math::mul(nm, h));
    const X inverse_nm = Math::mul(inverse, h);
    return {
        .n = Math::mul(inverse_nm, m), .m = Math::mul(inverse_nm, n), .h = Math::mul(inverse, nm)};
  }

  /// Σ g and Σ g·E + I of the neurons from i on, including the inflow from their neighbours.
  template <bool kCoupled>
  static HWY_INLINE Channels<X> driven_channels(const HodgkinHuxleyArguments<Real>& a,
                                                const VectorConstants<D>& c, std::size_t i, V phase,
                                                int seen, const GateValues<X>& gates) {
    Channels<X> open = channels(gates, c);
    open.driven = Math::add(open.driven, Math::fused(Math::load(a.input_change + i), phase,
                                                     Math::load(a.input_begin + i)));
    if constexpr (kCoupled) open.driven = add_inflow(a.coupling, seen, i, open.driven);
    return open;
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace merkel
HWY_AFTER_NAMESPACE();

#endif
