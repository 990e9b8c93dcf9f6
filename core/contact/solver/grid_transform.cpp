#include "core/contact/solver/grid_transform.hpp"

#include <algorithm>
#include <cassert>

namespace merkel {

GridTransform::GridTransform(std::size_t columns, std::size_t rows)
    : columns_(columns),
      rows_(rows),
      half_(columns / 2 + 1),
      along_x_(columns),
      along_y_(rows),
      product_(make_spectrum()) {
  for (auto* const work : {&re_, &im_, &work_re_, &work_im_}) {
    work->resize(std::max(columns, rows) * kBatch);
  }
}

GridSpectrum GridTransform::make_spectrum() const {
  const std::size_t size = blocks() * rows_ * kBatch;
  return {.re = std::vector<double>(size), .im = std::vector<double>(size)};
}

// A spectrum is stored in blocks of kBatch wave numbers along x; within a block, by wave number
// along y. Two real rows are transformed as one complex sequence: the even part of its spectrum
// belongs to the first, the odd part to the second.
void GridTransform::forward(std::span<const double> image, std::size_t columns, std::size_t rows,
                            GridSpectrum& spectrum) noexcept {
  assert(image.size() == columns * rows && columns <= columns_ && rows <= rows_);
  for (std::size_t first = 0; first < rows; first += 2 * kBatch) {
    std::fill(re_.begin(), re_.end(), 0.0);
    std::fill(im_.begin(), im_.end(), 0.0);
    const std::size_t batch = std::min(2 * kBatch, rows - first);
    for (std::size_t r = 0; r < batch; ++r) {
      const double* const row = image.data() + (first + r) * columns;
      double* const to = (r % 2 == 0 ? re_ : im_).data() + r / 2;
      for (std::size_t x = 0; x < columns; ++x) to[x * kBatch] = row[x];
    }
    along_x_.forward(re_.data(), im_.data(), kBatch, work_re_.data(), work_im_.data());
    for (std::size_t r = 0; r < batch; ++r) {
      const bool even = r % 2 == 0;
      const double* const own = (even ? re_ : im_).data() + r / 2;
      const double* const other = (even ? im_ : re_).data() + r / 2;
      const double sign = even ? 0.5 : -0.5;
      for (std::size_t k = 0; k < half_; ++k) {
        const std::size_t here = k * kBatch;
        const std::size_t mirrored = (k == 0 ? 0 : columns_ - k) * kBatch;
        const std::size_t to = place(k, first + r);
        spectrum.re[to] = 0.5 * (own[here] + own[mirrored]);
        spectrum.im[to] = sign * (other[here] - other[mirrored]);
      }
    }
  }
  const std::size_t block = rows_ * kBatch;
  for (std::size_t at = 0; at < spectrum.re.size(); at += block) {
    double* const re = spectrum.re.data() + at;
    double* const im = spectrum.im.data() + at;
    std::fill(re + rows * kBatch, re + block, 0.0);
    std::fill(im + rows * kBatch, im + block, 0.0);
    along_y_.forward(re, im, kBatch, work_re_.data(), work_im_.data());
  }
}

void GridTransform::convolve(const GridSpectrum& spectrum, const GridSpectrum& kernel,
                             std::size_t columns, std::size_t rows,
                             std::span<double> image) noexcept {
  assert(image.size() == columns * rows && columns <= columns_ && rows <= rows_);
  for (std::size_t i = 0; i < product_.re.size(); ++i) {
    product_.re[i] = spectrum.re[i] * kernel.re[i] - spectrum.im[i] * kernel.im[i];
    product_.im[i] = spectrum.re[i] * kernel.im[i] + spectrum.im[i] * kernel.re[i];
  }
  for (std::size_t at = 0; at < product_.re.size(); at += rows_ * kBatch) {
    along_y_.inverse(product_.re.data() + at, product_.im.data() + at, kBatch, work_re_.data(),
                     work_im_.data());
  }
  const double scale = 1.0 / (static_cast<double>(columns_) * static_cast<double>(rows_));
  for (std::size_t first = 0; first < rows; first += 2 * kBatch) {
    const std::size_t batch = std::min(2 * kBatch, rows - first);
    std::fill(re_.begin(), re_.end(), 0.0);
    std::fill(im_.begin(), im_.end(), 0.0);
    for (std::size_t r = 0; r < batch; r += 2) {
      const bool both = r + 1 < batch;
      const std::size_t b = r / 2;
      for (std::size_t k = 0; k < half_; ++k) {
        const std::size_t here = k * kBatch;
        const std::size_t mirrored = (k == 0 ? 0 : columns_ - k) * kBatch;
        const std::size_t from = place(k, first + r);
        const double other_re = both ? product_.re[from + kBatch] : 0.0;
        const double other_im = both ? product_.im[from + kBatch] : 0.0;
        // first + i·second; the mirrored wave number has the conjugates.
        re_[here + b] = product_.re[from] - other_im;
        im_[here + b] = product_.im[from] + other_re;
        if (mirrored != here) {
          re_[mirrored + b] = product_.re[from] + other_im;
          im_[mirrored + b] = other_re - product_.im[from];
        }
      }
    }
    along_x_.inverse(re_.data(), im_.data(), kBatch, work_re_.data(), work_im_.data());
    for (std::size_t r = 0; r < batch; ++r) {
      const double* const from = (r % 2 == 0 ? re_ : im_).data() + r / 2;
      double* const row = image.data() + (first + r) * columns;
      for (std::size_t x = 0; x < columns; ++x) row[x] = scale * from[x * kBatch];
    }
  }
}

}  // namespace merkel
