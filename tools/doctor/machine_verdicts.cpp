#include "tools/doctor/machine_verdicts.hpp"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <unistd.h>

namespace merkel {
namespace {

namespace fs = std::filesystem;

/// The first line of a file; empty if the file does not exist.
std::string line_of(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

std::optional<std::int64_t> number_of(const std::string& path) {
  const std::string line = line_of(path);
  std::int64_t number = 0;
  const auto end = std::from_chars(line.data(), line.data() + line.size(), number);
  if (end.ec != std::errc{}) return std::nullopt;
  return number;
}

std::string text_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

std::vector<MachineFacts::SerialPort> ports_of(const std::string& root) {
  std::vector<MachineFacts::SerialPort> ports;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(root + "/dev", none)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("ttyUSB") && !name.starts_with("ttyACM")) continue;
    const fs::path adapter = fs::path(root + "/sys/bus/usb-serial/devices") / name;
    const auto timer = number_of((adapter / "latency_timer").string());
    ports.push_back(
        {.name = name,
         .accessible = ::access(entry.path().c_str(), R_OK | W_OK) == 0,
         .latency_timer_ms = timer ? std::optional(static_cast<int>(*timer)) : std::nullopt});
  }
  std::sort(ports.begin(), ports.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  return ports;
}

}  // namespace

MachineFacts MachineFacts::read(const std::string& root) {
  MachineFacts facts;
  const std::string version = line_of(root + "/proc/version");
  facts.kernel = version;
  // Not every real-time kernel has this file, and its version text is not uniform either.
  facts.realtime_kernel = number_of(root + "/sys/kernel/realtime") == 1 ||
                          version.find("PREEMPT_RT") != std::string::npos ||
                          version.find("PREEMPT RT") != std::string::npos;
  facts.hypervisor = text_of(root + "/proc/cpuinfo").find(" hypervisor") != std::string::npos;
  facts.clock_source =
      line_of(root + "/sys/devices/system/clocksource/clocksource0/current_clocksource");
  facts.governor = line_of(root + "/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
  facts.rt_runtime_us = number_of(root + "/proc/sys/kernel/sched_rt_runtime_us");
  facts.isolated_cores = line_of(root + "/sys/devices/system/cpu/isolated");
  facts.ports = ports_of(root);
  facts.rights = RightsFacts::of_this_process();
  return facts;
}

std::vector<Verdict> machine_verdicts(const MachineFacts& facts, int priority) {
  const RightsFacts& rights = facts.rights;
  Json ports = Json::array();
  for (const MachineFacts::SerialPort& port : facts.ports) {
    ports.push_back(
        {{"name", port.name},
         {"accessible", port.accessible},
         {"latency_timer_ms", port.latency_timer_ms ? Json(*port.latency_timer_ms) : Json()},
         {"quick", port.latency_timer_ms <= 1}});
  }
  return verdicts_of(
      "doctor_machine",
      {{"fifo", rights.cap_sys_nice || rights.rtprio_limit >= static_cast<std::uint64_t>(priority)},
       {"fifo_refusal", fifo_refusal(rights, priority)},
       {"priority", priority},
       {"memory_lock", rights.cap_ipc_lock || rights.memlock_limit_bytes == UINT64_MAX},
       {"memory_lock_refusal", memory_lock_refusal(rights)},
       {"realtime_kernel", facts.realtime_kernel},
       {"hypervisor", facts.hypervisor},
       {"clock_source", facts.clock_source},
       {"quick_clock", facts.clock_source == "tsc" || facts.clock_source == "arch_sys_counter" ||
                           facts.clock_source == "kvm-clock"},
       {"governor", facts.governor},
       {"rt_runtime_us", facts.rt_runtime_us ? Json(*facts.rt_runtime_us) : Json()},
       {"unthrottled", facts.rt_runtime_us < 0},
       {"isolated_cores", facts.isolated_cores},
       {"ports", std::move(ports)}});
}

}  // namespace merkel
