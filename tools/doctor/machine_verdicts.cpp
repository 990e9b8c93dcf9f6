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
using Grade = Verdict::Grade;

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

void add_rights(const MachineFacts& facts, int priority, std::vector<Verdict>& verdicts) {
  const RightsFacts& rights = facts.rights;
  const bool fifo =
      rights.cap_sys_nice || rights.rtprio_limit >= static_cast<std::uint64_t>(priority);
  verdicts.push_back({fifo ? Grade::kGood : Grade::kPoor, "real-time priority",
                      fifo ? "granted up to " + std::to_string(priority) : "not granted",
                      fifo ? "" : fifo_refusal(rights, priority)});
  const bool lock = rights.cap_ipc_lock || rights.memlock_limit_bytes == UINT64_MAX;
  verdicts.push_back({lock ? Grade::kGood : Grade::kFair, "memory lock",
                      lock ? "granted" : "not granted", lock ? "" : memory_lock_refusal(rights)});
}

void add_ports(const MachineFacts& facts, std::vector<Verdict>& verdicts) {
  for (const MachineFacts::SerialPort& port : facts.ports) {
    verdicts.push_back({port.accessible ? Grade::kGood : Grade::kPoor, "port /dev/" + port.name,
                        port.accessible ? "you may open it" : "you may not open it",
                        port.accessible
                            ? ""
                            : "join its group: sudo usermod -aG dialout $USER, then log in again"});
    if (!port.latency_timer_ms) continue;
    const bool quick = *port.latency_timer_ms <= 1;
    verdicts.push_back({quick ? Grade::kGood : Grade::kFair, "latency timer of /dev/" + port.name,
                        std::to_string(*port.latency_timer_ms) + " ms",
                        quick ? ""
                              : "echo 1 | sudo tee /sys/bus/usb-serial/devices/" + port.name +
                                    "/latency_timer: the adapter delays bytes by up to this time"});
  }
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
  std::vector<Verdict> verdicts;
  add_rights(facts, priority, verdicts);
  verdicts.push_back({facts.realtime_kernel ? Grade::kGood : Grade::kFair, "kernel",
                      facts.realtime_kernel ? "PREEMPT_RT" : "no PREEMPT_RT",
                      facts.realtime_kernel
                          ? ""
                          : "for wake-ups within 50 µs under load: apt install "
                            "linux-image-rt-amd64 (Debian), or Ubuntu Pro's real-time kernel"});
  if (facts.hypervisor) {
    verdicts.push_back({Grade::kFair, "hypervisor", "this is a virtual machine",
                        "its host may suspend the cores for milliseconds, which this machine "
                        "cannot prevent: for hard deadlines, run on physical hardware"});
  }
  if (!facts.clock_source.empty()) {
    const bool quick = facts.clock_source == "tsc" || facts.clock_source == "arch_sys_counter" ||
                       facts.clock_source == "kvm-clock";
    verdicts.push_back({quick ? Grade::kGood : Grade::kPoor, "clock source", facts.clock_source,
                        quick ? ""
                              : "reading this clock is slow: boot with "
                                "tsc=reliable if the processor's tsc is invariant"});
  }
  if (!facts.governor.empty()) {
    const bool full = facts.governor == "performance";
    verdicts.push_back({full ? Grade::kGood : Grade::kFair, "frequency governor", facts.governor,
                        full ? "" : "sudo cpupower frequency-set -g performance"});
  }
  if (facts.rt_runtime_us) {
    const bool some = *facts.rt_runtime_us != 0;
    verdicts.push_back({some ? Grade::kGood : Grade::kPoor, "real-time throttling",
                        *facts.rt_runtime_us < 0
                            ? "none"
                            : "at " + std::to_string(*facts.rt_runtime_us) + " µs of each second",
                        some ? "" : "sudo sysctl kernel.sched_rt_runtime_us=950000"});
  }
  if (!facts.isolated_cores.empty()) {
    verdicts.push_back({Grade::kGood, "isolated cores", facts.isolated_cores,
                        "pin the loop to one of them: [loop] cpu"});
  }
  add_ports(facts, verdicts);
  return verdicts;
}

}  // namespace merkel
