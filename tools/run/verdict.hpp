#pragma once

#include <string>
#include <vector>

#include "core/scene/tactile_model.hpp"
#include "realtime/pipeline.hpp"
#include "tools/json_text.hpp"

namespace merkel {

/// One problem of a run, and its remedy.
struct Finding {
  /// The effect of the finding on the exit code.
  enum class Severity {
    kNote,    ///< none
    kLoss,    ///< --strict: 1
    kFailure  ///< 1: touch, a spike or a command was lost, more than 1 % of the ticks were
              ///< skipped, or the loop was demoted
  };
  Severity severity = Severity::kNote;
  double weight = 0.0;  ///< affected share of the run; orders findings of equal severity
  std::string kind;     ///< "late"
  Json facts;           ///< that the sentence says
  std::string sentence;
  std::string remedy;
};

/// The problems that a run's counters show: at most five findings, the worst first; empty if all
/// went well.
[[nodiscard]] std::vector<Finding> verdict_of(const RunReport& report, const TactileModel& model);

/// The findings as one line of a table, or "ok".
[[nodiscard]] std::string findings_text(const std::vector<Finding>& findings);
[[nodiscard]] Json verdict_json(const std::vector<Finding>& findings);

/// True if a run with these findings has failed. \param strict  any loss is a failure
[[nodiscard]] bool failed(const std::vector<Finding>& findings, bool strict);

}  // namespace merkel
