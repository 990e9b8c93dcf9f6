#include "tools/studies/score/skin_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>

#include "core/contact/tip_contact.hpp"
#include "drivers/protocols/trace_file.hpp"

namespace merkel {
namespace {

constexpr std::size_t kMinSamples = 4;

/// ∫ F dd along samples by the trapezoidal rule, mN·mm.
double work_of(const std::vector<ForceAtDepth>& samples) {
  double work = 0.0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    work += 0.5 * (samples[i].force_mN + samples[i - 1].force_mN) *
            (samples[i].depth_mm - samples[i - 1].depth_mm);
  }
  return work;
}

/// p = ln E0, and b = 1/d1 or 1/p1.
struct Solution {
  double p = 0.0;
  double b = 0.0;
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

/// The force of each sample under one of the two laws of stiffening.
struct StiffeningLaw {
  bool by_pressure = false;
  Eigen::VectorXd depth_mm;
  Eigen::VectorXd shape_mm2;  ///< F/E* in skin at rest
  Eigen::VectorXd area_mm2;   ///< in contact

  /// The moduli over those at rest. The recording may show skin that softens: b < 0.
  [[nodiscard]] Eigen::ArrayXd growth(double p, double b) const {
    if (!by_pressure) return (b * depth_mm).array().exp();
    return (1.0 - b * rest_kPa(p)).max(1.0 / SkinParameters::kMaxStiffening).inverse();
  }
  [[nodiscard]] Eigen::VectorXd force_mN(double p, double b) const {
    return std::exp(p) * shape_mm2.array() * growth(p, b);
  }
  /// d(ln F)/dp and d(ln F)/db.
  [[nodiscard]] Eigen::MatrixXd slopes(double p, double b) const {
    Eigen::MatrixXd found(depth_mm.size(), 2);
    if (by_pressure) {
      found.col(0) = growth(p, b);
      found.col(1) = growth(p, b) * rest_kPa(p);
    } else {
      found.col(0).setOnes();
      found.col(1) = depth_mm;
    }
    return found;
  }

 private:
  [[nodiscard]] Eigen::ArrayXd rest_kPa(double p) const {
    return std::exp(p) * shape_mm2.array() / area_mm2.array();
  }
};

/// Residuals of forces. The error of a force is `kRelativeError` of it and, for small forces, the
/// noise of the load cell: g(F) = asinh(F/F0) has a constant error if the error of F is
/// proportional to √(F0² + F²). It is the logarithm far above F0, linear below, and defined for
/// negative readings (noise).
class Residuals {
 public:
  /// \param floor_mN  F0
  explicit Residuals(double floor_mN) : floor_mN_(floor_mN) {}

  [[nodiscard]] Eigen::VectorXd of(const Eigen::VectorXd& force,
                                   const Eigen::VectorXd& model) const {
    return (force.array() / floor_mN_).asinh() - (model.array() / floor_mN_).asinh();
  }
  /// dg/d(ln F).
  [[nodiscard]] Eigen::VectorXd slope(const Eigen::VectorXd& model) const {
    return model.array() / (model.array().square() + floor_mN_ * floor_mN_).sqrt();
  }

 private:
  double floor_mN_;
};

/// The number of samples over the number of independent samples, from the correlation of
/// neighbouring residuals.
double repetition(const Eigen::VectorXd& residuals) {
  const Eigen::Index n = residuals.size();
  const double squares = residuals.squaredNorm();
  if (n < 8 || !(squares > 0.0)) return 1.0;
  const double correlation =
      std::clamp(residuals.head(n - 1).dot(residuals.tail(n - 1)) / squares, 0.0, 0.999);
  return std::min((1.0 + correlation) / (1.0 - correlation), static_cast<double>(n) / 4.0);
}

Solution solve(const StiffeningLaw& law, const Eigen::VectorXd& force, const Residuals& residuals,
               bool stiffens) {
  Solution at;
  at.p = std::log(force.dot(law.shape_mm2) / law.shape_mm2.squaredNorm());
  Eigen::Matrix2d curvature = Eigen::Matrix2d::Identity();
  for (int round = 0; round < 60; ++round) {
    const Eigen::VectorXd now = law.force_mN(at.p, at.b);
    const Eigen::VectorXd missing = residuals.of(force, now);
    Eigen::MatrixXd slopes = residuals.slope(now).asDiagonal() * law.slopes(at.p, at.b);
    if (!stiffens) slopes.col(1).setZero();
    curvature = slopes.transpose() * slopes;
    if (!stiffens) curvature(1, 1) = 1.0;
    const Eigen::Vector2d step = curvature.ldlt().solve(slopes.transpose() * missing);
    // Halve the step until the sum of squares falls.
    double share = 1.0;
    while (share > 1e-6 &&
           residuals.of(force, law.force_mN(at.p + share * step(0), at.b + share * step(1)))
                   .squaredNorm() > missing.squaredNorm()) {
      share *= 0.5;
    }
    at.p += share * step(0);
    at.b += share * step(1);
    if (share * step.norm() < 1e-10) break;
  }
  const Eigen::VectorXd missing = residuals.of(force, law.force_mN(at.p, at.b));
  const double freedom = static_cast<double>(force.size()) - (stiffens ? 2.0 : 1.0);
  const double variance = missing.squaredNorm() / std::max(1.0, freedom) * repetition(missing);
  at.covariance = curvature.inverse() * variance;
  return at;
}

/// F0: the scatter of the force without contact over the relative error; at least a thousandth of
/// the largest force, the resolution of a load cell.
double floor_of(const std::vector<ForceAtDepth>& press, double largest_mN) {
  double sum = 0.0;
  double squares = 0.0;
  double count = 0.0;
  for (const ForceAtDepth& sample : press) {
    if (sample.depth_mm > 0.0) continue;
    sum += sample.force_mN;
    squares += sample.force_mN * sample.force_mN;
    count += 1.0;
  }
  const double scatter_mN =
      count > 1.0 ? std::sqrt(std::max(0.0, (squares - sum * sum / count) / (count - 1.0))) : 0.0;
  return std::max(scatter_mN / SkinFit::kRelativeError, 1e-3 * largest_mN);
}

}  // namespace

Expected<SkinFit, SetupError> fit_skin(const std::vector<ForceAtDepth>& press, const Indenter& tip,
                                       const SkinParameters& skin) {
  const auto deepest = std::max_element(
      press.begin(), press.end(),
      [](const ForceAtDepth& a, const ForceAtDepth& b) { return a.depth_mm < b.depth_mm; });
  SkinFit fit;
  for (auto sample = press.begin(); deepest != press.end() && sample <= deepest; ++sample) {
    if (sample->depth_mm > 0.0) fit.loading.push_back(*sample);
  }
  fit.samples = fit.loading.size();
  if (fit.samples < kMinSamples) {
    return bad_input("the press has " + std::to_string(fit.samples) +
                     " samples in contact before its deepest point, but a fit needs " +
                     std::to_string(kMinSamples) +
                     ": record at a higher rate, or press more slowly");
  }
  fit.deepest_mm = deepest->depth_mm;

  // F/E* of the tip, and its area, by the scene's contact law.
  SkinParameters elastic = skin;
  elastic.stiffening_mm = elastic.stiffening_kPa = std::numeric_limits<double>::infinity();
  Indenter by_depth = tip;
  by_depth.control = Indenter::Control::kDepth;
  const TipContact contact(by_depth, elastic);
  const double modulus = SkinMaterial(elastic).reduced_modulus_kPa();
  const auto count = static_cast<Eigen::Index>(fit.samples);
  StiffeningLaw law{.by_pressure = std::isfinite(skin.stiffening_kPa),
                    .depth_mm = Eigen::VectorXd(count),
                    .shape_mm2 = Eigen::VectorXd(count),
                    .area_mm2 = Eigen::VectorXd(count)};
  Eigen::VectorXd force(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const ForceAtDepth& sample = fit.loading[static_cast<std::size_t>(i)];
    const ContactState state = contact.press({.depth_mm = sample.depth_mm}).contact;
    force(i) = sample.force_mN;
    law.depth_mm(i) = sample.depth_mm;
    law.shape_mm2(i) = state.force_mN / modulus;
    law.area_mm2(i) = contact.field() != nullptr
                          ? state.force_mN / contact.field()->mean_pressure_kPa(sample.depth_mm)
                          : std::numbers::pi * state.contact_radius_mm * state.contact_radius_mm;
  }
  if (!(force.dot(law.shape_mm2) > 0.0)) {
    return bad_input(
        "the force does not increase with the depth: check its tare, and its sign ([probe] "
        "invert_force of the scene)");
  }
  const Residuals residuals(floor_of(press, force.maxCoeff()));
  Solution found = solve(law, force, residuals, true);
  // Stiffening by a thousandth is within the press's rounding.
  fit.by_pressure = law.by_pressure;
  fit.stiffens = law.growth(found.p, found.b).maxCoeff() > 1.001;
  if (!fit.stiffens) found = solve(law, force, residuals, false);
  fit.modulus_kPa = std::exp(found.p);
  fit.modulus_error = std::sqrt(found.covariance(0, 0));
  if (fit.stiffens) {
    fit.stiffening = 1.0 / found.b;
    fit.stiffening_error = std::sqrt(found.covariance(1, 1)) / found.b;
    fit.correlation =
        found.covariance(0, 1) / std::sqrt(found.covariance(0, 0) * found.covariance(1, 1));
  }
  const Eigen::VectorXd model = law.force_mN(found.p, fit.stiffens ? found.b : 0.0);
  fit.predicted_mN.assign(model.begin(), model.end());
  const double squares = (force - model).squaredNorm();
  fit.largest_mN = (force - model).cwiseAbs().maxCoeff();
  fit.rms_mN = std::sqrt(squares / static_cast<double>(count));
  fit.rms_weighted =
      std::sqrt(residuals.of(force, model).squaredNorm() / static_cast<double>(count));
  fit.r2 = 1.0 - squares / (force.array() - force.mean()).square().sum();

  const std::vector<ForceAtDepth> back(deepest, press.end());
  fit.unloaded = back.size() > kMinSamples && back.back().depth_mm < 0.5 * fit.deepest_mm;
  if (fit.unloaded) {
    const double loading = work_of(fit.loading);
    fit.hysteresis = (loading + work_of(back)) / loading;
  }
  return fit;
}

Expected<std::vector<ForceAtDepth>, SetupError> read_force_depth(const std::string& path,
                                                                 bool invert_force) {
  auto reader = TraceReader::open(path);
  if (!reader) return Unexpected<SetupError>(reader.error());
  for (const auto& [channel, name] :
       {std::pair{ProbeSample::kDepth, "depth_mm"}, {ProbeSample::kForce, "force_N"}}) {
    if ((reader->channels() & channel) == 0U) {
      return bad_input(path + " has no column " + name +
                       ": the fit needs both depth_mm and force_N");
    }
  }
  std::vector<ForceAtDepth> press;
  std::array<ProbeSample, 256> samples;
  for (;;) {
    const auto count = reader->read(samples);
    if (!count) return Unexpected<SetupError>(count.error());
    if (*count == 0) return press;
    for (std::size_t i = 0; i < *count; ++i) {
      press.push_back({.depth_mm = samples[i].depth_mm,
                       .force_mN = (invert_force ? -1.0 : 1.0) * samples[i].force_mN});
    }
  }
}

}  // namespace merkel
