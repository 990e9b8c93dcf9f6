#include "tools/run/counter_text.hpp"

#include <algorithm>

#include <fmt/core.h>

#include "tools/json_text.hpp"

namespace merkel {

std::string counter_text(const Json& counters) {
  std::string text;
  for (const auto& field : kRunCounterFields<>) {
    const auto value = counters.at(std::string(field.name)).get<std::uint64_t>();
    if (value == 0) continue;
    text +=
        fmt::format("  {:<25} {:>12} {:<2}  {}\n", field.name, value, field.unit, field.meaning);
  }
  return text;
}

std::string fault_text(const RunCounters& counters) {
  std::string text;
  for (const auto& field : kRunCounterFields<>) {
    const std::uint64_t value = counters.*field.cell;
    if (!field.fault || value == 0) continue;
    std::string name(field.name);
    std::replace(name.begin(), name.end(), '_', ' ');
    text += "  " + std::to_string(value) + " " + name;
  }
  return text;
}

void add_counters(Json& json, const RunCounters& counters) {
  for (const auto& field : kRunCounterFields<>)
    json[std::string(field.name)] = counters.*field.cell;
}

}  // namespace merkel
