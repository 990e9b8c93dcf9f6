#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <new>
#include <thread>
#include <vector>

#include "core/expected.hpp"
#include "core/realtime_tag.hpp"
#include "core/worker_team.hpp"

namespace merkel {

/// Threads that share the work of a tick: the caller's own and size−1 workers.
///
/// Within a tick no thread sleeps: hand-overs, waits and barriers spin (and yield if a core is
/// taken away). Between ticks the workers sleep until shortly before the announced time of their
/// next work. Without an announcement, they spin briefly after their last work and then poll every
/// 50 µs. The caller makes no system call to wake them.
class SpinningTeam final : public WorkerTeam {
 public:
  /// Called once on each new worker thread, before its first work, to name and pin it and to set
  /// its priority.
  using Setup = std::function<void(int worker)>;

  /// How many threads this process may run at the same time. Real-time: no.
  [[nodiscard]] static int available_cores();

  /// Starts size−1 workers, numbered from 1. Fails if `size` is below 1 or above `cores`: threads
  /// that spin for each other on one core would not make progress. Real-time: no.
  [[nodiscard]] static Expected<std::unique_ptr<SpinningTeam>, SetupError> create(
      int size, const Setup& setup = {}, int cores = available_cores());

  SpinningTeam(const SpinningTeam&) = delete;
  SpinningTeam& operator=(const SpinningTeam&) = delete;
  /// Ends and joins the workers. No work may be in progress.
  ~SpinningTeam();

  [[nodiscard]] int size() const noexcept override { return 1 + static_cast<int>(slots_.size()); }
  void run(int parts, Part part, void* context) noexcept MERKEL_REALTIME override;
  void barrier() noexcept MERKEL_REALTIME override;

  /// Announces that no work comes before `time`, host-monotonic: the workers sleep until shortly
  /// before. Real-time: yes. Thread: the caller of run().
  void rest_until(std::chrono::nanoseconds time) noexcept MERKEL_REALTIME {
    next_work_ns_.store(time.count(), std::memory_order_relaxed);
  }

 private:
  /// State shared by the caller and one worker, on its own cache line.
  struct alignas(64) Slot {
    std::atomic<std::uint64_t> posted{0};  ///< number of the latest work handed over
    std::atomic<std::uint64_t> done{0};    ///< number of the latest work done
    Part part = nullptr;                   ///< written before `posted`
    void* context = nullptr;
  };

  explicit SpinningTeam(std::size_t workers) : slots_(workers) {}
  void work(std::size_t worker) noexcept;
  bool wait_for_work(const Slot& slot, std::uint64_t done) const noexcept;

  std::vector<Slot> slots_;  ///< of worker i + 1
  std::vector<std::jthread> threads_;
  std::uint64_t works_ = 0;
  int parts_ = 1;  ///< of the current work; written before the slots' `posted`
  alignas(64) std::atomic<std::int64_t> next_work_ns_{0};
  std::atomic<bool> end_{false};
  alignas(64) std::atomic<int> arrived_{0};
  alignas(64) std::atomic<std::uint32_t> phase_{0};
};

}  // namespace merkel
