#include "core/receptors/sigmoid_transduction.hpp"

namespace merkel {

Expected<void, ParameterError> SigmoidTransduction::check() const {
  return ParameterCheck()
      .not_negative("transduction.alpha_uA_per_cm2", alpha_uA_per_cm2)
      .finite("transduction.lambda_kPa", lambda_kPa)
      .positive("transduction.gamma_per_kPa", gamma_per_kPa)
      .not_negative("transduction.threshold_um", threshold_um)
      .result();
}

}  // namespace merkel
