#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/contact/indenter.hpp"
#include "core/neurons/connor_stevens/connor_stevens.hpp"
#include "core/neurons/hodgkin_huxley/hodgkin_huxley.hpp"
#include "core/neurons/hodgkin_huxley/integration_method.hpp"
#include "core/neurons/hodgkin_huxley/lattice_coupling.hpp"
#include "core/neurons/integrate_and_fire/integrate_and_fire.hpp"
#include "core/neurons/neuron_noise.hpp"
#include "core/precision.hpp"
#include "core/receptors/adaptation.hpp"
#include "core/receptors/patch.hpp"
#include "core/receptors/receptive_field.hpp"
#include "core/receptors/receptor_placement.hpp"
#include "core/receptors/sigmoid_transduction.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// A patch of skin: its afferents and its receptors.
struct PatchParameters {
  std::string name;
  Patch patch;
  /// Placement of the receptors, or with receptive fields, of the fields' centres.
  ReceptorParameters receptors;
  ReceptorLayout layout = ReceptorLayout::kSubregions;
  ReceptiveField field;              ///< for ReceptorLayout::kFields
  std::vector<FieldCentre> centres;  ///< of the fields; empty: by the density law

  [[nodiscard]] static FieldTable fields();
};

/// The paper's afferent: the summed currents of its receptors drive a Hodgkin-Huxley neuron.
struct HodgkinHuxleyAfferent {
  HodgkinHuxley neuron;
  IntegrationMethod method = IntegrationMethod::kCrankNicolson;
  Precision precision = Precision::kDouble;  ///< of neurons and receptors

  [[nodiscard]] static FieldTable fields();
};

/// The adapted mean energy density of a receptive field drives a noisy integrate-and-fire neuron.
struct IntegrateAndFireAfferent {
  IntegrateAndFire neuron;
};

/// The adapted mean energy density drives a noisy Connor-Stevens neuron through its inverse f–I
/// curve: it receives the current at which it fires at I/(1 + compression·I), with the drive I in
/// Hz.
struct ConnorStevensAfferent {
  ConnorStevens neuron;
  double compression_ms = 1.0;

  [[nodiscard]] static FieldTable fields();
};

using AfferentParameters =
    std::variant<HodgkinHuxleyAfferent, IntegrateAndFireAfferent, ConnorStevensAfferent>;

/// The alternatives of AfferentParameters, in their order.
enum class NeuronKind : std::uint8_t { kHodgkinHuxley, kIntegrateAndFire, kConnorStevens };

/// Approximations and their tolerances.
struct AccuracyParameters {
  /// A receptor is skipped if the press can change its current by at most this fraction of α or, if
  /// energy density is the drive, its energy density by at most this many kPa. 0 skips none.
  double cull_tolerance = 1e-4;
  bool freeze_resting = true;  ///< do not step neurons that are at rest

  [[nodiscard]] static FieldTable fields();
};

/// All parameters of a TactileModel. The defaults are the paper's fingertip under a sphere of 2 mm
/// radius.
struct ModelParameters {
  SkinParameters skin;
  std::vector<PatchParameters> patches{PatchParameters{}};
  AfferentParameters afferent;
  SigmoidTransduction transduction;  ///< of Hodgkin-Huxley afferents
  NetworkParameters
      network;  ///< of Hodgkin-Huxley afferents, in each patch; seeds count up by patch
  AdaptationParameters adaptation;  ///< of all other afferents
  AccuracyParameters accuracy;
  std::vector<Indenter> indenters{Indenter{}};  ///< one per probe
  std::chrono::nanoseconds tick{1'000'000};
  std::chrono::nanoseconds step{25'000};  ///< of the neurons; divides the tick

  /// Whether a tip is a tactile array.
  [[nodiscard]] bool has_arrays() const noexcept {
    return std::any_of(indenters.begin(), indenters.end(),
                       [](const Indenter& indenter) { return indenter.prescribed(); });
  }
  [[nodiscard]] NeuronKind kind() const noexcept {
    return static_cast<NeuronKind>(afferent.index());
  }
  /// Whether the adapted mean energy density drives the neurons, rather than receptor currents.
  [[nodiscard]] bool energy_driven() const noexcept { return kind() != NeuronKind::kHodgkinHuxley; }
  [[nodiscard]] Precision precision() const noexcept {
    const auto* const paper = std::get_if<HodgkinHuxleyAfferent>(&afferent);
    return paper == nullptr ? Precision::kDouble : paper->precision;
  }
  /// The noise of the neurons; null for Hodgkin-Huxley neurons, which have none.
  [[nodiscard]] const NeuronNoise* noise() const noexcept;
  [[nodiscard]] NeuronNoise* noise() noexcept {
    return const_cast<NeuronNoise*>(std::as_const(*this).noise());
  }
};

/// Sets the default afferent of a kind, with its default step. Real-time: no.
void set_kind(ModelParameters& model, NeuronKind kind);

}  // namespace merkel
