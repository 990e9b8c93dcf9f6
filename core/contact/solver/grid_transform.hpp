#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/math/fourier_transform.hpp"

namespace merkel {

/// The Fourier transform of a real image: half of the columns' wave numbers, since the others are
/// their complex conjugates.
struct GridSpectrum {
  std::vector<double> re;
  std::vector<double> im;
};

/// Fourier transforms of real images whose data fill only a part of a periodic rectangle; convolves
/// pressures with the responses of the skin. An instance holds its work space: one per thread.
/// Real-time: yes, after construction.
class GridTransform {
 public:
  /// \param columns, rows  of the rectangle, in pixels: powers of two, at least 4
  GridTransform(std::size_t columns, std::size_t rows);

  [[nodiscard]] std::size_t columns() const noexcept { return columns_; }
  [[nodiscard]] std::size_t rows() const noexcept { return rows_; }
  [[nodiscard]] GridSpectrum make_spectrum() const;

  /// The transform of an image of `rows` × `columns` pixels, row by row, zero elsewhere.
  void forward(std::span<const double> image, std::size_t columns, std::size_t rows,
               GridSpectrum& spectrum) noexcept;
  /// The first rows and columns of the image of spectrum·kernel.
  void convolve(const GridSpectrum& spectrum, const GridSpectrum& kernel, std::size_t columns,
                std::size_t rows, std::span<double> image) noexcept;

 private:
  static constexpr std::size_t kBatch = 8;  ///< sequences transformed side by side

  /// Blocks of kBatch wave numbers along x.
  [[nodiscard]] std::size_t blocks() const noexcept { return (half_ + kBatch - 1) / kBatch; }
  /// Of a value in a spectrum: wave number along x, and row or wave number along y.
  [[nodiscard]] std::size_t place(std::size_t k, std::size_t y) const noexcept {
    return (k / kBatch * rows_ + y) * kBatch + k % kBatch;
  }

  std::size_t columns_;
  std::size_t rows_;
  std::size_t half_;  ///< wave numbers along x: columns/2 + 1
  FourierTransform along_x_;
  FourierTransform along_y_;
  GridSpectrum product_;
  std::vector<double> re_, im_, work_re_, work_im_;  ///< of kBatch sequences
};

}  // namespace merkel
