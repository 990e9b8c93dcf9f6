#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/expected.hpp"

namespace merkel {

/// A parameter that no scene can have: which key, and what it must be.
struct ParameterError {
  std::string key;     ///< as in a scene file, for example "skin.poisson_ratio"
  std::string reason;  ///< "must be … , but is …"
};

/// Collects the first thing wrong with a set of parameters.
///
/// \code
///   return ParameterCheck().positive("probe.radius_mm", p.radius_mm).result();
/// \endcode
/// Every check also refuses NaN. Real-time: no (it builds strings).
class ParameterCheck {
 public:
  /// Finite and > 0.
  ParameterCheck& positive(std::string_view key, double value);
  /// > 0; +infinity is allowed and means "flat", "unlimited" or "absent".
  ParameterCheck& positive_or_infinite(std::string_view key, double value);
  /// Finite and ≥ 0.
  ParameterCheck& not_negative(std::string_view key, double value);
  ParameterCheck& finite(std::string_view key, double value);
  /// low ≤ value < high.
  ParameterCheck& in_range(std::string_view key, double value, double low, double high);
  /// low ≤ value ≤ high, for whole numbers.
  ParameterCheck& whole_in_range(std::string_view key, long long value, long long low,
                                 long long high);
  /// A condition between parameters.
  ParameterCheck& require(bool condition, std::string_view key, std::string_view reason);
  /// A nested check's outcome.
  ParameterCheck& also(const Expected<void, ParameterError>& other);

  [[nodiscard]] Expected<void, ParameterError> result() const;

 private:
  void fail(std::string_view key, std::string reason);
  std::optional<ParameterError> first_;
};

/// The shortest decimal that reads back as the same double.
[[nodiscard]] std::string shortest_decimal(double value);

}  // namespace merkel
