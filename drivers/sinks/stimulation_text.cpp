#include "drivers/sinks/stimulation_text.hpp"

#include <cmath>

#include "core/parameters/parameter_error.hpp"
#include "core/records/columns.hpp"
#include "core/units.hpp"
#include "drivers/files/column_text.hpp"
#include "drivers/sinks/json_line.hpp"

namespace merkel {
namespace {

std::string json_list(const std::vector<double>& values) {
  std::string text = "[";
  for (const double value : values) {
    text.append(text.size() > 1 ? "," : "").append(shortest_decimal(value));
  }
  return text + "]";
}

std::string phase_us(std::chrono::nanoseconds phase) {
  return shortest_decimal(units::us_from(phase));
}

std::string json_limit(double value) {
  return std::isinf(value) ? "null" : shortest_decimal(value);
}

}  // namespace

StimulationText::StimulationText(const EncodingParameters& encoding) {
  for (const Electrode& each : encoding.electrodes) {
    names_.push_back(each.name);
    phases_us_.push_back(phase_us(ElectrodeLimits::of(each, encoding.stimulation).phase));
  }
  names_.emplace_back("unknown");
  phases_us_.push_back(phase_us(encoding.stimulation.phase));
}

std::string StimulationText::older_csv_header() { return merkel::csv_header(kCommandColumns); }

std::string StimulationText::csv_header() {
  return older_csv_header() + ",sent_monotonic_ns,valid_until_ns";
}

void StimulationText::append_row(std::string& text, const SentCommand& sent) const {
  const StimulationCommand& command = sent.command;
  for_each_column(kCommandColumns, [&](const auto& each) {
    if (each.name == "electrode") {
      text.append(name(command));
    } else {
      append_value(text, each.access(command));
    }
    text += ',';
  });
  text.append(std::to_string(sent.sent.count())).append(",");
  text.append(std::to_string(sent.valid_until.count())).append("\n");
}

void StimulationText::append_members(std::string& text, const SentCommand& sent) const {
  const StimulationCommand& command = sent.command;
  text.append(R"("kind":")").append(name_of(command.kind));
  text.append(R"(","electrode":)").append(json_string(name(command)));
  text.append(R"(,"amplitude_uA":)").append(shortest_decimal(command.amplitude_uA));
  text.append(R"(,"frequency_Hz":)").append(shortest_decimal(command.frequency_Hz));
  text.append(R"(,"phase_us":)").append(phases_us_[index_of(command)]);
  text.append(R"(,"heartbeat":)").append(std::to_string(command.heartbeat));
  text.append(R"(,"stop":")").append(name_of(command.stop)).append(R"(","timestamp":)");
  append_seconds(text, command.time);
  text.append(R"(,"time_ns":)").append(std::to_string(command.time.count()));
  text.append(R"(,"sent_monotonic_ns":)").append(std::to_string(sent.sent.count()));
  text.append(R"(,"valid_until_ns":)").append(std::to_string(sent.valid_until.count()));
}

std::string encoding_members(const EncodingParameters& encoding) {
  std::string text = R"("electrodes":[)";
  for (const Electrode& each : encoding.electrodes) {
    text.append(text.ends_with('[') ? "" : ",");
    text.append(R"({"name":)").append(json_string(each.name));
    text.append(R"(,"patch":)").append(std::to_string(each.patch));
    text.append(R"(,"field_mm":)").append(json_list(each.field_mm));
    text.append(R"(,"amplitude_uA":)").append(json_list(each.amplitude_uA));
    text.append(R"(,"frequency_Hz":)").append(json_list(each.frequency_Hz));
    const ElectrodeLimits own = ElectrodeLimits::of(each, encoding.stimulation);
    if (each.group) {
      const Electrode& pattern = encoding.groups[*each.group].pattern;
      text.append(R"(,"group":)").append(json_string(pattern.name));
    }
    text.append(R"(,"phase_us":)").append(phase_us(own.phase));
    text.append(R"(,"second_phase_us":)").append(phase_us(own.second_phase));
    text.append(R"(,"max_charge_nC":)").append(json_limit(own.max_charge_nC));
    text.append(R"(,"max_amplitude_uA":)").append(json_limit(own.max_amplitude_uA));
    text.append(R"(,"max_slope_uA_per_s":)").append(json_limit(own.max_slope_uA_per_s)).append("}");
  }
  const StimulationParameters& limits = encoding.stimulation;
  text.append(R"(],"update_ms":)").append(shortest_decimal(units::ms_from(limits.update)));
  text.append(R"(,"phase_us":)").append(phase_us(limits.phase));
  text.append(R"(,"interphase_us":)").append(phase_us(limits.interphase));
  text.append(R"(,"polarity":")");
  text.append(limits.polarity == Polarity::kCathodicFirst ? "cathodic_first" : "anodic_first");
  text.append(R"(","max_charge_nC":)").append(shortest_decimal(limits.max_charge_nC));
  text.append(R"(,"max_total_uA":)").append(shortest_decimal(limits.max_total_uA));
  text.append(R"(,"max_slope_uA_per_s":)");
  text.append(limits.max_slope_uA_per_s ? shortest_decimal(*limits.max_slope_uA_per_s) : "null");
  text.append(R"(,"max_electrodes":)");
  text.append(limits.max_electrodes ? std::to_string(*limits.max_electrodes) : "null");
  text.append(R"(,"watchdog_ms":)").append(shortest_decimal(units::ms_from(limits.watchdog)));
  return text;
}

Expected<void, SetupError> require_electrodes(const Uri& uri, const EncodingParameters& encoding) {
  if (!encoding.electrodes.empty()) return {};
  return bad_input("\"" + uri.text +
                   "\": the scene has no electrodes, so there are no stimulation commands: add "
                   "[[electrode]] and [stimulation] to it (merkel scene --keys explains them)");
}

}  // namespace merkel
