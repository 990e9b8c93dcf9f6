#include "core/contact/taxel_field.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/contact/hertz_contact.hpp"
#include "core/contact/huber_stress.hpp"
#include "core/contact/indenter.hpp"
#include "core/contact/taxel_stress.hpp"
#include "core/math/random.hpp"
#include "core/skin/strain_energy_density.hpp"

namespace merkel {
namespace {

SkinParameters half_space() { return {}; }

TaxelArray lattice(int columns, int rows, double pitch_mm) {
  TaxelArray array;
  array.columns = columns;
  array.rows = rows;
  array.pitch_mm = pitch_mm;
  array.width_mm = array.length_mm = pitch_mm;
  array.place = {.x_mm = 15.0, .y_mm = 10.0};
  return array;
}

std::vector<Position> scattered(std::size_t count, double left, double right, double bottom,
                                double top) {
  Random random(7);
  std::vector<Position> places;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = random.uniform(left, right);
    places.push_back({.x_mm = x, .y_mm = random.uniform(bottom, top)});
  }
  return places;
}

std::vector<float> random_pressures(std::size_t count) {
  Random random(3);
  std::vector<float> pressures;
  for (std::size_t i = 0; i < count; ++i) {
    pressures.push_back(static_cast<float>(std::max(0.0, random.uniform(-20.0, 60.0))));
  }
  return pressures;
}

/// The energy density at a point, by Boussinesq's point loads in Cartesian form: one for each of
/// 20 × 20 cells of every taxel.
double summed_energy(const TaxelArray& array, const std::vector<float>& pressures,
                     const SkinParameters& skin, const Position& at, double orientation_deg = 0.0) {
  constexpr int kCells = 20;
  const SkinMaterial material(skin);
  const double nu = material.poisson_ratio();
  const double z = skin.receptor_depth_mm;
  const double angle = orientation_deg * std::numbers::pi / 180.0;
  double s[6] = {};
  const std::vector<Position> centres = array.centres();
  for (std::size_t i = 0; i < centres.size(); ++i) {
    for (int a = 0; a < kCells; ++a) {
      for (int b = 0; b < kCells; ++b) {
        const double px = array.width_mm * ((a + 0.5) / kCells - 0.5);
        const double py = array.length_mm * ((b + 0.5) / kCells - 0.5);
        const bool disc = array.shape == TaxelArray::Shape::kDisc;
        if (disc && std::hypot(px, py) > 0.5 * array.width_mm) continue;
        const double force = static_cast<double>(pressures[i]) * array.width_mm * array.length_mm /
                             (kCells * kCells);
        const double cx = centres[i].x_mm + px;
        const double cy = centres[i].y_mm + py;
        const double x = at.x_mm - array.place.x_mm - std::cos(angle) * cx + std::sin(angle) * cy;
        const double y = at.y_mm - array.place.y_mm - std::sin(angle) * cx - std::cos(angle) * cy;
        const double R = std::sqrt(x * x + y * y + z * z);
        const double k = force / (2.0 * std::numbers::pi);
        const double m = (1.0 - 2.0 * nu);
        const double Rz = R + z;
        const double R3 = R * R * R;
        const double R5 = R3 * R * R;
        const double shared = 1.0 / (R * Rz);
        const double curl = (2.0 * R + z) / (R3 * Rz * Rz);
        s[0] += k * (-3.0 * x * x * z / R5 + m * (shared - curl * y * y));
        s[1] += k * (-3.0 * y * y * z / R5 + m * (shared - curl * x * x));
        s[2] += k * (-3.0 * z * z * z / R5);
        s[3] += k * (-3.0 * x * y * z / R5 + m * curl * x * y);
        s[4] += k * (-3.0 * y * z * z / R5);
        s[5] += k * (-3.0 * x * z * z / R5);
      }
    }
  }
  const double d12 = s[0] - s[1];
  const double d23 = s[1] - s[2];
  const double d31 = s[2] - s[0];
  const double sum =
      d12 * d12 + d23 * d23 + d31 * d31 + 6.0 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]);
  double energy = sum / (12.0 * material.shear_modulus_kPa());
  if (skin.energy_density == EnergyDensity::kFull) {
    const double trace = s[0] + s[1] + s[2];
    energy += trace * trace / (18.0 * material.bulk_modulus_kPa());
  }
  return energy;
}

/// The largest difference from the independent sum, as a share of the largest energy density.
double error_of(const TaxelArray& array, const SkinParameters& skin, double orientation_deg = 0.0) {
  const std::vector<Position> places = scattered(150, 0.0, 30.0, 0.0, 20.0);
  TaxelField field(array, orientation_deg, skin, places);
  const std::vector<float> pressures = random_pressures(array.size());
  field.press(pressures);
  double largest = 0.0;
  double error = 0.0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double exact = summed_energy(array, pressures, skin, places[i], orientation_deg);
    largest = std::max(largest, exact);
    error = std::max(error, std::fabs(static_cast<double>(field.energies_kPa()[i]) - exact));
  }
  return error / largest;
}

/// σz at a depth under a corner of a rectangle with unit pressure, over the rectangle from it to
/// (x, y): Newmark (1935), the integral of Boussinesq's σz that is also in Love (1929).
double corner_pressure(double x, double y, double z) {
  const double r1 = x * x + z * z;
  const double r2 = y * y + z * z;
  const double r3 = std::sqrt(x * x + y * y + z * z);
  return (std::atan2(x * y, z * r3) + x * y * z / r3 * (1.0 / r1 + 1.0 / r2)) /
         (2.0 * std::numbers::pi);
}

TEST(TaxelStress, EqualsLovesClosedFormOnAHalfSpace) {
  TaxelArray array = lattice(1, 1, 1.0);
  array.width_mm = 1.0;
  array.length_mm = 2.5;
  for (const double depth_mm : {0.25, 0.65, 1.5}) {
    SkinParameters skin;
    skin.receptor_depth_mm = depth_mm;
    const TaxelStress stress(array, skin, 10.0);
    for (const Position& at : scattered(50, -3.0, 3.0, -3.0, 3.0)) {
      double exact = 0.0;
      for (const double i : {-1.0, 1.0}) {
        for (const double j : {-1.0, 1.0}) {
          exact += i * j * corner_pressure(0.5 * i - at.x_mm, 1.25 * j - at.y_mm, depth_mm);
        }
      }
      EXPECT_NEAR(stress.at(at.x_mm, at.y_mm)[2], -exact, 5e-6) << depth_mm;
    }
  }
}

TEST(TaxelStress, EqualsTheClosedFormOnTheAxisOfADisc) {
  TaxelArray array = lattice(1, 1, 1.0);
  array.shape = TaxelArray::Shape::kDisc;
  array.width_mm = array.length_mm = 2.0;
  const SkinParameters skin;
  const double z = skin.receptor_depth_mm;
  const double exact = 1.0 - z * z * z / std::pow(1.0 + z * z, 1.5);
  EXPECT_NEAR(TaxelStress(array, skin, 10.0).at(0.0, 0.0)[2], -exact, 5e-6);
}

TEST(TaxelField, EqualsAnIndependentSumOfPointLoads) {
  EXPECT_LT(error_of(lattice(16, 16, 1.0), half_space()), 5e-3);
}

TEST(TaxelField, EqualsTheSumWithVolumetricEnergy) {
  SkinParameters skin;
  skin.energy_density = EnergyDensity::kFull;
  skin.poisson_ratio = 0.4;
  EXPECT_LT(error_of(lattice(8, 5, 1.5), skin), 5e-3);
}

TEST(TaxelField, TurnsAroundItsMiddle) {
  EXPECT_LT(error_of(lattice(10, 4, 1.2), half_space(), 30.0), 5e-3);
}

TEST(TaxelField, TaxelsMayBeDiscsAtAnyPlace) {
  TaxelArray array = lattice(0, 0, 1.0);
  array.shape = TaxelArray::Shape::kDisc;
  array.width_mm = array.length_mm = 1.5;
  array.listed = {{-5.0, -2.0}, {-2.7, 1.3}, {0.0, 0.0}, {0.4, 3.9}, {3.1, -3.3}, {6.0, 2.0}};
  EXPECT_LT(error_of(array, half_space()), 1e-2);  // the cells of the sum follow the rim in steps
}

TEST(TaxelField, ShallowReceptorsFeelTheEdgesOfTaxels) {
  SkinParameters skin;
  skin.receptor_depth_mm = 0.25;
  EXPECT_LT(error_of(lattice(6, 6, 1.0), skin), 1e-2);
}

TEST(TaxelField, LayersOfOneMaterialAreOneMaterial) {
  const TaxelArray array = lattice(6, 6, 1.0);
  SkinParameters skin;
  SkinParameters layered = skin;
  const double modulus = SkinMaterial(skin).youngs_modulus_kPa();
  layered.layers.count = 2;
  layered.layers.layer[0] = {
      .thickness_mm = 1.0, .youngs_modulus_kPa = modulus, .poisson_ratio = skin.poisson_ratio};
  layered.layers.layer[1] = {
      .thickness_mm = 3.0, .youngs_modulus_kPa = modulus, .poisson_ratio = skin.poisson_ratio};
  layered.bone = false;
  const std::vector<Position> places = scattered(100, 5.0, 25.0, 0.0, 20.0);
  TaxelField plain(array, 0.0, skin, places);
  TaxelField both(array, 0.0, layered, places);
  const std::vector<float> pressures = random_pressures(array.size());
  plain.press(pressures);
  both.press(pressures);
  const auto largest = *std::max_element(plain.energies_kPa().begin(), plain.energies_kPa().end());
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_NEAR(both.energies_kPa()[i], plain.energies_kPa()[i], 1e-2F * largest);
  }
}

TEST(TaxelField, ThePressureOfASphereGivesItsEnergyDensity) {
  const SkinParameters skin;
  const HertzContact hertz(4.0, skin.radius_mm, SkinMaterial(skin).reduced_modulus_kPa());
  const ContactState contact = hertz.at_depth(0.8);
  TaxelArray array = lattice(40, 40, 0.125);
  std::vector<float> pressures;
  for (const Position& centre : array.centres()) {
    const double r = std::hypot(centre.x_mm, centre.y_mm) / contact.contact_radius_mm;
    pressures.push_back(
        static_cast<float>(r < 1.0 ? contact.peak_pressure_kPa * std::sqrt(1.0 - r * r) : 0.0));
  }
  std::vector<Position> places;
  for (double r = 0.0; r < 5.0; r += 0.25) places.push_back({.x_mm = 15.0 + r, .y_mm = 10.0});
  TaxelField field(array, 0.0, skin, places);
  field.press(pressures);
  EXPECT_NEAR(field.force_mN(), contact.force_mN, 0.01 * contact.force_mN);
  EXPECT_NEAR(field.area_mm2(),
              std::numbers::pi * contact.contact_radius_mm * contact.contact_radius_mm,
              0.05 * field.area_mm2());
  double largest = 0.0;
  for (const float energy : field.energies_kPa()) {
    largest = std::max(largest, static_cast<double>(energy));
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    const AxisymmetricStress stress =
        huber_stress(contact, skin.poisson_ratio, places[i].x_mm - 15.0, skin.receptor_depth_mm);
    const double exact = energy_density_kPa(stress, SkinMaterial(skin), skin.energy_density);
    EXPECT_NEAR(static_cast<double>(field.energies_kPa()[i]), exact, 0.01 * largest) << i;
  }
}

TEST(TaxelField, NoiseAndPullsDoNotPress) {
  TaxelArray array = lattice(4, 4, 1.0);
  array.least_kPa = 2.0;
  const std::vector<Position> places = {{15.0, 10.0}};
  TaxelField field(array, 0.0, half_space(), places);
  std::vector<float> pressures(16, 1.9F);
  pressures[3] = -50.0F;
  pressures[4] = std::numeric_limits<float>::quiet_NaN();
  field.press(pressures);
  EXPECT_FALSE(field.touching());
  EXPECT_EQ(field.energies_kPa()[0], 0.0F);
  pressures[5] = 2.0F;
  field.press(pressures);
  EXPECT_EQ(field.force_mN(), 2.0);
  EXPECT_GT(field.energies_kPa()[0], 0.0F);
  const std::uint64_t version = field.version();
  field.press(pressures);
  EXPECT_EQ(field.version(), version) << "the same pressures need no work";
  field.release();
  EXPECT_EQ(field.energies_kPa()[0], 0.0F);
  EXPECT_NE(field.version(), version);
}

std::string fault_of(const TaxelArray& array, const SkinParameters& skin = {}) {
  const Indenter indenter{.tip = array};
  const auto checked = indenter.check(skin);
  return checked ? "" : checked.error().key + " " + checked.error().reason;
}

TEST(TaxelArray, WrongArraysHaveOneSentence) {
  EXPECT_EQ(fault_of(lattice(16, 16, 1.0)), "");
  EXPECT_TRUE(fault_of(TaxelArray{}).starts_with("probe.taxel_columns is missing"));
  TaxelArray wide = lattice(4, 4, 1.0);
  wide.width_mm = 1.1;
  EXPECT_EQ(
      fault_of(wide),
      "probe.taxel_width_mm makes taxels overlap: their distance must be at least their size");
  TaxelArray wrong = lattice(4, 4, 1.0);
  wrong.pitch_mm = std::nan("");
  EXPECT_TRUE(fault_of(wrong).starts_with("probe.taxel_pitch_mm must be"));
  SkinParameters stiffening;
  stiffening.stiffening_mm = 1.65;
  EXPECT_TRUE(
      fault_of(lattice(4, 4, 1.0), stiffening).starts_with("skin.stiffening_mm must be inf"));
}

TEST(TaxelField, TheCentreOfItsPressuresTurnsWithTheArray) {
  const TaxelArray array = lattice(4, 4, 1.0);
  const std::vector<Position> receptors = scattered(4, 13.0, 17.0, 8.0, 12.0);
  std::vector<float> pressures(16);
  pressures[3] = 10.0F;  // at x = 1.5, y = -1.5
  pressures[2] = 30.0F;  // at x = 0.5
  TaxelField straight(array, 0.0, half_space(), receptors);
  straight.press(pressures);
  EXPECT_NEAR(straight.centre().x_mm, 15.75, 1e-6);
  EXPECT_NEAR(straight.centre().y_mm, 8.5, 1e-6);
  TaxelField turned(array, 90.0, half_space(), receptors);
  turned.press(pressures);
  EXPECT_NEAR(turned.centre().x_mm, 16.5, 1e-6);
  EXPECT_NEAR(turned.centre().y_mm, 10.75, 1e-6);
}

}  // namespace
}  // namespace merkel
