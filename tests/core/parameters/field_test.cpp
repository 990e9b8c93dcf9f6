#include "core/parameters/field.hpp"

#include <cmath>
#include <limits>
#include <set>

#include <gtest/gtest.h>

#include "core/scene/model_fields.hpp"
#include "core/scene/tactile_model.hpp"

namespace merkel {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

TEST(Range, NamesTheAllowedValues) {
  EXPECT_EQ(positive(10.0).fault(2.0), "");
  EXPECT_EQ(positive(10.0).fault(0.0), "must be a positive number, but is 0");
  EXPECT_EQ(positive(10.0).fault(11.0), "must be at most 10, but is 11");
  EXPECT_EQ(positive(10.0).fault(kInfinite), "must be a positive number, but is inf");
  EXPECT_EQ(positive_or_infinite(10.0).fault(kInfinite), "");
  EXPECT_EQ(positive_or_infinite(1e6).fault(1e308),
            "must be at most 1000000 or inf, but is 1e+308");
  EXPECT_EQ(not_negative(10.0).fault(-1.0), "must be zero or a positive number, but is -1");
  EXPECT_EQ(from_to(-5.0, 5.0).fault(-6.0), "must be at least -5, but is -6");
  EXPECT_EQ(from_to(1, 98).fault(std::int64_t{99}),
            "must be a whole number from 1 to 98, but is 99");
}

TEST(Range, ReadsAsText) {
  EXPECT_EQ(positive(1e3).text(), "> 0 to 1000");
  EXPECT_EQ(positive_or_infinite(1e6).text(), "> 0 to 1000000, or inf");
  EXPECT_EQ(from_below(0.0, 0.5).text(), "0 to < 0.5");
  EXPECT_EQ(any_value().text(), "");
}

/// Every field table of the model, bound to its defaults.
BoundFields all_fields(TactileModel::Parameters& model) {
  BoundFields all = bind_fields(model.skin);
  const auto add = [&all](const BoundFields& more) {
    all.insert(all.end(), more.begin(), more.end());
  };
  add(receptor_fields(model.patches.front()));
  add(tip_kind_field(model.indenters.front()));
  add(tip_fields(model.indenters.front()));
  add(bind_fields(model.transduction));
  add(bind_fields(model.adaptation));
  add(bind_fields(model.network));
  add(bind_fields(model.accuracy));
  add(tick_fields(model));
  add(neuron_kind_fields(model));
  add(neuron_fields(model));
  return all;
}

TEST(Field, DefaultsLieInTheirRangesAndKeysAreUnique) {
  for (std::size_t tip = 0; tip < kTipNames.size(); ++tip) {
    TactileModel::Parameters model;
    set_kind(model, static_cast<NeuronKind>(tip % kNeuronKinds.size()));
    model.indenters.front().tip = default_tip(tip);
    std::set<std::string> names;
    for (const BoundField& field : all_fields(model)) {
      EXPECT_EQ(fault_of(field), "") << field.name();
      EXPECT_FALSE(field.field->meaning.empty()) << field.name();
      EXPECT_TRUE(names.insert(field.name()).second) << field.name() << " is defined twice";
    }
    EXPECT_GT(names.size(), 50U);
  }
}

/// A default tip with what a scene must set.
Tip complete_tip(std::size_t kind) {
  Tip tip = default_tip(kind);
  if (auto* const dots = std::get_if<DotsTip>(&tip)) dots->centres = {{0.0, 0.0}};
  if (auto* const shape = std::get_if<ShapeTip>(&tip)) {
    shape->map = std::make_shared<const HeightMap>(
        HeightMap{.grid = {.pixel_mm = 0.1, .columns = 1, .rows = 1}, .height_mm = {0.0}});
    shape->pixel_mm = 0.1;
  }
  return tip;
}

TEST(Field, EveryNumberOutOfItsRangeIsRefusedByTheModelWithItsKey) {
  int tried = 0;
  for (std::size_t k = 0; k < 1000; ++k) {
    for (const double wild : {1e308, -1e308, std::nan("")}) {
      TactileModel::Parameters model;
      const std::size_t tip = k / 100;
      model.indenters.front().tip = complete_tip(tip);
      const BoundFields fields = all_fields(model);
      if (k % 100 >= fields.size()) continue;
      const BoundField& field = fields[k % 100];
      if (tip > 0 && field.table != "probe") continue;
      auto* const* const number = std::get_if<double*>(&field.value);
      if (number == nullptr) continue;
      // Keys of neuron kinds that this model does not use are checked where they are used.
      if (field.table == "afferent") continue;
      const bool of_field = field.field->key.starts_with("field_");
      if (of_field) model.patches[0].layout = ReceptorLayout::kFields;
      **number = wild;
      if (of_field) model.network.gain = 0.0;
      const auto made = TactileModel::create(model);
      ASSERT_FALSE(made) << field.name() << " = " << wild;
      EXPECT_EQ(made.error().key, field.name()) << wild;
      ++tried;
    }
  }
  EXPECT_GT(tried, 80);
}

TEST(Field, AnotherKindOfNeuronComesWithItsDefaultsTheSameKeepsItsOwn) {
  TactileModel::Parameters model;
  const auto choice = [&] { return std::get<Choice>(neuron_kind_fields(model).front().value); };
  choice().set(choice().value, static_cast<std::size_t>(NeuronKind::kIntegrateAndFire));
  EXPECT_EQ(model.kind(), NeuronKind::kIntegrateAndFire);
  TactileModel::Parameters defaults;
  set_kind(defaults, NeuronKind::kIntegrateAndFire);
  const auto number = [](TactileModel::Parameters& of) {
    for (const BoundField& field : neuron_fields(of)) {
      if (auto* const* const value = std::get_if<double*>(&field.value)) return *value;
    }
    return static_cast<double*>(nullptr);
  };
  ASSERT_NE(number(model), nullptr);
  EXPECT_EQ(*number(model), *number(defaults));
  *number(model) *= 1.5;
  choice().set(choice().value, static_cast<std::size_t>(NeuronKind::kIntegrateAndFire));
  EXPECT_EQ(*number(model), 1.5 * *number(defaults));
}

TEST(Field, ReachesItsMember) {
  TactileModel::Parameters model;
  for (const BoundField& field : bind_fields(model.skin)) {
    if (field.field->key == "dermis_kPa") *std::get<double*>(field.value) = 81.0;
    if (field.field->key == "contact_law") {
      const auto& choice = std::get<Choice>(field.value);
      EXPECT_EQ(choice.get(choice.value), 0U);
      choice.set(choice.value, 1);
    }
  }
  EXPECT_EQ(model.skin.dermis_kPa, 81.0);
  EXPECT_EQ(model.skin.contact_law, ContactLaw::kSneddon);
}

}  // namespace
}  // namespace merkel
