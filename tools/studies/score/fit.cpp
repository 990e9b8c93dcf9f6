#include "tools/studies/score/fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include <Eigen/Dense>
#include <fmt/core.h>
#include <nlopt.h>

#include "core/parameters/nearest_name.hpp"
#include "core/scene/model_fields.hpp"
#include "tools/studies/score/fit_answers.hpp"

namespace merkel {
namespace {

constexpr double kWidest = 20.0;

/// The parameters that `merkel fit` may change.
BoundFields fitted_keys(TactileModel::Parameters& model) {
  BoundFields keys = bind_fields(model.adaptation);
  bind_fields(model.patches.front().field, keys);
  for (BoundField& key : neuron_fields(model)) keys.push_back(std::move(key));
  std::erase_if(keys, [](const BoundField& key) { return !key.field->fitted; });
  return keys;
}

Expected<std::vector<FitParameter>, SetupError> chosen(const TactileModel::Parameters& scene,
                                                       const std::vector<std::string>& names) {
  const std::vector<FitParameter> all = fit_parameters(scene.kind());
  std::vector<std::string> known;
  for (const FitParameter& parameter : all) known.push_back(parameter.name);
  std::vector<FitParameter> found;
  for (const std::string& name : names) {
    const auto at = std::find(known.begin(), known.end(), name);
    if (at == known.end()) {
      const std::string nearest = nearest_name(name, known);
      return bad_input("no parameter \"" + name + "\" can be fitted" +
                       (nearest.empty() ? ": the parameters are " + listed(known)
                                        : "; did you mean " + nearest + "?"));
    }
    const FitParameter& parameter = all[static_cast<std::size_t>(at - known.begin())];
    if (std::any_of(found.begin(), found.end(),
                    [&](const FitParameter& other) { return other.name == name; })) {
      return bad_input("the parameter " + name + " is given twice: remove one");
    }
    if (parameter.table == "receptors" && scene.patches.front().layout != ReceptorLayout::kFields) {
      return bad_input("the parameter " + name +
                       " has no meaning in this scene, whose afferents have subregions: set layout "
                       "= \"fields\"");
    }
    TactileModel::Parameters copy = scene;
    if (!(*parameter.in(copy) > 0.0)) {
      return bad_input("the parameter " + name +
                       " is 0 in the scene: give it a positive starting value");
    }
    found.push_back(parameter);
  }
  if (found.empty()) return bad_input("name at least one parameter to fit");
  return found;
}

using Cost = std::function<double(const std::vector<double>&)>;

/// Minimises a cost of logarithms, starting from `at` and within a factor of kWidest of it. Returns
/// the least cost, or nothing if the optimiser failed.
std::optional<double> minimise(const Cost& cost, std::vector<double>& at, int most_evaluations) {
  const std::unique_ptr<nlopt_opt_s, void (*)(nlopt_opt_s*)> optimiser(
      nlopt_create(NLOPT_LN_SBPLX, static_cast<unsigned>(at.size())), nlopt_destroy);
  std::vector<double> low = at;
  std::vector<double> high = at;
  for (std::size_t k = 0; k < at.size(); ++k) {
    low[k] -= std::log(kWidest);
    high[k] += std::log(kWidest);
  }
  Cost objective = cost;
  nlopt_set_lower_bounds(optimiser.get(), low.data());
  nlopt_set_upper_bounds(optimiser.get(), high.data());
  nlopt_set_initial_step1(optimiser.get(), 0.1);
  nlopt_set_xtol_abs1(optimiser.get(), 1e-3);
  nlopt_set_maxeval(optimiser.get(), most_evaluations);
  nlopt_set_min_objective(
      optimiser.get(),
      [](unsigned n, const double* x, double* /*gradient*/, void* function) {
        return (*static_cast<Cost*>(function))({x, x + n});
      },
      &objective);
  double least = 0.0;
  if (nlopt_optimize(optimiser.get(), at.data(), &least) < 0) return std::nullopt;
  return least;
}

/// Errors and correlations of the parameters from the curvature of the cost, from the slopes of
/// the responses (Gauss-Newton). \param slopes  one row per measurement, one column per parameter
void estimate_errors(FitResult& result, const Eigen::MatrixXd& slopes,
                     const Eigen::VectorXd& weights) {
  const Eigen::Index count = slopes.cols();
  const Eigen::MatrixXd curvature = slopes.transpose() * weights.asDiagonal() * slopes;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(curvature);
  const double smallest = eigen.eigenvalues().minCoeff();
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  result.condition = smallest > 0.0 ? eigen.eigenvalues().maxCoeff() / smallest : kInfinite;
  const double freedom = std::max(1.0, static_cast<double>(slopes.rows() - count));
  const Eigen::MatrixXd covariance =
      smallest > 0.0 ? Eigen::MatrixXd(curvature.inverse() * result.cost_after / freedom)
                     : Eigen::MatrixXd::Constant(count, count, kInfinite);
  for (Eigen::Index k = 0; k < count; ++k) {
    // Without a spare measurement, the residual says nothing about the errors.
    result.parameters[static_cast<std::size_t>(k)].relative_error =
        slopes.rows() > count ? std::sqrt(covariance(k, k)) : kInfinite;
    std::vector<double> row;
    for (Eigen::Index j = 0; j < count; ++j) {
      row.push_back(covariance(k, j) / std::sqrt(covariance(k, k) * covariance(j, j)));
    }
    result.correlation.push_back(std::move(row));
  }
}

std::vector<DataSet> fitted_sets(std::vector<DataSet> sets) {
  std::erase_if(sets, [](const DataSet& set) { return !set.fit; });
  return sets;
}

TactileModel::Parameters with_values(TactileModel::Parameters scene,
                                     const std::vector<FitParameter>& parameters,
                                     const std::vector<double>& values) {
  for (std::size_t k = 0; k < values.size(); ++k) *parameters[k].in(scene) = values[k];
  return scene;
}

}  // namespace

std::size_t fit_points(const std::vector<DataSet>& sets) {
  std::size_t points = 0;
  for (const DataSet& set : fitted_sets(sets)) points += set.points.size();
  return points;
}

Expected<FitResponses, SetupError> fit_part(const TactileModel::Parameters& scene,
                                            const std::vector<DataSet>& sets,
                                            const std::vector<std::string>& names,
                                            std::size_t trials, std::size_t part,
                                            std::size_t parts) {
  auto parameters = chosen(scene, names);
  if (!parameters) return Unexpected<SetupError>(parameters.error());
  const auto own = std::make_shared<std::vector<DataSet>>(fitted_sets(sets));
  std::size_t number = 0;
  for (DataSet& set : *own) {
    std::erase_if(set.points, [&](const DataSet::Point&) { return number++ % parts != part; });
  }
  auto traces = fit_traces(scene, *own, 1);
  if (!traces) return bad_input(traces.error().key + " " + traces.error().reason);
  const auto answers = std::make_shared<FitAnswers>(scene, *own, std::move(*traces), trials, 1);
  return FitResponses([scene, own, answers, parameters = std::move(*parameters)](
                          const std::vector<double>& values) -> std::vector<double> {
    const Eigen::VectorXd all = answers->of(with_values(scene, parameters, values));
    return {all.begin(), all.end()};
  });
}

void set_fitted(TactileModel::Parameters& model, const FitResult& result) {
  for (const FittedParameter& fitted : result.parameters) {
    *fitted.parameter.in(model) = std::stod(fmt::format("{:.6g}", fitted.after));
  }
}

bool FitResult::determined() const {
  return measurements > parameters.size() && condition < kLargestCondition &&
         std::all_of(parameters.begin(), parameters.end(), [](const FittedParameter& parameter) {
           return parameter.relative_error < kLargestError;
         });
}

std::vector<FitParameter> fit_parameters(NeuronKind kind) {
  TactileModel::Parameters model;
  set_kind(model, kind);
  std::vector<FitParameter> all;
  for (const BoundField& field : fitted_keys(model)) {
    const std::string table(field.table);
    const std::string key(field.field->key);
    const bool taken = std::any_of(all.begin(), all.end(),
                                   [&](const FitParameter& earlier) { return earlier.key == key; });
    all.push_back({.table = table, .key = key, .name = taken ? table + "." + key : key});
  }
  return all;
}

double* FitParameter::in(TactileModel::Parameters& model) const {
  const BoundFields keys = fitted_keys(model);
  const auto found = std::find_if(keys.begin(), keys.end(), [&](const BoundField& field) {
    return field.field->key == key && field.table == table;
  });
  return std::get<double*>(found->value);
}

Expected<FitResult, SetupError> fit(TactileModel::Parameters& scene,
                                    const std::vector<DataSet>& given,
                                    const std::vector<std::string>& names, std::size_t trials,
                                    int most_evaluations, const FitProgress& progress,
                                    std::size_t threads, const FitResponses& elsewhere) {
  if (!scene.energy_driven()) {
    return bad_input(
        "only neurons driven by energy density can be fitted: start from goodwin or finger");
  }
  const std::vector<DataSet> sets = fitted_sets(given);
  if (sets.empty()) return bad_input("the data file contains no rates or declines to fit");
  const auto parameters = chosen(scene, names);
  if (!parameters) return Unexpected<SetupError>(parameters.error());
  auto traces = fit_traces(scene, sets, threads);
  if (!traces) return bad_input(traces.error().key + " " + traces.error().reason);

  FitAnswers answers(scene, sets, std::move(*traces), trials, threads);
  const Eigen::VectorXd measured = answers.measured();
  const Eigen::VectorXd weights = answers.weights();
  const auto values_of = [](std::vector<double> logarithms) {
    for (double& value : logarithms) value = std::exp(value);
    return logarithms;
  };
  const auto with = [&](const std::vector<double>& logarithms) {
    return with_values(scene, *parameters, values_of(logarithms));
  };
  int evaluations = 0;
  bool ended = false;  // by `progress` or `elsewhere`
  const auto answers_of = [&](const std::vector<double>& logarithms) -> Eigen::VectorXd {
    ++evaluations;
    ended =
        ended ||
        (progress && !progress(std::min(1.0, static_cast<double>(evaluations) / most_evaluations)));
    if (ended) return Eigen::VectorXd::Zero(measured.size());
    if (!elsewhere) return answers.of(with(logarithms));
    const std::vector<double> responses = elsewhere(values_of(logarithms));
    ended = static_cast<Eigen::Index>(responses.size()) != measured.size();
    if (ended) return Eigen::VectorXd::Zero(measured.size());
    return Eigen::VectorXd::Map(responses.data(), measured.size());
  };
  const auto valid = [](const TactileModel::Parameters& p) {
    const PatchParameters& patch = p.patches.front();
    return p.adaptation.check() && patch.field.check(patch.patch) &&
           std::visit([&](const auto& afferent) { return afferent.check(p); }, p.afferent);
  };
  const auto cost = [&](const std::vector<double>& logarithms) {
    const TactileModel::Parameters changed = with(logarithms);
    if (!valid(changed)) return 1e6;
    const Eigen::VectorXd difference = answers_of(logarithms) - measured;
    return (weights.array() * difference.array().square()).sum();
  };

  FitResult result;
  std::vector<double> at;
  for (const FitParameter& parameter : *parameters) at.push_back(std::log(*parameter.in(scene)));
  const std::vector<double> start = at;
  result.cost_before = cost(start);

  const auto least = minimise(cost, at, most_evaluations);
  if (!least) return unavailable("the optimiser failed: start from other parameters");
  result.cost_after = *least;
  // Impulse counts are step functions: if no step reduces the cost, keep the start.
  if (result.cost_after >= result.cost_before) {
    at = start;
    result.cost_after = result.cost_before;
  }

  for (std::size_t k = 0; k < at.size(); ++k) {
    result.parameters.push_back(
        {.parameter = (*parameters)[k], .before = std::exp(start[k]), .after = std::exp(at[k])});
  }
  Eigen::MatrixXd slopes(measured.size(), static_cast<Eigen::Index>(at.size()));
  for (std::size_t k = 0; k < at.size(); ++k) {
    constexpr double kStep = 0.1;
    std::vector<double> above = at;
    std::vector<double> below = at;
    above[k] += kStep;
    below[k] -= kStep;
    slopes.col(static_cast<Eigen::Index>(k)) =
        (answers_of(above) - answers_of(below)) / (2.0 * kStep);
  }
  if (ended) return unavailable("the fit was ended");
  estimate_errors(result, slopes, weights);
  result.evaluations = evaluations;
  result.measurements = static_cast<std::size_t>(measured.size());
  scene = with(at);
  return result;
}

}  // namespace merkel
