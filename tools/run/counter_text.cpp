#include "tools/run/counter_text.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include <nlohmann/json.hpp>

namespace merkel {

std::string counter_text(const RunCounters& counters) {
  std::string text;
  for (const auto& field : kRunCounterFields<>) {
    const std::uint64_t value = counters.*field.cell;
    if (value == 0) continue;
    std::array<char, 192> line{};
    std::snprintf(line.data(), line.size(), "  %-25.*s %12llu %-2.*s  %.*s\n",
                  static_cast<int>(field.name.size()), field.name.data(),
                  static_cast<unsigned long long>(value), static_cast<int>(field.unit.size()),
                  field.unit.data(), static_cast<int>(field.meaning.size()), field.meaning.data());
    text += line.data();
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

void add_counters(nlohmann::ordered_json& json, const RunCounters& counters) {
  for (const auto& field : kRunCounterFields<>)
    json[std::string(field.name)] = counters.*field.cell;
}

}  // namespace merkel
