#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/expected.hpp"
#include "core/parameters/field.hpp"

namespace merkel {

/// An invalid parameter: its key, and what its value must be.
struct ParameterError {
  std::string key;     ///< as in a scene file, for example "skin.poisson_ratio"
  std::string reason;  ///< "must be … , but is …"
};

/// Finds the first error in a set of parameters.
///
/// \code
///   return ParameterCheck().fields(*this).require(low < high, "skin.low", "must be below
///   high").result();
/// \endcode
/// Every check also rejects NaN. Real-time: no (it builds strings).
class ParameterCheck {
 public:
  /// Checks every field of a struct that has a field table against the field's range.
  template <class P>
  ParameterCheck& fields(const P& parameters) {
    P copy = parameters;
    return fields(bind_fields(copy));
  }
  ParameterCheck& fields(const BoundFields& fields);
  /// Checks one number.
  ParameterCheck& number(std::string_view key, double value, const Range& range);
  /// Checks a condition between parameters.
  ParameterCheck& require(bool condition, std::string_view key, std::string_view reason);
  /// Adds the result of a nested check.
  ParameterCheck& also(const Expected<void, ParameterError>& other);

  [[nodiscard]] Expected<void, ParameterError> result() const;

 private:
  void fail(std::string_view key, std::string reason);
  std::optional<ParameterError> first_;
};

}  // namespace merkel
