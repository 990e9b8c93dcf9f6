#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "core/contact/placed_contact.hpp"
#include "core/precision.hpp"
#include "core/realtime_tag.hpp"
#include "core/receptors/receptor_arrays.hpp"
#include "core/receptors/receptor_placement.hpp"
#include "core/receptors/sigmoid_transduction.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// Computes the input of every afferent from the contacts: the current I_n = Σ over its receptors
/// of the sigmoid of the strain energy density at receptor depth (Eq. 14), or the mean of these
/// energy densities.
///
/// Contacts act together: their stresses and displacements add (the half-space is linear), and the
/// energy density is that of the sum. Afferents whose receptors all lie beyond the contacts' reach
/// are skipped and receive zero energy. Unchanged contacts are not recomputed. Real-time: yes,
/// after construction.
class ReceptorDrive {
 public:
  enum class Output : std::uint8_t {
    kCurrent,     ///< sum of the receptor currents, µA/cm²
    kMeanEnergy,  ///< mean of the energy densities, kPa
  };
  struct Parameters {
    SkinParameters skin;
    SigmoidTransduction transduction;
    Precision precision = Precision::kDouble;
    std::size_t most_contacts = 1;  ///< largest number of contacts per compute()
    Output output = Output::kCurrent;
  };

  /// \param neurons  number of afferents; each receptor refers to one, from 1
  ReceptorDrive(std::span<const Receptor> receptors, std::size_t neurons,
                const Parameters& parameters);

  /// Computes the output for every afferent.
  /// \return whether any value may differ from the previous call.
  bool compute(std::span<const PlacedContact> contacts) noexcept MERKEL_REALTIME;

  /// The output of the last compute() for every afferent: µA/cm² or kPa, depending on
  /// Parameters::output.
  [[nodiscard]] std::span<const double> output() const noexcept { return output_; }
  /// Number of afferents within the reach of the last contacts.
  [[nodiscard]] std::size_t afferents_reached() const noexcept { return reached_; }

  /// The receptors, grouped by afferent.
  [[nodiscard]] std::span<const Receptor> receptors() const noexcept { return receptors_; }
  /// Strain energy density at a receptor, indexed as in receptors(), after the last compute(), kPa;
  /// 0 beyond the reach.
  [[nodiscard]] double energy_density_kPa(std::size_t receptor) const noexcept;

 private:
  /// The bounding box of some receptors.
  struct Box {
    double left, right, bottom, top;
    [[nodiscard]] double nearest2(double x, double y) const noexcept;
    [[nodiscard]] double farthest2(double x, double y) const noexcept;
  };
  /// Squares of distances from a contact's axis, mm².
  struct Ranges {
    double reach2;
    double displaced2;     ///< within: its displacement alone exceeds the threshold
    double may_displace2;  ///< beyond: even all contacts together stay below the threshold
  };
  enum class Displaced : std::uint8_t { kNone, kSome, kAll };
  /// Displacements under one solved contact, which stay known while its tip stays in place and
  /// between the same two depths of its tables.
  struct Remembered {
    const TipField* field = nullptr;
    double x_mm = 0.0, y_mm = 0.0;
    std::size_t lower = 0;
    TipField::Blend blend;
    std::vector<std::uint8_t> known;
    std::vector<std::array<double, 2>> per_mm;

    void begin(const PlacedContact& placed) noexcept;
    [[nodiscard]] double displacement_mm(std::size_t receptor, double dx_mm, double dy_mm) noexcept;
  };

  void find_ranges(std::span<const PlacedContact> contacts) noexcept;
  [[nodiscard]] bool reaches(const Box& box) const noexcept;
  [[nodiscard]] Displaced displaced(const Box& box) const noexcept;
  [[nodiscard]] bool displaced(std::size_t receptor) noexcept;
  template <class Arrays>
  void drive_reached(Arrays& arrays, std::size_t first_neuron, std::size_t last_neuron) noexcept;
  template <class Arrays>
  void average_reached(Arrays& arrays, std::size_t first_neuron, std::size_t last_neuron) noexcept;
  void rest_unreached(std::size_t neuron) noexcept;

  Parameters parameters_;
  std::vector<Receptor> receptors_;
  std::vector<std::size_t> first_of_neuron_;  ///< N+1 offsets into receptors_
  std::vector<Box> box_of_neuron_;
  Box box_{};
  std::variant<ReceptorArrays<double>, ReceptorArrays<float>> arrays_;
  double resting_current_;  ///< of a receptor that is displaced but has no energy
  std::vector<PlacedContact> contacts_;
  std::vector<Ranges> ranges_;
  std::vector<double> output_;
  /// Receptors [first, last) whose energy density was computed last.
  struct Pressed {
    std::size_t first, last;
  };
  std::vector<Pressed> pressed_;
  Remembered alone_;
  std::size_t reached_ = 0;
  bool all_displaced_ = false;
};

}  // namespace merkel
