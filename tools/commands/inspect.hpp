#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/contact/sliding_contact.hpp"
#include "core/expected.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

struct InspectOptions {
  std::string scene;
  std::optional<double> radius_mm;
  std::optional<double> depth_mm;
  std::optional<double> force_N;
  std::vector<double> r_mm;
  std::vector<double> z_mm;
  bool printed = false;
  std::string folder;       ///< of a picture; empty: none
  bool all_depths = false;  ///< without a depth or force, all depths of a solved contact
  std::optional<double> current;
  std::vector<double> ramp;
  double duration_ms = 200.0;
  std::string method = "crank_nicolson";
  double step_us = 25.0;
  std::vector<std::string> settings;
  std::vector<std::string> probes;
  std::optional<double> duration_s;
};

/// The requested scene; if a sphere was given, it replaces the tip of the first probe.
[[nodiscard]] Expected<Scene, SetupError> scene_of(const InspectOptions& options);

/// The tip and the press that a command line describes.
struct InspectedPress {
  SkinParameters skin;
  Indenter indenter;
  Press press;
  ContactInput input = {};  ///< of a surface: its middle lies under the finger's apex
  std::chrono::nanoseconds tick{};
};

[[nodiscard]] Expected<InspectedPress, SetupError> press_of(const InspectOptions& options);
/// A surface at rest under the finger.
[[nodiscard]] std::unique_ptr<SlidingContact> settled(const InspectedPress& inspected,
                                                      const SkinParameters& skin);

// Each function prints a part of the model and returns the program's exit code.
int inspect_contact(const InspectOptions& options);
int inspect_field(const InspectOptions& options);
int inspect_encoding(const InspectOptions& options);
int inspect_neuron(const InspectOptions& options);

}  // namespace merkel
