#include "tools/studies/score/array_responses.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>

#include "tools/studies/score/parallel_items.hpp"
#include "tools/studies/score/pin_array.hpp"
#include "tools/studies/score/trials.hpp"

namespace merkel {
namespace {

/// The contact after each increment.
std::vector<std::optional<TipField>> fields_of(
    const PinArrayTrials& array, const std::vector<PinArrayTrials::Increment>& increments,
    std::size_t threads) {
  std::vector<std::optional<TipField>> fields(increments.size());
  for_each_item(increments.size(), threads, [&](std::size_t /*worker*/, std::size_t i) {
    fields[i].emplace(array.field(increments[i]));
  });
  return fields;
}

}  // namespace

Expected<std::vector<FieldArea>, ParameterError> field_areas(const TactileModel::Parameters& scene,
                                                             const Recordings::FieldAreas& areas,
                                                             std::size_t trials,
                                                             std::size_t threads) {
  std::vector<FieldArea> found(areas.points.size());
  const auto measure = [&](FieldArea& area, const std::function<double(double, double)>& response) {
    area.response = response(0.0, 0.0);
    if (area.response < 1.0) return;
    const auto radius = [&](bool across) {
      double inside = 0.0;
      double outside = 6.0;
      while (outside - inside > 0.02) {
        const double middle = 0.5 * (inside + outside);
        const bool evokes = (across ? response(0.0, middle) : response(middle, 0.0)) >= 1.0;
        (evokes ? inside : outside) = middle;
      }
      return inside;
    };
    area.area_mm2 = std::numbers::pi * radius(false) * radius(true);
  };
  if (areas.array.pins > 1) {
    auto array = PinArrayTrials::create(scene, areas.array, trials);
    if (!array) return Unexpected<ParameterError>(array.error());
    std::vector<PinArrayTrials::Increment> increments;
    for (const auto& point : areas.points) increments.push_back({1, point.depth_mm});
    const auto fields = fields_of(*array, increments, threads);
    for (std::size_t i = 0; i < found.size(); ++i) {
      measure(found[i], [&](double x, double y) { return array->response(*fields[i], x, y); });
    }
    return found;
  }
  Stimulus stimulus;
  stimulus.indenter.tip = PinTip{.diameter_mm = areas.array.diameter_mm};
  auto model = Trials::create(scene, stimulus, trials);
  if (!model) return Unexpected<ParameterError>(model.error());
  const double none = answer_of(stimulus, model->run(stimulus)).value;
  for (std::size_t i = 0; i < found.size(); ++i) {
    stimulus.level = areas.points[i].depth_mm;
    measure(found[i], [&](double x, double y) {
      stimulus.offset_across = y > 0.0;
      stimulus.offset_mm = std::max(x, y);
      return answer_of(stimulus, model->run(stimulus)).value - none;
    });
  }
  return found;
}

Expected<std::vector<double>, ParameterError> surround_ratios(const TactileModel::Parameters& scene,
                                                              const Recordings::Surround& surround,
                                                              std::size_t trials,
                                                              std::size_t threads) {
  auto array = PinArrayTrials::create(scene, surround.array, trials);
  if (!array) return Unexpected<ParameterError>(array.error());
  std::vector<PinArrayTrials::Increment> increments = {{1, surround.depth_mm}};
  for (const auto& point : surround.points) increments.push_back({point.pins, surround.depth_mm});
  const auto fields = fields_of(*array, increments, threads);
  const double alone = array->response(*fields[0], 0.0, 0.0);
  std::vector<double> ratios;
  for (std::size_t i = 1; i < fields.size(); ++i) {
    ratios.push_back(alone > 0.0 ? array->response(*fields[i], 0.0, 0.0) / alone
                                 : std::numeric_limits<double>::quiet_NaN());
  }
  return ratios;
}

}  // namespace merkel
