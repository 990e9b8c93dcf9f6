#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/contact/taxel_gap.hpp"
#include "core/expected.hpp"
#include "core/records/readings.hpp"
#include "drivers/files/line_reader.hpp"
#include "drivers/protocols/csv_columns.hpp"
#include "drivers/protocols/unit_factors.hpp"
#include "drivers/sample_source.hpp"

namespace merkel {

/// Reads a trace: a CSV table of `time_s` and `depth_mm` or `force_N` (or both), optionally `x_mm`
/// and `y_mm`, in any order of columns and in any unit of the devices' lines: `time_ms`, `force_g`,
/// `depth_um`. Up to ProbeColumns::kMaxFurther further columns are kept; readings of several
/// probes are named like thumb_N, and need neither depth nor force. More pressures than that are
/// the taxels of a tactile array, whose missing values are bridged (TaxelGap). Lines that begin
/// with '#' are comments. Times are strictly increasing, to the nanosecond; every value is finite.
/// A comment `# valid_for_s=0.05` sets the validity of the samples after it
/// (ProbeSample::valid_for), and `# zero_subtracted` that the zero of the run that recorded them is
/// subtracted from their forces (Touch::kZeroed); the comments of TimeBase::facts() before the
/// header hold the start of the run that recorded it. Streams: memory is bounded.
class TraceReader final : public SampleSource {
 public:
  /// Reads the header. Fails on a missing or empty file, and on a missing or repeated column.
  /// \param factors  of columns in volts or counts; a force, depth or position without its own is
  /// refused, and so are factors that no column has
  [[nodiscard]] static Expected<TraceReader, SetupError> open(const std::string& path,
                                                              UnitFactors factors = {});

  [[nodiscard]] std::uint32_t channels() const noexcept override { return channels_; }
  [[nodiscard]] ProbeColumns columns() const noexcept override {
    return {.further = extra_columns_.size(), .taxels = taxels_.size()};
  }

  /// When the first tick of the run that recorded the trace began, in its time; if known. Valid
  /// after read(), because a trace without its beginning has another start.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> start() const noexcept;
  [[nodiscard]] std::optional<RecordedRun> run() const override;

  [[nodiscard]] std::vector<std::string> extra_columns() const override { return extra_columns_; }
  /// Names of the taxels of a tactile array, in order.
  [[nodiscard]] const std::vector<std::string>& taxels() const noexcept { return taxels_; }
  /// Sentences for the user since the last call: columns that are not used or not kept.
  [[nodiscard]] std::vector<std::string> take_notices() override {
    return std::exchange(notices_, {});
  }

  /// Adds up to `most` samples, with columns(); 0 is the end. Fails with file, line and what to
  /// fix; the samples before that line are added.
  [[nodiscard]] Expected<std::size_t, SetupError> read(Readings& readings,
                                                       std::size_t most) override;
  /// The same, without further columns and taxels.
  [[nodiscard]] Expected<std::size_t, SetupError> read(std::span<ProbeSample> samples);

 private:
  TraceReader(LineReader lines, UnitFactors factors)
      : lines_(std::move(lines)), factors_(std::move(factors)) {}
  Expected<void, SetupError> read_header();
  [[nodiscard]] Expected<bool, SetupError> next_row(ReadingHead& head, std::span<double> row);
  Expected<void, SetupError> parse_row(ReadingHead& head, std::span<double> row);
  /// The first field of a row that its column refuses, with the reason; empty: none.
  [[nodiscard]] std::string read_fields();
  [[nodiscard]] std::string fault_of(const CsvColumn& column, std::string_view field) const;
  [[nodiscard]] std::string listed_extra_columns() const;
  void read_comment(std::string_view line);
  Expected<void, SetupError> add_column(const std::string& name);
  [[nodiscard]] bool has(const CsvColumn& column) const noexcept;
  void add_extra_column(CsvColumn column);
  Expected<void, SetupError> choose_taxels();
  [[nodiscard]] Expected<CsvColumn, SetupError> column_named(const std::string& name);

  LineReader lines_;
  UnitFactors factors_;
  bool factors_used_ = false;
  std::vector<CsvColumn> columns_;  ///< forces in mN; those of the model, others have numbers
  DeviceReading reading_;           ///< of the present row
  std::vector<std::string> extra_columns_;
  std::vector<std::string> ignored_columns_;
  std::vector<std::string> taxels_;
  std::vector<TaxelGap> gaps_;
  std::vector<std::string> notices_;
  bool text_reported_ = false;
  std::uint32_t channels_ = 0;
  std::uint32_t rows_ = 0;
  std::chrono::nanoseconds last_time_{0};
  std::chrono::nanoseconds valid_for_ = kNotStated;
  Touch touch_ = Touch::kUndecided;
  std::optional<std::chrono::nanoseconds> first_time_;
  std::optional<std::int64_t> start_device_ns_;
  std::optional<std::int64_t> time_offset_ns_;
};

/// A comment of a trace that sets the validity of the samples after it, up to its time in seconds.
inline constexpr std::string_view kValidityComment = "# valid_for_s=";

/// A comment of a trace: the zero of the samples after it is subtracted.
inline constexpr std::string_view kZeroComment = "# zero_subtracted";

/// The shortest decimal that reads back as the same pressure of a taxel.
[[nodiscard]] std::string pressure_text(float kPa);

}  // namespace merkel
