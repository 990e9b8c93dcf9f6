#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>
#include <variant>

#include "core/expected.hpp"
#include "core/neurons/hodgkin_huxley/hodgkin_huxley.hpp"
#include "core/neurons/hodgkin_huxley/integration_method.hpp"
#include "core/neurons/integrate_and_fire/integrate_and_fire.hpp"
#include "core/neurons/neuron_noise.hpp"
#include "core/parameters/field.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/precision.hpp"

namespace merkel {

class Afferents;
struct AfferentTables;
struct ModelParameters;

// The kinds of afferents: one struct each, with the same members. A new kind is a struct here, its
// functions in afferent_kinds.cpp, and an alternative of AfferentParameters and NeuronKind.
//
//   kName, kDefaultStep   as a scene says them
//   kEnergyDriven         whether the adapted mean energy density drives it, in Hz, rather than
//                         the currents of its receptors, in µA/cm²
//   kPotential            whether it has a membrane potential in mV
//   bind()                appends its keys of [neuron]
//   check()               rejects parameters, also those of the model that it cannot work with
//   noise()               of its neurons; null: they have none
//   shortest_interval_ms()  between two spikes of a neuron, at least
//   tables(), afferents()   see afferent_tables_of() and Afferents::create()

/// The paper's afferent: the summed currents of its receptors drive a Hodgkin-Huxley neuron.
struct HodgkinHuxleyAfferent {
  static constexpr std::string_view kName = "hodgkin_huxley";
  static constexpr std::chrono::microseconds kDefaultStep{25};
  static constexpr bool kEnergyDriven = false;
  static constexpr bool kPotential = true;

  HodgkinHuxley neuron;
  IntegrationMethod method = IntegrationMethod::kCrankNicolson;
  Precision precision = Precision::kDouble;  ///< of neurons and receptors

  [[nodiscard]] static FieldTable fields();
  void bind(BoundFields& fields);
  [[nodiscard]] Expected<void, ParameterError> check(const ModelParameters& model) const;
  [[nodiscard]] const NeuronNoise* noise() const noexcept { return nullptr; }
  [[nodiscard]] double shortest_interval_ms() const noexcept { return 1.0; }
  [[nodiscard]] AfferentTables tables(const ModelParameters& model) const;
  [[nodiscard]] Expected<Afferents, ParameterError> afferents(const ModelParameters& model,
                                                              std::size_t patch,
                                                              std::size_t neurons,
                                                              std::uint32_t first_neuron,
                                                              const AfferentTables& tables) const;
};

/// The adapted mean energy density of a receptive field drives a noisy integrate-and-fire neuron.
struct IntegrateAndFireAfferent {
  static constexpr std::string_view kName = "integrate_and_fire";
  static constexpr std::chrono::microseconds kDefaultStep{500};
  static constexpr bool kEnergyDriven = true;
  static constexpr bool kPotential = false;

  IntegrateAndFire neuron;

  void bind(BoundFields& fields);
  [[nodiscard]] Expected<void, ParameterError> check(const ModelParameters& model) const;
  [[nodiscard]] const NeuronNoise* noise() const noexcept { return &neuron.noise; }
  [[nodiscard]] double shortest_interval_ms() const noexcept { return neuron.refractory_ms; }
  [[nodiscard]] AfferentTables tables(const ModelParameters& model) const;
  [[nodiscard]] Expected<Afferents, ParameterError> afferents(const ModelParameters& model,
                                                              std::size_t patch,
                                                              std::size_t neurons,
                                                              std::uint32_t first_neuron,
                                                              const AfferentTables& tables) const;
};

using AfferentParameters = std::variant<HodgkinHuxleyAfferent, IntegrateAndFireAfferent>;

/// The alternatives of AfferentParameters, in their order.
enum class NeuronKind : std::uint8_t { kHodgkinHuxley, kIntegrateAndFire };

/// Names of the kinds in a scene, in the order of NeuronKind.
inline constexpr auto kNeuronKinds = []<std::size_t... I>(std::index_sequence<I...>) {
  return std::array{std::variant_alternative_t<I, AfferentParameters>::kName...};
}
(std::make_index_sequence<std::variant_size_v<AfferentParameters>>());

[[nodiscard]] constexpr std::string_view name_of(NeuronKind kind) noexcept {
  return kNeuronKinds[static_cast<std::size_t>(kind)];
}

/// Sets the default afferent of a kind, with its default step. Real-time: no.
void set_kind(ModelParameters& model, NeuronKind kind);

}  // namespace merkel
