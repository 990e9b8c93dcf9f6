#include "core/receptors/sigmoid_transduction.hpp"

namespace merkel {

FieldTable SigmoidTransduction::fields() {
  using P = SigmoidTransduction;
  static constexpr Field kFields[] = {
      {"alpha_uA_per_cm2", "µA/cm²", not_negative(1e6), "largest current of one receptor",
       at<&P::alpha_uA_per_cm2>},
      {"lambda_kPa", "kPa", from_to(-1e6, 1e6), "strain energy density at half the largest current",
       at<&P::lambda_kPa>},
      {"gamma_per_kPa", "1/kPa", positive(1e9), "slope of the sigmoid", at<&P::gamma_per_kPa>},
      {"threshold_um", "µm", not_negative(1e6),
       "smallest surface displacement at which a receptor responds", at<&P::threshold_um>}};
  return {"transduction", kFields};
}

Expected<void, ParameterError> SigmoidTransduction::check() const {
  return ParameterCheck().fields(*this).result();
}

}  // namespace merkel
