#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/contact/indenter.hpp"
#include "core/neurons/hodgkin_huxley/lattice_coupling.hpp"
#include "core/neurons/neuron_noise.hpp"
#include "core/precision.hpp"
#include "core/receptors/adaptation.hpp"
#include "core/receptors/patch.hpp"
#include "core/receptors/receptive_field.hpp"
#include "core/receptors/receptor_placement.hpp"
#include "core/receptors/sigmoid_transduction.hpp"
#include "core/scene/afferent_kinds.hpp"
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
  std::chrono::nanoseconds step =
      HodgkinHuxleyAfferent::kDefaultStep;  ///< of the neurons; divides the tick

  /// Whether a tip is a tactile array.
  [[nodiscard]] bool has_arrays() const noexcept {
    return std::any_of(indenters.begin(), indenters.end(),
                       [](const Indenter& indenter) { return indenter.taxels() != nullptr; });
  }
  [[nodiscard]] NeuronKind kind() const noexcept {
    return static_cast<NeuronKind>(afferent.index());
  }
  /// Whether the adapted mean energy density drives the neurons, rather than receptor currents.
  [[nodiscard]] bool energy_driven() const noexcept {
    return std::visit([](const auto& each) { return each.kEnergyDriven; }, afferent);
  }
  [[nodiscard]] Precision precision() const noexcept {
    const auto* const paper = std::get_if<HodgkinHuxleyAfferent>(&afferent);
    return paper == nullptr ? Precision::kDouble : paper->precision;
  }
  /// The noise of the neurons; null for Hodgkin-Huxley neurons, which have none.
  [[nodiscard]] const NeuronNoise* noise() const noexcept {
    return std::visit([](const auto& each) { return each.noise(); }, afferent);
  }
  [[nodiscard]] NeuronNoise* noise() noexcept {
    return const_cast<NeuronNoise*>(std::as_const(*this).noise());
  }
};

}  // namespace merkel
