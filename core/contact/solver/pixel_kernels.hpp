#pragma once

#include <cstddef>
#include <vector>

#include "core/contact/solver/grid_transform.hpp"
#include "core/contact/solver/height_map.hpp"
#include "core/contact/solver/layered_medium.hpp"

namespace merkel {

/// The smallest power of two that is at least `pixels`, and at least 32.
[[nodiscard]] std::size_t padded_pixels(std::size_t pixels) noexcept;

/// Displacement of the surface by a uniform pressure of 1 kPa on a square pixel at the origin, on a
/// half-space, times E* (Love 1929; Johnson, Contact Mechanics, Eq. 3.25).
[[nodiscard]] double pixel_displacement_mm(double x_mm, double y_mm, double pixel_mm) noexcept;

/// What is computed from the pressure at the pixels of a contact.
enum class PixelField : std::size_t {
  kSigmaX,
  kSigmaY,
  kSigmaZ,
  kTauXy,
  kTauYz,
  kTauZx,
  kDisplacement
};
inline constexpr std::size_t kPixelFields = 7;

/// The transformed response of a field to a uniform pressure of 1 kPa on a pixel: kPa at a depth,
/// mm on the surface. Convolves pressures on the rectangle `contact` to fields on the rectangle
/// `window`, which has the same middle; its sides exceed the contact's by an even number of pixels.
/// Real-time: no.
class PixelKernels {
 public:
  PixelKernels(const LayeredMedium& medium, double z_mm, const PixelGrid& contact,
               const PixelGrid& window);

  /// The kernel of one field, ready for transform().convolve().
  [[nodiscard]] GridSpectrum kernel(PixelField field);
  [[nodiscard]] GridTransform& transform() noexcept { return transform_; }

 private:
  void compute_responses();

  LayeredMedium medium_;
  double z_mm_;
  PixelGrid contact_;
  PixelGrid window_;
  GridTransform transform_;
  /// Fields at offsets of 0, 1 … pixels in both directions; made when first needed.
  struct Response {
    CartesianStress stress;
    double excess_displacement_mm = 0.0;
  };
  std::vector<Response> responses_;
  std::size_t most_columns_;
  std::size_t most_rows_;
};

}  // namespace merkel
