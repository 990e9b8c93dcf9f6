#include "drivers/files/trace_file.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "core/parameters/nearest_name.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/sample_limits.hpp"

namespace merkel {
namespace {

const std::array<std::string, 5> kColumnNames = {"time_s", "depth_mm", "force_N", "x_mm", "y_mm"};
constexpr std::array<std::uint32_t, 5> kColumnChannels = {
    0, ProbeSample::kDepth, ProbeSample::kForce, ProbeSample::kX, ProbeSample::kY};
constexpr std::string_view kValidity = "# valid_for_s=";
constexpr int kMilliPerUnit = 3;  // N in the file, mN in samples: the power of ten

}  // namespace

const char* TraceReader::name_of(Column column) noexcept {
  return kColumnNames[static_cast<std::size_t>(column)].c_str();
}

Expected<TraceReader, SetupError> TraceReader::open(const std::string& path) {
  auto lines = LineReader::open(path);
  if (!lines) return Unexpected<SetupError>(lines.error());
  TraceReader reader(std::move(*lines));
  if (auto header = reader.read_header(); !header) {
    return Unexpected<SetupError>(header.error());
  }
  return reader;
}

Expected<void, SetupError> TraceReader::read_header() {
  LineReader::Outcome outcome = LineReader::Outcome::kEnd;
  do {
    outcome = lines_.next();
    if (outcome == LineReader::Outcome::kLine) read_comment(lines_.line());
  } while (outcome == LineReader::Outcome::kLine &&
           (lines_.line().empty() || lines_.line().front() == '#'));
  if (outcome == LineReader::Outcome::kError) return bad_input(lines_.error());
  if (outcome == LineReader::Outcome::kEnd) {
    return bad_input(lines_.path() +
                     " is empty: a trace begins with a header such as time_s,depth_mm");
  }
  std::string_view rest = lines_.line();
  while (!rest.empty()) {
    const std::string field(take_field(rest));
    const auto* const found = std::find(kColumnNames.begin(), kColumnNames.end(), field);
    if (found == kColumnNames.end()) {
      const std::string nearest = nearest_name(field, kColumnNames);
      return bad_input(lines_.where() + "the column \"" + field + "\" is not known" +
                       (nearest.empty() ? ": the known columns are time_s, depth_mm, force_N, x_mm "
                                          "and y_mm"
                                        : ": did you mean " + nearest + "?"));
    }
    const auto column = static_cast<Column>(found - kColumnNames.begin());
    if (std::find(columns_.begin(), columns_.end(), column) != columns_.end()) {
      return bad_input(lines_.where() + "the column " + field + " is repeated: keep one");
    }
    columns_.push_back(column);
    channels_ |= kColumnChannels[static_cast<std::size_t>(column)];
  }
  if (std::find(columns_.begin(), columns_.end(), Column::kTime) == columns_.end()) {
    return bad_input(lines_.where() + "the column time_s is missing: add the times, in seconds");
  }
  if ((channels_ & (ProbeSample::kDepth | ProbeSample::kForce)) == 0U) {
    return bad_input(lines_.where() +
                     "a column depth_mm or force_N is missing: add the recorded one");
  }
  return {};
}

void TraceReader::read_comment(std::string_view line) {
  if (!line.starts_with(kValidity)) return;
  const auto time = parse_seconds(line.substr(kValidity.size()));
  if (time && time->count() >= 0) valid_for_ = *time;
}

Expected<void, SetupError> TraceReader::parse_row(ProbeSample& sample) {
  sample = {};
  sample.channels = channels_;
  sample.valid_for = valid_for_.value_or(std::chrono::nanoseconds{0});
  std::string_view rest = lines_.line();
  const auto commas = std::count(rest.begin(), rest.end(), ',');
  if (static_cast<std::size_t>(commas) + 1 != columns_.size()) {
    return bad_input(lines_.where() + "this row has " + std::to_string(commas + 1) +
                     " fields, but the header has " + std::to_string(columns_.size()) +
                     ": complete or remove it");
  }
  for (const Column column : columns_) {
    const std::string_view field = take_field(rest);
    const auto refuse = [&](const char* what) {
      return bad_input(lines_.where() + name_of(column) + " is \"" + std::string(field) + "\", " +
                       what);
    };
    if (column == Column::kTime) {
      const auto time = parse_seconds(field);
      if (!time) return refuse("not a finite number of seconds: correct or remove this row");
      if (rows_ > 0 && *time <= last_time_) {
        return refuse(*time == last_time_
                          ? "the same time as in the row before, to the nanosecond: remove one"
                          : "earlier than in the row before: sort the rows by time");
      }
      sample.time = sample.arrival = last_time_ = *time;
      continue;
    }
    const auto value = parse_number(field, column == Column::kForce ? kMilliPerUnit : 0);
    if (!value) return refuse("not a number: correct or remove this row");
    if (!std::isfinite(*value)) return refuse("not finite: correct or remove this row");
    const auto refuse_beyond = [&](double limit) {
      return refuse(("beyond ±" + shortest_decimal(limit) + ": check its unit").c_str());
    };
    switch (column) {
      case Column::kDepth:
        if (!plausible(*value, SampleLimits::kDepth_mm)) {
          return refuse_beyond(SampleLimits::kDepth_mm);
        }
        sample.depth_mm = *value;
        break;
      case Column::kForce:
        sample.force_mN = *value;
        if (!plausible(sample.force_mN, SampleLimits::kForce_mN)) {
          return refuse_beyond(units::N_from_mN(SampleLimits::kForce_mN));
        }
        break;
      case Column::kX:
      case Column::kY:
        if (!plausible(*value, SampleLimits::kPosition_mm)) {
          return refuse_beyond(SampleLimits::kPosition_mm);
        }
        (column == Column::kX ? sample.x_mm : sample.y_mm) = *value;
        break;
      case Column::kTime:
        break;
    }
  }
  sample.sequence = rows_++;
  return {};
}

Expected<std::size_t, SetupError> TraceReader::read(std::span<ProbeSample> samples) {
  std::size_t count = 0;
  while (count < samples.size()) {
    switch (lines_.next()) {
      case LineReader::Outcome::kError:
        return bad_input(lines_.error());
      case LineReader::Outcome::kEnd:
        return count;
      case LineReader::Outcome::kLine:
        break;
    }
    read_comment(lines_.line());
    if (lines_.line().empty() || lines_.line().front() == '#') continue;
    if (auto row = parse_row(samples[count]); !row) return Unexpected<SetupError>(row.error());
    ++count;
  }
  return count;
}

TraceWriter::TraceWriter(OutputFile file, std::uint32_t channels, std::string head)
    : file_(std::move(file)), channels_(channels), head_(std::move(head)) {}

Expected<void, SetupError> TraceWriter::result_of(bool succeeded) const {
  if (!succeeded) return unavailable(file_.error());
  return {};
}

Expected<TraceWriter, SetupError> TraceWriter::create(const std::string& path,
                                                      std::uint32_t channels,
                                                      std::span<const std::string> comment,
                                                      bool overwrite,
                                                      const OutputFile::Notice& notice) {
  auto file = OutputFile::create(path, overwrite, notice);
  if (!file) return Unexpected<SetupError>(file.error());
  std::string head;
  for (const std::string& line : comment) head += "# " + line + "\n";
  return TraceWriter(std::move(*file), channels, std::move(head));
}

Expected<void, SetupError> TraceWriter::write_header(std::span<const std::string> comment) {
  std::string head = std::exchange(head_, {});
  for (const std::string& line : comment) head += "# " + line + "\n";
  head += kColumnNames[0];
  for (std::size_t i = 1; i < kColumnNames.size(); ++i) {
    if ((channels_ & kColumnChannels[i]) != 0U) head += "," + kColumnNames[i];
  }
  header_written_ = true;
  const bool written = file_.write(head + "\n");
  file_.end_header();
  return result_of(written);
}

Expected<void, SetupError> TraceWriter::write(std::span<const ProbeSample> samples) {
  if (!header_written_) {
    if (auto head = write_header({}); !head) return head;
  }
  std::string rows;
  for (const ProbeSample& sample : samples) {
    if (sample.valid_for != valid_for_) {
      valid_for_ = sample.valid_for;
      rows += kValidity;
      append_seconds(rows, valid_for_);
      rows += '\n';
    }
    append_seconds(rows, sample.time);
    const auto append = [&](std::uint32_t channel, double value, int shift = 0) {
      if ((channels_ & channel) != 0U) rows += "," + shifted_decimal(value, shift);
    };
    append(ProbeSample::kDepth, sample.depth_mm);
    append(ProbeSample::kForce, sample.force_mN, -kMilliPerUnit);
    append(ProbeSample::kX, sample.x_mm);
    append(ProbeSample::kY, sample.y_mm);
    rows += '\n';
  }
  return result_of(file_.write(rows));
}

Expected<void, SetupError> TraceWriter::flush() { return result_of(file_.flush()); }

Expected<void, SetupError> TraceWriter::close() {
  if (!header_written_) {
    if (auto head = write_header({}); !head) return head;
  }
  return result_of(file_.close());
}

}  // namespace merkel
