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
  return {.re = std::vector<double>(half_ * rows_), .im = std::vector<double>(half_ * rows_)};
}

// A spectrum is stored by wave number along x, then along y. Two real rows are transformed as one
// complex sequence: the even part of its spectrum belongs to the first, the odd part to the second.
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
    for (std::size_t k = 0; k < half_; ++k) {
      const std::size_t here = k * kBatch;
      const std::size_t mirrored = (k == 0 ? 0 : columns_ - k) * kBatch;
      double* const to_re = spectrum.re.data() + k * rows_ + first;
      double* const to_im = spectrum.im.data() + k * rows_ + first;
      for (std::size_t r = 0; r < batch; ++r) {
        const std::size_t b = r / 2;
        const double re = re_[here + b];
        const double im = im_[here + b];
        const double mirrored_re = re_[mirrored + b];
        const double mirrored_im = im_[mirrored + b];
        to_re[r] = 0.5 * (r % 2 == 0 ? re + mirrored_re : im + mirrored_im);
        to_im[r] = 0.5 * (r % 2 == 0 ? im - mirrored_im : mirrored_re - re);
      }
    }
  }
  columns_forward(rows, spectrum);
}

void GridTransform::columns_forward(std::size_t rows, GridSpectrum& spectrum) noexcept {
  for (std::size_t first = 0; first < half_; first += kBatch) {
    const std::size_t batch = std::min(kBatch, half_ - first);
    std::fill(re_.begin(), re_.end(), 0.0);
    std::fill(im_.begin(), im_.end(), 0.0);
    for (std::size_t b = 0; b < batch; ++b) {
      for (std::size_t y = 0; y < rows; ++y) {
        re_[y * kBatch + b] = spectrum.re[(first + b) * rows_ + y];
        im_[y * kBatch + b] = spectrum.im[(first + b) * rows_ + y];
      }
    }
    along_y_.forward(re_.data(), im_.data(), kBatch, work_re_.data(), work_im_.data());
    for (std::size_t b = 0; b < batch; ++b) {
      for (std::size_t y = 0; y < rows_; ++y) {
        spectrum.re[(first + b) * rows_ + y] = re_[y * kBatch + b];
        spectrum.im[(first + b) * rows_ + y] = im_[y * kBatch + b];
      }
    }
  }
}

void GridTransform::convolve(const GridSpectrum& spectrum, const GridSpectrum& kernel,
                             std::size_t columns, std::size_t rows,
                             std::span<double> image) noexcept {
  assert(image.size() == columns * rows && columns <= columns_ && rows <= rows_);
  for (std::size_t first = 0; first < half_; first += kBatch) {
    const std::size_t batch = std::min(kBatch, half_ - first);
    for (std::size_t b = 0; b < batch; ++b) {
      const std::size_t at = (first + b) * rows_;
      for (std::size_t y = 0; y < rows_; ++y) {
        const double re = spectrum.re[at + y];
        const double im = spectrum.im[at + y];
        re_[y * kBatch + b] = re * kernel.re[at + y] - im * kernel.im[at + y];
        im_[y * kBatch + b] = re * kernel.im[at + y] + im * kernel.re[at + y];
      }
    }
    along_y_.inverse(re_.data(), im_.data(), kBatch, work_re_.data(), work_im_.data());
    for (std::size_t b = 0; b < batch; ++b) {
      for (std::size_t y = 0; y < rows; ++y) {
        product_.re[(first + b) * rows_ + y] = re_[y * kBatch + b];
        product_.im[(first + b) * rows_ + y] = im_[y * kBatch + b];
      }
    }
  }
  const double scale = 1.0 / (static_cast<double>(columns_) * static_cast<double>(rows_));
  for (std::size_t first = 0; first < rows; first += 2 * kBatch) {
    const std::size_t batch = std::min(2 * kBatch, rows - first);
    std::fill(re_.begin(), re_.end(), 0.0);
    std::fill(im_.begin(), im_.end(), 0.0);
    for (std::size_t k = 0; k < half_; ++k) {
      const std::size_t here = k * kBatch;
      const std::size_t mirrored = (k == 0 ? 0 : columns_ - k) * kBatch;
      const double* const from_re = product_.re.data() + k * rows_ + first;
      const double* const from_im = product_.im.data() + k * rows_ + first;
      for (std::size_t r = 0; r < batch; r += 2) {
        const std::size_t b = r / 2;
        const double other_re = r + 1 < batch ? from_re[r + 1] : 0.0;
        const double other_im = r + 1 < batch ? from_im[r + 1] : 0.0;
        // first + i·second; the mirrored wave number has the conjugates.
        re_[here + b] = from_re[r] - other_im;
        im_[here + b] = from_im[r] + other_re;
        if (mirrored != here) {
          re_[mirrored + b] = from_re[r] + other_im;
          im_[mirrored + b] = other_re - from_im[r];
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
