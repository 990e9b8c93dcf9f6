#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// The result of one check of an installed program.
struct SelfCheck {
  std::string what;     ///< "golden spikes with avx2"
  std::string finding;  ///< what was compared or, if it failed, the first difference
  bool passed = false;
  bool host_refused = false;  ///< not run: the host lacks what it needs
};

/// The first row in which two spike files differ, as a sentence; empty if they agree. Comments are
/// ignored.
[[nodiscard]] std::string spike_rows_differ(std::string_view wanted, std::string_view found);

/// Runs every preset through the press of the golden spikes with one instruction set. Restores the
/// automatic choice. \param target  one of simd_targets() \param folder  for spike files
[[nodiscard]] SelfCheck check_golden_spikes(const std::string& target, const std::string& folder);

/// Reads a simulated device on a pseudo-terminal in real time, and replays the recorded session.
/// \param folder  for the session
[[nodiscard]] SelfCheck check_loopback_device(const std::string& folder);

}  // namespace merkel
