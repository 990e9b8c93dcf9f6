#include <array>
#include <string>
#include <string_view>

#include "core/printed.hpp"
#include "core/units.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/protocols/polled_protocol.hpp"
#include "drivers/protocols/protocol_makers.hpp"
#include "drivers/take_part.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

using Vector = std::array<double, 3>;

constexpr milliseconds kGrblPatience{300};
constexpr std::uint32_t kChannels =
    bit_of(DeviceChannel::kX) | bit_of(DeviceChannel::kY) | bit_of(DeviceChannel::kZ);

/// Reads "1.000,-2.000,3.000"; ignores additional axes.
std::optional<Vector> read_vector(std::string_view text) noexcept {
  Vector vector{};
  for (double& number : vector) {
    const auto value = parse_number(take_field(text));
    if (!value) return std::nullopt;
    number = *value;
  }
  return vector;
}

class Grbl final : public PolledProtocol {
 public:
  Grbl(double rate_Hz, std::optional<double> mm_per_unit)
      : PolledProtocol(rate_Hz, kGrblPatience, "?"),
        asks_unit_(!mm_per_unit),
        mm_per_unit_(mm_per_unit) {}

  void begin(nanoseconds now, DeviceStream& stream) override {
    offset_.reset();
    // After an empty line and the settings request, one of the next reports has the offset.
    begin_requests(now, asks_unit_ ? "\n$$\n" : "\n", stream);
  }

  [[nodiscard]] std::string expected(std::string_view /*answer*/) const override {
    return "a status report, such as \"<Idle|MPos:0.000,0.000,0.000|WCO:0.000,0.000,0.000>\"" +
           std::string(mm_per_unit_ ? ""
                                    : ", and the setting $13 (mm or inches), which a machine lists "
                                      "at rest: stop its motion, or add unit=mm or unit=in");
  }
  [[nodiscard]] std::uint32_t channels() const noexcept override { return kChannels; }

 private:
  void read_line(std::string_view line, nanoseconds arrival, DeviceStream& stream) override {
    if (line.starts_with('<') && line.ends_with('>')) {
      read_report(line.substr(1, line.size() - 2), arrival, stream);
      return;
    }
    const bool known = line == "ok" || line.starts_with('[') || line.starts_with('$') ||
                       line.starts_with("error:") || line.starts_with("ALARM:") ||
                       line.starts_with("Grbl ");
    ++(known ? stream.counts.frames : stream.counts.damaged);
    if (line.starts_with("Grbl ")) {
      offset_.reset();
      rebooted_ = greeted_ || stream.counts.readings > 0;
      greeted_ = true;
    } else if (asks_unit_ && line.starts_with("$13=")) {
      mm_per_unit_ = line.substr(4, 1) == "1" ? units::kMm_per_inch : 1.0;
    } else if (line.starts_with("ALARM:")) {
      stream.notice("the machine reports " + std::string(line));
    }
  }

  void read_report(std::string_view report, nanoseconds arrival, DeviceStream& stream) {
    std::optional<Vector> machine;
    std::optional<Vector> work;
    std::string_view rest = report;
    while (!rest.empty()) {
      const std::string_view part = take_part(rest, '|');
      const auto value = part.substr(std::min(part.find(':') + 1, part.size()));
      const auto read = [&](std::string_view name, std::optional<Vector>& vector) {
        if (!part.starts_with(name)) return true;
        vector = read_vector(value);
        return vector.has_value();
      };
      if (!read("MPos:", machine) || !read("WPos:", work) || !read("WCO:", offset_)) {
        ++stream.counts.damaged;
        return;
      }
    }
    if (!machine && !work) {
      ++stream.counts.damaged;
      return;
    }
    ++stream.counts.frames;
    DeviceReading reading;
    if (!take_answer(reading, stream)) return;
    if (!mm_per_unit_) {
      // A board that was reset when its port was opened has lost the first request, and a machine
      // that moves refuses it.
      stream.send("$$\n");
      return;
    }
    if (!work) {
      if (!offset_) return;  // one of the next reports has it
      work = machine;
      for (std::size_t i = 0; i < 3; ++i) (*work)[i] -= (*offset_)[i];
    }
    reading.arrival = arrival;
    reading.rebooted = std::exchange(rebooted_, false);
    reading.set(DeviceChannel::kX, (*work)[0] * *mm_per_unit_);
    reading.set(DeviceChannel::kY, (*work)[1] * *mm_per_unit_);
    reading.set(DeviceChannel::kZ, (*work)[2] * *mm_per_unit_);
    stream.accept(reading);
  }

  bool asks_unit_;
  std::optional<double> mm_per_unit_;  ///< empty: not yet stated
  std::optional<Vector> offset_;       ///< WCO: machine − work position
  bool greeted_ = false;
  bool rebooted_ = false;
};

class GrblDevice final : public PolledDevice {
 public:
  void boot(nanoseconds /*now*/, Bytes& out) override {
    lines_.reset(true);
    reports_ = 0;
    append("\r\nGrbl 1.1h ['$' for help]\r\n", out);
  }

  void take(std::span<const std::uint8_t> bytes, nanoseconds /*now*/, Bytes& out) override {
    for (const std::uint8_t byte : bytes) {
      if (byte == '?') {
        requested_ = true;
        report(out);
        continue;
      }
      if (byte == '\n') append("ok\r\n", out);
      const auto line = lines_.take(byte);
      if (line && *line == "$$") append("$10=1\r\n$13=0\r\n", out);
    }
  }

  void measure(const ProbeSample& sample, std::span<const double> /*others*/, nanoseconds /*now*/,
               Bytes& /*out*/) override {
    if (sample.has(ProbeSample::kX)) position_[0] = sample.x_mm;
    if (sample.has(ProbeSample::kY)) position_[1] = sample.y_mm;
    position_[2] = -sample.depth_mm;
  }

 private:
  static constexpr Vector kOffset = {-100.0, -50.0, -8.0};
  static constexpr int kReportsPerOffset = 10;

  void report(Bytes& out) {
    append(printed("<Run|MPos:%.3f,%.3f,%.3f|FS:500,8000", position_[0] + kOffset[0],
                   position_[1] + kOffset[1], position_[2] + kOffset[2]),
           out);
    if (reports_++ % kReportsPerOffset == 0) append("|WCO:-100.000,-50.000,-8.000", out);
    append(">\r\n", out);
  }

  Vector position_{15.0, 10.0, 0.0};
  int reports_ = 0;
  LineSplitter lines_;
};

}  // namespace

Expected<std::unique_ptr<Protocol>, SetupError> make_grbl(UriOptions& options) {
  const double rate_Hz = options.number("rate_hz", 25.0, 1.0, 100.0);
  const std::string unit = options.word("unit", "auto", "auto|mm|in");
  std::optional<double> mm_per_unit;
  if (unit != "auto") mm_per_unit = unit == "in" ? units::kMm_per_inch : 1.0;
  return std::make_unique<Grbl>(rate_Hz, mm_per_unit);
}

std::unique_ptr<SimulatedDevice> make_grbl_device() { return std::make_unique<GrblDevice>(); }

}  // namespace merkel
