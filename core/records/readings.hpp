#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/records/probe_sample.hpp"
#include "core/records/sync_edge.hpp"
#include "core/records/taxel_block.hpp"

namespace merkel {

/// The head of a reading of a device; its values are a row. Plain data.
struct ReadingHead {
  std::chrono::nanoseconds time{0};       ///< as ProbeSample::time
  std::chrono::nanoseconds arrival{0};    ///< as ProbeSample::arrival
  std::chrono::nanoseconds valid_for{0};  ///< as ProbeSample::valid_for
  std::uint32_t sequence = 0;             ///< counts readings of the device, including lost ones
};

static_assert(std::is_trivially_copyable_v<ReadingHead>);

/// The columns of one probe in the rows of its device: what was measured (ProbeSample::Channel
/// bits; negative: the probe has no value in this reading), the press (depth in mm, force in mN, x
/// and y in mm, the zero of the force in mN, Touch), then further columns in units of their own,
/// which the model does not use, then the pressures of a tactile array in kPa.
struct ProbeColumns {
  static constexpr std::size_t kPress = 7;
  static constexpr std::size_t kMaxFurther = 32;

  std::size_t first = 0;    ///< place in the row
  std::size_t further = 0;  ///< number of further columns
  std::size_t taxels = 0;   ///< number of taxels

  [[nodiscard]] constexpr std::size_t width() const noexcept { return kPress + further + taxels; }

  [[nodiscard]] bool measured_in(std::span<const double> row) const noexcept {
    return row[first] >= 0.0;
  }
  /// \param row  in which it was measured
  [[nodiscard]] ProbeSample sample(const ReadingHead& head,
                                   std::span<const double> row) const noexcept {
    return {.time = head.time,
            .arrival = head.arrival,
            .depth_mm = row[first + 1],
            .force_mN = row[first + 2],
            .x_mm = row[first + 3],
            .y_mm = row[first + 4],
            .sequence = head.sequence,
            .channels = static_cast<std::uint32_t>(row[first]),
            .valid_for = head.valid_for,
            .zero_mN = row[first + 5],
            .touch = static_cast<Touch>(row[first + 6])};
  }
  /// \param row  of numbers, const or not
  template <class Number>
  [[nodiscard]] std::span<Number> further_in(std::span<Number> row) const noexcept {
    return row.subspan(first + kPress, further);
  }
  template <class Number>
  [[nodiscard]] std::span<Number> taxels_in(std::span<Number> row) const noexcept {
    return row.subspan(first + kPress + further, taxels);
  }
  void put(const ProbeSample& sample, std::span<double> row) const noexcept {
    row[first] = static_cast<double>(sample.channels);
    row[first + 1] = sample.depth_mm;
    row[first + 2] = sample.force_mN;
    row[first + 3] = sample.x_mm;
    row[first + 4] = sample.y_mm;
    row[first + 5] = sample.zero_mN;
    row[first + 6] = static_cast<double>(sample.touch);
  }
  void put_nothing(std::span<double> row) const noexcept { row[first] = -1.0; }
};

/// The head of a sample's reading.
[[nodiscard]] constexpr ReadingHead head_of(const ProbeSample& sample) noexcept {
  return {.time = sample.time,
          .arrival = sample.arrival,
          .valid_for = sample.valid_for,
          .sequence = sample.sequence};
}

/// The table of columns of a device: those of each probe that it feeds, one after the other.
class ReadingColumns {
 public:
  ReadingColumns() = default;
  /// Of a device with one probe.
  explicit ReadingColumns(const ProbeColumns& only) : ReadingColumns(std::vector{only}) {}
  /// \param probes  `first` is set
  explicit ReadingColumns(std::vector<ProbeColumns> probes) : probes_(std::move(probes)) {
    for (ProbeColumns& each : probes_) {
      each.first = width_;
      width_ += each.width();
    }
  }

  [[nodiscard]] std::size_t probes() const noexcept { return probes_.size(); }
  [[nodiscard]] const ProbeColumns& of(std::size_t probe) const noexcept { return probes_[probe]; }
  /// The number of values in a row.
  [[nodiscard]] std::size_t width() const noexcept { return width_; }

 private:
  std::vector<ProbeColumns> probes_;
  std::size_t width_ = 0;
};

/// Readings of a device, in strictly increasing order of time: a head and a row of values each.
/// Real-time: no.
class Readings {
 public:
  /// \param most  readings that fit
  explicit Readings(ReadingColumns columns, std::size_t most = 1024)
      : columns_(std::move(columns)), most_(most) {}

  [[nodiscard]] const ReadingColumns& columns() const noexcept { return columns_; }
  [[nodiscard]] std::size_t size() const noexcept { return heads_.size(); }
  [[nodiscard]] bool empty() const noexcept { return heads_.empty(); }
  [[nodiscard]] std::size_t room() const noexcept { return most_ - heads_.size(); }
  [[nodiscard]] ReadingHead& head(std::size_t i) noexcept { return heads_[i]; }
  [[nodiscard]] const ReadingHead& head(std::size_t i) const noexcept { return heads_[i]; }
  [[nodiscard]] std::span<double> row(std::size_t i) noexcept {
    return {values_.data() + i * columns_.width(), columns_.width()};
  }
  [[nodiscard]] std::span<const double> row(std::size_t i) const noexcept {
    return {values_.data() + i * columns_.width(), columns_.width()};
  }
  [[nodiscard]] std::span<ReadingHead> heads() noexcept { return heads_; }
  /// Edges of the device's sync lines since the last readings; there may be some without readings.
  [[nodiscard]] std::vector<SyncEdge>& edges() noexcept { return edges_; }
  [[nodiscard]] const std::vector<SyncEdge>& edges() const noexcept { return edges_; }
  /// Zeros of tactile arrays that have changed since the last readings; `probe` is the output.
  [[nodiscard]] std::vector<TaxelZeros>& zeros() noexcept { return zeros_; }
  [[nodiscard]] const std::vector<TaxelZeros>& zeros() const noexcept { return zeros_; }
  /// Takes the edges and zeros of others.
  void take_beside(Readings& others, std::chrono::nanoseconds shift = {}) {
    std::swap(edges_, others.edges_);
    std::swap(zeros_, others.zeros_);
    shift_beside(shift);
  }
  void shift_beside(std::chrono::nanoseconds shift) noexcept {
    for (SyncEdge& edge : edges_) edge.time += shift;
    for (TaxelZeros& zeros : zeros_) zeros.time += shift;
  }

  /// What a probe measured in a reading; nothing: no value.
  [[nodiscard]] std::optional<ProbeSample> sample(std::size_t i, std::size_t probe = 0) const {
    const ProbeColumns& of = columns_.of(probe);
    if (!of.measured_in(row(i))) return std::nullopt;
    return of.sample(heads_[i], row(i));
  }
  [[nodiscard]] std::span<const double> further(std::size_t i, std::size_t probe = 0) const {
    return columns_.of(probe).further_in(row(i));
  }
  [[nodiscard]] std::span<const double> taxels(std::size_t i, std::size_t probe = 0) const {
    return columns_.of(probe).taxels_in(row(i));
  }

  void clear() noexcept {
    resize(0);
    edges_.clear();
    zeros_.clear();
  }
  /// Keeps the first ones.
  void resize(std::size_t size) {
    heads_.resize(size);
    values_.resize(size * columns_.width());
  }
  /// Removes the readings for which unwanted(i) is true; called once for each, in order.
  template <class Unwanted>
  void drop_if(const Unwanted& unwanted) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < size(); ++i) {
      if (unwanted(i)) continue;
      if (kept < i) {
        heads_[kept] = heads_[i];
        std::ranges::copy(row(i), row(kept).begin());
      }
      ++kept;
    }
    resize(kept);
  }
  /// Adds readings of others with the same width. \param first  of them
  void add(const Readings& others, std::size_t first, std::size_t count) {
    const auto begin = static_cast<std::ptrdiff_t>(first);
    const auto end = static_cast<std::ptrdiff_t>(first + count);
    const auto width = static_cast<std::ptrdiff_t>(columns_.width());
    heads_.insert(heads_.end(), others.heads_.begin() + begin, others.heads_.begin() + end);
    values_.insert(values_.end(), others.values_.begin() + begin * width,
                   others.values_.begin() + end * width);
  }
  /// Adds a reading. \return its row, all 0
  std::span<double> add(const ReadingHead& head) {
    heads_.push_back(head);
    values_.resize(heads_.size() * columns_.width());
    return row(heads_.size() - 1);
  }
  /// Adds a reading of a device with one probe.
  std::span<double> add_sample(const ProbeSample& sample) {
    const std::span<double> to = add(head_of(sample));
    columns_.of(0).put(sample, to);
    return to;
  }

 private:
  ReadingColumns columns_;
  std::size_t most_;
  std::vector<ReadingHead> heads_;
  std::vector<double> values_;
  std::vector<SyncEdge> edges_;
  std::vector<TaxelZeros> zeros_;
};

}  // namespace merkel
