#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "core/scene/tactile_model.hpp"
#include "realtime/pipeline.hpp"

namespace merkel {

/// One sentence about what went wrong in a run, and what to do about it.
struct Finding {
  /// What the finding makes of the exit code.
  enum class Severity {
    kNote,    ///< nothing
    kLoss,    ///< --strict: 1
    kFailure  ///< 1: touch, a spike or a command was lost, more than 1 % of the ticks were
              ///< skipped, or the loop was demoted
  };
  Severity severity = Severity::kNote;
  double weight = 0.0;  ///< share of the run that it spoiled; among equals the worst comes first
  std::string sentence;
  std::string remedy;
};

/// What a run's counters mean for its user: at most five findings, worst first; none where all went
/// well.
[[nodiscard]] std::vector<Finding> verdict_of(const RunReport& report, const TactileModel& model);

/// For people: one line a finding, or one that says that all went well.
[[nodiscard]] std::string verdict_text(const std::vector<Finding>& findings,
                                       const RunReport& report);
[[nodiscard]] nlohmann::ordered_json verdict_json(const std::vector<Finding>& findings);

/// Whether a run with these findings has failed. \param strict  any loss is a failure
[[nodiscard]] bool failed(const std::vector<Finding>& findings, bool strict);

}  // namespace merkel
