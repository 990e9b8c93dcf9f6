#include "tools/scene/machine_facts.hpp"

#include <fstream>
#include <thread>

#include <sys/utsname.h>

#include "core/simd/simd_target.hpp"
#include "drivers/clock/utc_error.hpp"

namespace merkel {

std::vector<std::pair<std::string, std::string>> machine_facts() {
  utsname name{};
  static_cast<void>(::uname(&name));
  const std::string version = name.version;
  char flag = '0';
  std::ifstream("/sys/kernel/realtime").get(flag);
  const bool realtime = flag == '1' || version.find("PREEMPT_RT") != std::string::npos ||
                        version.find("PREEMPT RT") != std::string::npos;
  std::vector<std::pair<std::string, std::string>> facts = {
      {"kernel", std::string(name.sysname) + " " + name.release + " " + version},
      {"kernel_realtime", realtime ? "yes" : "no"},
      {"processors", std::to_string(std::thread::hardware_concurrency())},
      {"simd_target", simd_target()}};
  std::string boot;
  if (std::ifstream("/proc/sys/kernel/random/boot_id") >> boot) facts.emplace_back("boot_id", boot);
  return facts;
}

std::vector<std::pair<std::string, std::string>> utc_facts() {
  const auto error = utc_error();
  if (!error) return {};
  return {{"utc_error_ns", std::to_string(error->largest.count())},
          {"utc_error_source", error->source}};
}

}  // namespace merkel
