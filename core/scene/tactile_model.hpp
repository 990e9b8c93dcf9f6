#pragma once

#include <chrono>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/afferent/patch.hpp"
#include "core/afferent/receptor_drive.hpp"
#include "core/afferent/receptor_placement.hpp"
#include "core/afferent/sigmoid_transduction.hpp"
#include "core/neuron/hodgkin_huxley_population.hpp"
#include "core/neuron/lattice_coupling.hpp"
#include "core/neuron/spike_buffer.hpp"
#include "core/parameter_error.hpp"
#include "core/realtime_tag.hpp"
#include "core/scene/contact_input.hpp"
#include "core/scene/indenter.hpp"
#include "core/scene/tip_contact.hpp"
#include "core/skin/skin_material.hpp"
#include "core/spike_event.hpp"

namespace merkel {

/// One patch of skin, its afferents and the probes that press on it: contact → stress → energy
/// density → current → membrane → spikes, a tick at a time.
///
/// Construct, reset, step: all memory is allocated by create(). The defaults are the paper's
/// fingertip under a sphere of 2 mm radius.
class TactileModel {
 public:
  struct Parameters {
    SkinParameters skin;
    Patch patch;
    ReceptorParameters receptors;
    SigmoidTransduction transduction;
    HodgkinHuxley neuron;
    IntegrationMethod method = IntegrationMethod::kCrankNicolson;
    Precision precision = Precision::kDouble;
    NetworkParameters network;
    std::vector<Indenter> indenters{Indenter{}};  ///< one a probe
    std::chrono::nanoseconds tick{1'000'000};
    std::chrono::nanoseconds step{25'000};  ///< divides the tick
  };

  /// Fails with the first parameter that cannot be. Real-time: no.
  [[nodiscard]] static Expected<TactileModel, ParameterError> create(const Parameters& parameters);

  /// Back to rest, without contact. Real-time: yes.
  void reset() noexcept MERKEL_REALTIME;

  /// Advances by one tick from `start`. The contacts are those at the tick's end, one an indenter;
  /// the currents run linearly from the previous tick's to theirs.
  /// \return the tick's spikes in order of time, valid until the next call.  Real-time: yes.
  std::span<SpikeEvent> step(std::span<const ContactInput> contacts_at_end,
                             std::chrono::nanoseconds start) noexcept MERKEL_REALTIME;

  /// The contact that an input makes with an indenter. Real-time: yes.
  [[nodiscard]] Press press(std::size_t indenter,
                            const ContactInput& input) const noexcept MERKEL_REALTIME {
    return tips_[indenter].press(input);
  }

  [[nodiscard]] std::size_t neurons() const noexcept { return population_.size(); }
  [[nodiscard]] std::size_t indenters() const noexcept { return tips_.size(); }
  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::span<const Receptor> receptors() const noexcept { return drive_.receptors(); }
  /// Current of every afferent at the end of the last tick, µA/cm².
  [[nodiscard]] std::span<const double> current_uA_per_cm2() const noexcept { return current_end_; }
  /// Strain energy density at every receptor at the end of the last tick, kPa.
  [[nodiscard]] std::span<const double> energy_density_kPa() const noexcept {
    return drive_.energy_density_kPa();
  }
  /// The deepest press of each indenter since reset.
  [[nodiscard]] std::span<const Press> deepest() const noexcept { return deepest_; }
  /// The least distance so far between the rims of two spheres' contacts that touch at once, in
  /// units of the larger radius; infinite where that never happened. Below 1, either contact lies
  /// where the other has bent the skin, which the sum of both does not know.
  [[nodiscard]] double closest_rims() const noexcept { return closest_rims_; }
  /// Neurons reset because their state had turned non-finite, since construction.
  [[nodiscard]] std::uint64_t resets() const noexcept { return resets_; }
  /// Spikes for which a tick's buffer had no room, since construction.
  [[nodiscard]] std::uint64_t spikes_refused() const noexcept { return spikes_.refused(); }

 private:
  TactileModel(const Parameters& parameters, std::vector<Receptor> receptors,
               std::optional<LatticeCoupling> network);
  void note_distances() noexcept;

  Parameters parameters_;
  int steps_;  ///< membrane steps a tick
  std::vector<TipContact> tips_;
  ReceptorDrive drive_;
  HodgkinHuxleyPopulation population_;
  std::vector<double> current_begin_;
  std::vector<double> current_end_;
  std::vector<PlacedContact> touching_;
  std::vector<Press> deepest_;
  std::uint64_t resets_ = 0;
  double closest_rims_ = std::numeric_limits<double>::infinity();
  SpikeBuffer spikes_;
};

}  // namespace merkel
