#pragma once

#include <functional>
#include <string>

#include "core/expected.hpp"

namespace merkel {

/// Where a figure's tables go and how much is computed for it.
struct FigureOptions {
  std::string folder;
  bool overwrite = false;
  int seeds = 100;                       ///< receptor draws for the statistics of Figs 6 and 7
  int scan_seeds = 20;                   ///< receptor draws for Fig. 8
  std::function<void(double)> progress;  ///< called with the fraction done; may be empty

  void report(double fraction) const {
    if (progress) progress(fraction);
  }
  [[nodiscard]] std::string path(const std::string& name) const { return folder + "/" + name; }
};

/// Each computes one figure of the paper from this model, writes its tables to the folder and
/// returns its part of the report (Markdown).
[[nodiscard]] Expected<std::string, SetupError> make_grating(const FigureOptions& options);
[[nodiscard]] Expected<std::string, SetupError> make_depth_profiles(const FigureOptions& options);
[[nodiscard]] Expected<std::string, SetupError> make_centre_press(const FigureOptions& options);
[[nodiscard]] Expected<std::string, SetupError> make_position_scan(const FigureOptions& options);
/// Not of the paper: force against depth by all contact laws.
[[nodiscard]] Expected<std::string, SetupError> make_contact_laws(const FigureOptions& options);

}  // namespace merkel
