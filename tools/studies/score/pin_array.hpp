#pragma once

#include <cstddef>
#include <vector>

#include "core/contact/tip_field.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/receptors/receptor_placement.hpp"
#include "core/scene/afferents.hpp"
#include "core/scene/tactile_model.hpp"
#include "tools/studies/score/recordings.hpp"

namespace merkel {

/// Presses an array of pins on one afferent repeatedly. The contact of all pins with the finger is
/// solved before and after the increment; in between, the stress runs linearly.
class PinArrayTrials {
 public:
  /// Pins that are pressed deeper than the background: the middle one and then its neighbours.
  struct Increment {
    std::size_t pins = 1;
    double depth_mm = 0.1;
  };

  /// \param scene  gives skin, afferents and neurons; its probes are not used
  [[nodiscard]] static Expected<PinArrayTrials, ParameterError> create(
      const TactileModel::Parameters& scene, const PinArray& array, std::size_t trials);

  /// The contact of the array after an increment; with no pins, of the background. It takes
  /// about a second.
  [[nodiscard]] TipField field(const Increment& increment) const;

  /// Mean number of impulses in the second that begins with the increment, less those that the
  /// background alone evokes.
  /// \param increment  from field()
  /// \param x_mm,y_mm  of the receptive field's centre, from the middle pin's
  [[nodiscard]] double response(const TipField& increment, double x_mm, double y_mm);

 private:
  PinArrayTrials(const TactileModel& model, const PinArray& array, Afferents afferents);
  /// The afferent's input at the background (0), after the increment (1), or in between.
  [[nodiscard]] double input(const TipField& increment, double part, double x_mm,
                             double y_mm) const;
  /// Impulses of the mean trial in the second after settling.
  /// \param inputs  of the background, halfway and after the increment
  [[nodiscard]] double impulses(const double (&inputs)[3]);

  TactileModel::Parameters scene_;
  PinArray array_;
  std::vector<Receptor> receptors_;  ///< of the afferent, around its centre
  Afferents afferents_;
  TipField background_;
};

}  // namespace merkel
