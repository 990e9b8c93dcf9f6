#include <string>
#include <string_view>

#include "core/parameters/parameter_error.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/protocols/csv_lines.hpp"

namespace merkel {
namespace {

class CsvDevice final : public SimulatedDevice {
 public:
  explicit CsvDevice(std::uint32_t channels) : channels_(channels) {}

  void boot(std::chrono::nanoseconds /*now*/, Bytes& out) override {
    sequence_ = 0;
    append(header() + "\r\n", out);
  }

  [[nodiscard]] std::string uri_options() const override { return "columns=" + header(); }

  void measure(const ProbeSample& sample, std::chrono::nanoseconds now, Bytes& out) override {
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
    append("\r\n", out);
  }

 private:
  [[nodiscard]] std::string header() const {
    return std::string("time_us,seq") + (has(ProbeSample::kForce) ? ",force_N" : "") +
           (has(ProbeSample::kDepth) ? ",depth_mm" : "") + (has(ProbeSample::kX) ? ",x_mm" : "") +
           (has(ProbeSample::kY) ? ",y_mm" : "");
  }
  [[nodiscard]] bool has(std::uint32_t channel) const { return (channels_ & channel) != 0U; }
  static void append(std::string_view text, Bytes& out) {
    out.insert(out.end(), text.begin(), text.end());
  }

  std::uint32_t channels_;
  std::uint32_t sequence_ = 0;
};

}  // namespace

std::unique_ptr<SimulatedDevice> make_csv_device(std::uint32_t channels) {
  return std::make_unique<CsvDevice>(channels);
}

}  // namespace merkel
