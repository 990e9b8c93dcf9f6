#include "tools/run/loop_settings.hpp"

namespace merkel {

void read_loop_settings(SceneTable& table, LoopSettings& loop) {
  auto wait = static_cast<std::size_t>(loop.wait);
  table.word("wait", {"hybrid", "sleep"}, wait);
  loop.wait = static_cast<LoopWait>(wait);
  std::size_t scheduler = loop.realtime.fifo ? 0 : 1;
  table.word("scheduler", {"fifo", "normal"}, scheduler);
  loop.realtime.fifo = scheduler == 0;
  table.whole("threads", loop.threads)
      .whole("priority", loop.realtime.priority)
      .truth("lock_memory", loop.realtime.lock_memory)
      .truth("cpu_awake", loop.realtime.cpu_awake);
  if (table.has("cpu")) {
    int cpu = 0;
    table.whole("cpu", cpu);
    loop.realtime.cpu = cpu;
  }
  table.known("cpu");
}

}  // namespace merkel
