#pragma once

#include <string>
#include <vector>

#include "tools/json_text.hpp"

namespace merkel {

/// An error in a field of a data file; caught where the file is read.
struct JsonFault {
  std::string sentence;
};

[[noreturn]] void refuse_field(const std::string& field, const std::string& reason);

/// The fields of one JSON object. Looked-up fields are known; finish() reports an unknown one.
/// All throw JsonFault.
class JsonFields {
 public:
  JsonFields(const Json& object, std::string name);

  [[nodiscard]] std::string full(const std::string& key) const {
    return name_.empty() ? key : name_ + "." + key;
  }
  /// Null if absent.
  const Json* find(const std::string& key);
  const Json& need(const std::string& key);
  std::string text(const std::string& key);
  bool truth(const std::string& key, bool otherwise);
  double number(const std::string& key, double otherwise, bool may_be_zero = false);
  std::vector<double> numbers(const std::string& key, bool may_be_negative = false);
  static double number_of(const Json& value, const std::string& field, bool may_be_zero = true,
                          bool may_be_negative = false);
  static std::vector<double> numbers_of(const Json& value, const std::string& field,
                                        bool may_be_negative = false);
  void finish();
  [[nodiscard]] const Json& object() const { return object_; }

 private:
  const Json& object_;
  std::string name_;
  std::vector<std::string> known_;
};

/// The number before a unit at the end of a key, as 0.098 in "10gwt_0.098N"; positive.
[[nodiscard]] double quantity(const std::string& key, const std::string& unit,
                              const std::string& field, const std::string& example);

[[nodiscard]] bool ends_in(const std::string& key, const std::string& unit);

}  // namespace merkel
