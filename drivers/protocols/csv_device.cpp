#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/protocols/csv_columns.hpp"
#include "drivers/protocols/protocol_makers.hpp"
#include "drivers/protocols/trace_file.hpp"

namespace merkel {
namespace {

class CsvDevice final : public SimulatedDevice {
 public:
  explicit CsvDevice(std::uint32_t channels) : channels_(channels) {}

  void boot(std::chrono::nanoseconds /*now*/, Bytes& out) override {
    sequence_ = 0;
    append(header(), out);
    for (const std::string& name : further_) append("," + name, out);
    for (const std::string& name : taxels_) append("," + name, out);
    append("\r\n", out);
  }

  [[nodiscard]] std::string uri_options() const override {
    std::string list = "columns=" + header();
    std::vector<CsvColumn> columns;
    for (const std::string& name : csv_names_of(header())) {
      columns.push_back(*csv_column_named(name));
    }
    for (const std::string& name : further_) {
      const auto column = csv_column_named(name);
      const bool own = column && repeated_column(columns, *column).empty();
      list += "," + (own ? name : "-");
      if (own) columns.push_back(*column);
    }
    if (!taxels_.empty()) list += "," + csv_list_of(taxels_);
    return list;
  }

  [[nodiscard]] bool set_columns(const std::vector<std::string>& names) override {
    for (const std::string& name : names) further_.push_back(printable_column(name));
    return true;
  }

  [[nodiscard]] bool set_taxels(const std::vector<std::string>& names,
                                double /*largest_kPa*/) override {
    taxels_ = names;
    return true;
  }

  void measure(const ProbeSample& sample, std::span<const double> others,
               std::chrono::nanoseconds now, Bytes& out) override {
    const auto time_us = std::chrono::duration_cast<std::chrono::microseconds>(now).count();
    append(std::to_string(static_cast<std::uint32_t>(time_us)), out);
    const auto add = [&out](const std::string& number) {
      out.push_back(',');
      append(number, out);
    };
    add(std::to_string(sequence_++));
    if (has(ProbeSample::kForce)) add(shifted_decimal(sample.force_mN, -3));
    if (has(ProbeSample::kDepth)) add(shortest_decimal(sample.depth_mm));
    if (has(ProbeSample::kX)) add(shortest_decimal(sample.x_mm));
    if (has(ProbeSample::kY)) add(shortest_decimal(sample.y_mm));
    for (std::size_t i = 0; i < others.size(); ++i) {
      add(i < further_.size() ? shortest_decimal(others[i])
                              : pressure_text(static_cast<float>(others[i])));
    }
    append("\r\n", out);
  }

 private:
  [[nodiscard]] std::string header() const {
    return std::string("time_us,seq") + (has(ProbeSample::kForce) ? ",force_N" : "") +
           (has(ProbeSample::kDepth) ? ",depth_mm" : "") + (has(ProbeSample::kX) ? ",x_mm" : "") +
           (has(ProbeSample::kY) ? ",y_mm" : "");
  }
  [[nodiscard]] bool has(std::uint32_t channel) const { return (channels_ & channel) != 0U; }
  std::uint32_t channels_;
  std::vector<std::string> further_;
  std::vector<std::string> taxels_;
  std::uint32_t sequence_ = 0;
};

}  // namespace

std::unique_ptr<SimulatedDevice> make_csv_device(std::uint32_t channels) {
  return std::make_unique<CsvDevice>(channels);
}

}  // namespace merkel
