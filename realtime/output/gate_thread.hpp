#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <vector>

#include "core/encoding/stimulation_gate.hpp"
#include "realtime/output/fanout.hpp"
#include "realtime/output/run_watch.hpp"
#include "realtime/threads/thread_setup.hpp"

namespace merkel {

/// The thread of the gate of a run: takes the commands of the loop, and passes what leaves to all
/// sinks that take sent commands, at the same time. It is the watchdog, too, and depends on neither
/// the loop nor any sink.
class GateThread {
 public:
  /// \param fanout  of the loop, which has not started
  GateThread(Fanout& fanout, RunWatch& watch) : input_(fanout.add_channel()), watch_(watch) {
    input_.add<StimulationCommand>(kRoom);
  }
  GateThread(const GateThread&) = delete;
  GateThread& operator=(const GateThread&) = delete;

  /// Adds the channel of a sink that takes sent commands. Call it before start().
  /// \param records  the sink also gets what other sinks refused
  void add(ConsumerChannel& channel, bool records) {
    outputs_.push_back({.channel = &channel, .records = records});
    if (!records) receiving_.fetch_add(1, std::memory_order_relaxed);
  }
  /// \param realtime  of the simulation. The watch is guarded by now.
  void start(const RealtimeSettings& realtime) {
    realtime_ = realtime;
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  /// Takes the commands that a sink did not pass on. Thread: any.
  void refuse(std::span<const SentCommand> commands, std::uint32_t sink);
  /// A sink without `records` refuses nothing more. Once for each; thread: any.
  void end_receiver() noexcept { receiving_.fetch_sub(1, std::memory_order_release); }

 private:
  static constexpr std::size_t kRoom = 65536;
  struct Output {
    ConsumerChannel* channel = nullptr;
    bool records = false;
  };
  void run(const std::stop_token& stop);
  void push(std::span<const SentCommand> commands, bool only_records);
  void push_refused();
  void end(bool records);

  ConsumerChannel& input_;
  RunWatch& watch_;
  RealtimeSettings realtime_;
  std::vector<Output> outputs_;
  std::mutex mutex_;
  std::vector<SentCommand> refused_;  ///< guarded by mutex_
  std::atomic<std::size_t> receiving_{0};
  std::jthread thread_;
};

}  // namespace merkel
