#include "core/receptors/receptor_drive.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/contact/hertz_contact.hpp"
#include "core/contact/huber_stress.hpp"
#include "core/math/random.hpp"
#include "core/scene/drive_reach.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "core/units.hpp"
#include "tests/core/every_simd_target.hpp"

namespace merkel {
namespace {

constexpr std::size_t kAfferents = 20;

std::vector<Receptor> receptors_of_the_paper() { return *place_receptors({}, {}); }

/// The expected drive, computed receptor by receptor from the scalar closed forms.
struct Reference {
  SkinParameters skin;
  SigmoidTransduction transduction;

  [[nodiscard]] double energy(const Receptor& receptor,
                              const std::vector<PlacedContact>& contacts) const {
    CartesianStress sum;
    for (const PlacedContact& placed : contacts) {
      const double dx = receptor.x_mm - placed.x_mm;
      const double dy = receptor.y_mm - placed.y_mm;
      if (placed.field != nullptr) {
        sum += placed.field->at(dx, dy, placed.contact.depth_mm).stress;
      } else {
        sum += cartesian(huber_stress(placed.contact, skin.poisson_ratio, std::hypot(dx, dy),
                                      skin.receptor_depth_mm),
                         dx, dy);
      }
    }
    return energy_density_kPa(sum, SkinMaterial(skin), skin.energy_density);
  }
  [[nodiscard]] double displacement_mm(const Receptor& receptor,
                                       const std::vector<PlacedContact>& contacts) const {
    double sum = 0.0;
    for (const PlacedContact& placed : contacts) {
      const double dx = receptor.x_mm - placed.x_mm;
      const double dy = receptor.y_mm - placed.y_mm;
      sum += placed.field != nullptr
                 ? placed.field->at(dx, dy, placed.contact.depth_mm).displacement
                 : HertzContact::surface_displacement_mm(placed.contact, std::hypot(dx, dy));
    }
    return sum;
  }
  [[nodiscard]] std::vector<double> currents(const std::vector<Receptor>& receptors,
                                             const std::vector<PlacedContact>& contacts) const {
    std::vector<double> all(kAfferents);
    for (const Receptor& receptor : receptors) {
      if (displacement_mm(receptor, contacts) < units::mm_from_um(transduction.threshold_um)) {
        continue;
      }
      all[receptor.neuron - 1] += transduction.current_uA_per_cm2(energy(receptor, contacts));
    }
    return all;
  }
};

PlacedContact sphere(double depth_mm, double x_mm, double y_mm, const SkinParameters& skin = {}) {
  const double infinite = std::numeric_limits<double>::infinity();
  return {
      .contact =
          HertzContact(2.0, infinite, SkinMaterial(skin).reduced_modulus_kPa()).at_depth(depth_mm),
      .x_mm = x_mm,
      .y_mm = y_mm};
}

ReceptorDrive drive_of(const Reference& reference, Precision precision = Precision::kDouble) {
  return ReceptorDrive(receptors_of_the_paper(), kAfferents,
                       {.skin = reference.skin,
                        .transduction = reference.transduction,
                        .precision = precision,
                        .most_contacts = 4});
}

void expect_currents(const ReceptorDrive& drive, const std::vector<double>& expected,
                     double tolerance) {
  for (std::size_t n = 0; n < kAfferents; ++n) {
    EXPECT_NEAR(drive.output()[n], expected[n], tolerance) << "afferent " << n + 1;
  }
}

/// All kinds of presses: from barely touching to deep, on the patch and beside it.
std::vector<std::vector<PlacedContact>> presses(const SkinParameters& skin) {
  Random random(7);
  std::vector<std::vector<PlacedContact>> all;
  for (int count = 1; count <= 3; ++count) {
    for (int k = 0; k < 40; ++k) {
      std::vector<PlacedContact> contacts;
      for (int i = 0; i < count; ++i) {
        const double depth = std::pow(10.0, -5.0 + 5.4 * random.uniform());
        contacts.push_back(
            sphere(depth, 40.0 * random.uniform() - 5.0, 30.0 * random.uniform() - 5.0, skin));
      }
      all.push_back(contacts);
    }
  }
  return all;
}

TEST(ReceptorDrive, AgreesWithTheScalarClosedForms) {
  for (const auto kind : {EnergyDensity::kDistortional, EnergyDensity::kFull}) {
    Reference reference;
    reference.skin.energy_density = kind;
    const auto receptors = receptors_of_the_paper();
    ReceptorDrive drive = drive_of(reference);
    ReceptorDrive single = drive_of(reference, Precision::kFloat);
    for (const auto& contacts : presses(reference.skin)) {
      drive.compute(contacts);
      single.compute(contacts);
      // 30 receptors per afferent, each accurate to rounding (single precision: 1e-5 of the energy,
      // times γ).
      const auto expected = reference.currents(receptors, contacts);
      expect_currents(drive, expected, 1e-10);
      expect_currents(single, expected, 2e-2);
      for (std::size_t i = 0; i < receptors.size(); ++i) {
        const double energy = reference.energy(drive.receptors()[i], contacts);
        ASSERT_NEAR(drive.energy_density_kPa(i), energy, 1e-12 + 1e-11 * energy);
        ASSERT_NEAR(single.energy_density_kPa(i), energy, 1e-6 + 1e-4 * energy);
      }
    }
  }
}

TEST(ReceptorDrive, ReceptorsAtAnyDepthAgreeWithTheScalarClosedForms) {
  for (const double z : {0.0, 1e-4, 0.05, 3.0}) {
    Reference reference;
    reference.skin.receptor_depth_mm = z;
    reference.transduction.lambda_kPa = 10.0;
    ReceptorDrive drive = drive_of(reference);
    const std::vector<PlacedContact> contacts = {sphere(1.0, 15.0, 10.0)};
    drive.compute(contacts);
    for (std::size_t i = 0; i < drive.receptors().size(); ++i) {
      const double energy = reference.energy(drive.receptors()[i], contacts);
      // On the surface, the kernel evaluates the stress one nanometre below.
      const double tolerance = z > 0.0 ? 1e-9 * (1.0 + energy) : 1e-3 * energy;
      EXPECT_NEAR(drive.energy_density_kPa(i), energy, tolerance) << z;
    }
  }
}

TEST(ReceptorDrive, BarsAndSpheresActTogether) {
  const Reference reference;
  const TipField bars({.tip = BarTip{}}, reference.skin);
  ReceptorDrive drive = drive_of(reference);
  for (const double depth : {0.001, 0.003, 0.4}) {
    const std::vector<PlacedContact> contacts = {
        {.contact = {.depth_mm = depth}, .field = &bars, .x_mm = 14.0, .y_mm = 9.0},
        sphere(0.01, 4.0, 4.0)};
    drive.compute(contacts);
    expect_currents(drive, reference.currents(receptors_of_the_paper(), contacts), 1e-10);
    drive.compute({contacts.data(), 1});
    // Energies are interpolated for one tip, stresses for several.
    expect_currents(drive, reference.currents(receptors_of_the_paper(), {contacts[0]}), 5e-3);
  }
}

TEST(ReceptorDrive, GivesTheSameBitsOnEveryInstructionSet) {
  for (const auto precision : {Precision::kDouble, Precision::kFloat}) {
    on_every_simd_target([&] {
      const Reference reference;
      ReceptorDrive drive = drive_of(reference, precision);
      std::vector<double> bits;
      for (const auto& contacts : presses(reference.skin)) {
        drive.compute(contacts);
        bits.insert(bits.end(), drive.output().begin(), drive.output().end());
        for (std::size_t i = 0; i < drive.receptors().size(); ++i) {
          bits.push_back(drive.energy_density_kPa(i));
        }
      }
      return bits;
    });
  }
}

TEST(ReceptorDrive, FlatTipsGiveTheSameBitsOnEveryInstructionSet) {
  const Reference reference{.skin = {.radius_mm = 7.0}, .transduction = {}};
  const TipField pin({.tip = PinTip{}}, reference.skin);
  const TipField bar({.tip = BarTip{.widths_mm = {1.0}, .gaps_mm = {}, .length_mm = 4.0}},
                     reference.skin);
  for (const auto precision : {Precision::kDouble, Precision::kFloat}) {
    on_every_simd_target([&] {
      ReceptorDrive drive = drive_of(reference, precision);
      std::vector<double> bits;
      for (const double depth_mm : {0.02, 0.4, 1.3}) {
        const auto tip = [&](const TipField& field, double x_mm) {
          return PlacedContact{.contact = {.depth_mm = depth_mm, .force_mN = 1.0},
                               .field = &field,
                               .x_mm = x_mm,
                               .y_mm = 9.3};
        };
        // One tip is remembered at every receptor; the others are vectors of the grid's nodes.
        for (const std::vector<PlacedContact>& contacts :
             {std::vector{tip(pin, 14.2)}, std::vector{tip(bar, 15.1)},
              std::vector{tip(pin, 12.0), tip(pin, 16.5)},
              std::vector{tip(pin, 12.0), sphere(depth_mm, 17.0, 10.0, reference.skin)}}) {
          drive.compute(contacts);
          double largest = 0.0;
          for (std::size_t i = 0; i < drive.receptors().size(); ++i) {
            bits.push_back(drive.energy_density_kPa(i));
            largest = std::max(largest, bits.back());
          }
          EXPECT_GT(largest, 0.0);
        }
      }
      return bits;
    });
  }
}

// In place, moved, between other tables and beyond them: where skin on bone bulges, receptors rest.
TEST(ReceptorDrive, UnderOneTipOnBoneDisplacementsAreThoseOfTheField) {
  Reference reference;
  reference.skin = {.thickness_mm = 2.0};
  const TipField field({.tip = PinTip{.diameter_mm = 2.0}}, reference.skin);
  ReceptorDrive drive = drive_of(reference);
  const double threshold_mm = units::mm_from_um(reference.transduction.threshold_um);
  for (const auto& [depth_mm, x_mm] :
       {std::pair{0.5, 14.3}, {0.51, 14.3}, {0.51, 15.0}, {0.02, 15.0}, {1.7, 14.3}}) {
    const PlacedContact placed{
        .contact = {.depth_mm = depth_mm}, .field = &field, .x_mm = x_mm, .y_mm = 10.2};
    drive.compute({&placed, 1});
    std::vector<double> expected(kAfferents);
    for (std::size_t i = 0; i < drive.receptors().size(); ++i) {
      const Receptor& receptor = drive.receptors()[i];
      const double displaced_mm =
          field.at(receptor.x_mm - placed.x_mm, receptor.y_mm - placed.y_mm, depth_mm).displacement;
      if (displaced_mm < threshold_mm) continue;
      expected[receptor.neuron - 1] +=
          reference.transduction.current_uA_per_cm2(drive.energy_density_kPa(i));
    }
    expect_currents(drive, expected, 1e-6);
  }
}

TEST(ReceptorDrive, RecomputesOnlyWhenAContactChanges) {
  ReceptorDrive drive = drive_of({});
  const std::vector<PlacedContact> contacts = {sphere(1.0, 15.0, 10.0)};
  EXPECT_FALSE(drive.compute({}));
  EXPECT_TRUE(drive.compute(contacts));
  EXPECT_FALSE(drive.compute(contacts));
  EXPECT_TRUE(drive.compute({}));
  EXPECT_EQ(drive.output()[7], 0.0);
}

TEST(DriveReach, BoundsTheNeglectedCurrent) {
  const Reference reference;
  const auto receptors = receptors_of_the_paper();
  const double tolerance = 1e-4;
  const TipContact tip(Indenter{}, reference.skin);
  for (const std::size_t tips : {1U, 3U}) {
    const DriveReach reach(tip, reference.skin, reference.transduction, tolerance, tips);
    ReceptorDrive drive = drive_of(reference);
    std::size_t skipped = 0;
    for (auto contacts : presses(reference.skin)) {
      if (contacts.size() != tips) continue;
      const auto expected = reference.currents(receptors, contacts);
      for (PlacedContact& placed : contacts) {
        placed.reach_mm = reach.radius_mm(placed.contact.depth_mm);
      }
      drive.compute(contacts);
      skipped += kAfferents - drive.afferents_reached();
      expect_currents(drive, expected, 60 * tolerance * reference.transduction.alpha_uA_per_cm2);
    }
    EXPECT_GT(skipped, 100U);
  }
}

TEST(DriveReach, TwoTipsAtOnePlaceTogetherKeepTheTolerance) {
  const Reference reference;
  constexpr double kLimit_kPa = 0.01;
  for (const Tip& shape : {Tip{}, Tip{PinTip{}}}) {
    const TipContact tip({.tip = shape}, reference.skin);
    const DriveReach reach(tip, reference.skin, kLimit_kPa, 2);
    for (const double depth_mm : {0.5, 1.0, 2.0}) {
      const PlacedContact placed{.contact = tip.press_at_depth({}, depth_mm).contact,
                                 .field = tip.field()};
      const auto energy_kPa = [&](double r_mm) {
        return reference.energy({.x_mm = r_mm}, {placed, placed});
      };
      const double radius_mm = reach.radius_mm(depth_mm);
      EXPECT_LE(energy_kPa(radius_mm + 0.001), kLimit_kPa) << depth_mm;
      EXPECT_GT(energy_kPa(radius_mm - 0.15), kLimit_kPa) << depth_mm;
    }
  }
}

TEST(DriveReach, GrowsWithTheDepthAndEndsWhereTheEnergyDoes) {
  const Reference reference;
  const SkinMaterial material(reference.skin);
  for (const Tip& shape : {Tip{}, Tip{BarTip{}}}) {
    const TipContact tip({.tip = shape}, reference.skin);
    const DriveReach reach(tip, reference.skin, reference.transduction, 1e-4, 1);
    const double limit = DriveReach::energy_of_tolerance_kPa(reference.transduction, 1e-4);
    EXPECT_NEAR(reference.transduction.current_uA_per_cm2(limit) -
                    reference.transduction.current_uA_per_cm2(0.0),
                1e-4, 1e-15);
    double before = 0.0;
    for (double depth = 0.01; depth < 5.0; depth *= 1.3) {
      const double radius = reach.radius_mm(depth);
      EXPECT_GE(radius, before);
      before = radius;
      ASSERT_TRUE(std::isfinite(radius));
      PlacedContact placed{.contact = {.depth_mm = depth}, .field = tip.field()};
      if (tip.sphere() != nullptr) placed.contact = tip.sphere()->at_depth(depth);
      for (double r = radius; r < 60.0; r += 0.37) {
        for (double angle = 0.0; angle < 6.3; angle += 0.21) {
          const Receptor receptor{.x_mm = r * std::cos(angle), .y_mm = r * std::sin(angle)};
          // Between the sampled directions, bars may reach slightly further.
          ASSERT_LE(reference.energy(receptor, {placed}), 1.1 * limit) << depth << " " << r;
        }
      }
    }
    EXPECT_TRUE(std::isinf(reach.radius_mm(1e3)));
  }
  const DriveReach all(TipContact(Indenter{}, reference.skin), reference.skin,
                       reference.transduction, 0.0, 1);
  EXPECT_TRUE(std::isinf(all.radius_mm(0.1)));
}

// Fields of 2 mm on a lattice of 0.5 mm, under four dots at the corners of a square of 8 mm.
TEST(DriveReach, BetweenThePartsOfATipNothingIsReached) {
  const Reference reference;
  const TipContact tip(
      {.tip = DotsTip{.centres = {{-4.0, -4.0}, {4.0, -4.0}, {-4.0, 4.0}, {4.0, 4.0}},
                      .diameter_mm = 0.8,
                      .edge_radius_mm = 0.1}},
      reference.skin);
  constexpr double kLimit_kPa = 0.05;
  constexpr double kHalf_mm = 1.0;
  const DriveReach reach(tip, reference.skin, kLimit_kPa, 1);
  ASSERT_NE(reach.mask(), nullptr);
  for (const double depth_mm : {0.12, 0.3}) {
    const PlacedContact placed{.contact = {.depth_mm = depth_mm}, .field = tip.field()};
    int needed = 0;
    int computed = 0;
    int inside = 0;
    for (double y = -9.0; y <= 9.0; y += 0.5) {
      for (double x = -9.0; x <= 9.0; x += 0.5) {
        double largest = 0.0;
        for (double dy = -kHalf_mm; dy <= kHalf_mm; dy += 0.25) {
          for (double dx = -kHalf_mm; dx <= kHalf_mm; dx += 0.25) {
            largest =
                std::max(largest, reference.energy({.x_mm = x + dx, .y_mm = y + dy}, {placed}));
          }
        }
        const bool reached =
            reach.mask()->reaches(depth_mm, x - kHalf_mm, x + kHalf_mm, y - kHalf_mm, y + kHalf_mm);
        EXPECT_TRUE(reached || largest <= kLimit_kPa) << x << " " << y;
        needed += largest > kLimit_kPa ? 1 : 0;
        computed += reached ? 1 : 0;
        inside += std::hypot(x, y) <= reach.radius_mm(depth_mm) ? 1 : 0;
      }
    }
    EXPECT_GT(needed, 0);
    EXPECT_LE(computed, 1.5 * needed) << depth_mm;
    EXPECT_LT(computed, 0.7 * inside) << depth_mm;
  }
}

}  // namespace
}  // namespace merkel
