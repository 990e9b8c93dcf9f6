#include "realtime/output/gate_thread.hpp"

#include <utility>

#include "realtime/threads/host_time.hpp"
#include "realtime/threads/serving_priority.hpp"

namespace merkel {
namespace {

constexpr std::chrono::milliseconds kGateEvery{1};

}  // namespace

void GateThread::refuse(std::span<const SentCommand> commands, std::uint32_t sink) {
  const std::lock_guard lock(mutex_);
  for (SentCommand command : commands) {
    command.refused_by = sink;
    refused_.push_back(command);
  }
}

/// Sends the record what receivers have refused since the last call.
void GateThread::push_refused() {
  std::vector<SentCommand> refused;
  {
    const std::lock_guard lock(mutex_);
    std::swap(refused, refused_);
  }
  if (!refused.empty()) push(refused, true);
}

void GateThread::push(std::span<const SentCommand> commands, bool only_records) {
  for (const Output& output : outputs_) {
    if (only_records && !output.records) continue;
    Feed<SentCommand>& feed = output.channel->feed<SentCommand>();
    for (const SentCommand& command : commands) {
      if (!feed.try_push(command)) feed.drop();
    }
    output.channel->new_commands.release();
  }
}

void GateThread::run(const std::stop_token& stop) {
  set_up_helper_thread("merkel-gate");
  ServingPriority priority(realtime_);
  StimulationGate gate = watch_.make_gate();
  std::vector<std::chrono::nanoseconds> newest(watch_.patches());
  std::vector<StimulationCommand> commands;
  Feed<StimulationCommand>& input = input_.feed<StimulationCommand>();
  std::uint64_t seen = 0;
  for (bool ended = false; !ended;) {
    // Read the flag before the queue: it is set after the last command.
    ended = input_.ended.load(std::memory_order_acquire) || stop.stop_requested();
    priority.check(host_now());
    commands.clear();
    input.take(commands, input.waiting());
    // The gate is asked also if no command waits: it is the watchdog.
    push(gate.pass(commands, watch_.moment(newest)), false);
    watch_.count(gate.counts());
    push_refused();
    if (!ended) input_.beat.wait(seen, kGateEvery);
  }
  end(false);
  // A receiver may still refuse what waits for it.
  while (receiving_.load(std::memory_order_acquire) > 0 && !stop.stop_requested()) {
    push_refused();
    std::this_thread::sleep_for(kGateEvery);
  }
  push_refused();
  end(true);
}

void GateThread::end(bool records) {
  for (const Output& output : outputs_) {
    if (output.records != records) continue;
    output.channel->feed<SentCommand>().end();
    output.channel->new_commands.release();
  }
}

}  // namespace merkel
