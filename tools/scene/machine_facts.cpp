#include "tools/scene/machine_facts.hpp"

#include <cstdint>
#include <fstream>
#include <thread>

#include <sys/timex.h>
#include <sys/utsname.h>

#include "core/simd/simd_target.hpp"

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
  // The largest error of UTC, as the program that sets the clock (chrony, ntpd, PTP) told the
  // kernel.
  timex clock{};
  if (::adjtimex(&clock) != -1 && (clock.status & STA_UNSYNC) == 0) {
    facts.emplace_back("utc_error_ns", std::to_string(std::int64_t{clock.maxerror} * 1000));
  }
  return facts;
}

}  // namespace merkel
