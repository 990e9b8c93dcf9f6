#include "tools/scene/machine_facts.hpp"

#include <fstream>
#include <thread>

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
  return {{"kernel", std::string(name.sysname) + " " + name.release + " " + version},
          {"kernel_realtime", realtime ? "yes" : "no"},
          {"processors", std::to_string(std::thread::hardware_concurrency())},
          {"simd_target", simd_target()}};
}

}  // namespace merkel
