#include "realtime/threads/spinning_team.hpp"

#include <algorithm>
#include <cassert>
#include <string>
#include <utility>

#include <sched.h>

#include "realtime/threads/host_time.hpp"
#include "realtime/threads/spin_wait.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr nanoseconds kWakeBefore{80'000};  ///< before the announced work
constexpr nanoseconds kPatience{200'000};   ///< how long a worker spins without work
constexpr nanoseconds kDoze{50'000};
constexpr int kSpinsBetweenLooks = 64;

}  // namespace

int SpinningTeam::available_cores() {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  if (::sched_getaffinity(0, sizeof(allowed), &allowed) == 0) return CPU_COUNT(&allowed);
  return static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

Expected<std::unique_ptr<SpinningTeam>, SetupError> SpinningTeam::create(int size,
                                                                         const Setup& setup,
                                                                         int cores) {
  if (size < 1 || size > cores) {
    return bad_input("loop.threads = " + std::to_string(size) + " must be from 1 to " +
                     std::to_string(cores) + ", the number of cores available to merkel");
  }
  std::unique_ptr<SpinningTeam> team(new SpinningTeam(static_cast<std::size_t>(size - 1)));
  for (std::size_t i = 0; i < team->slots_.size(); ++i) {
    team->threads_.emplace_back([team = team.get(), setup, i] {
      if (setup) setup(static_cast<int>(i) + 1);
      team->work(i);
    });
  }
  return team;
}

SpinningTeam::~SpinningTeam() { end_.store(true, std::memory_order_relaxed); }

bool SpinningTeam::wait_for_work(const Slot& slot, std::uint64_t done) const noexcept {
  nanoseconds idle_since = host_now();
  while (!end_.load(std::memory_order_relaxed)) {
    for (int spin = 0; spin < kSpinsBetweenLooks; ++spin) {
      if (slot.posted.load(std::memory_order_acquire) != done) return true;
      pause_core();
    }
    const nanoseconds now = host_now();
    const nanoseconds wake =
        nanoseconds{next_work_ns_.load(std::memory_order_relaxed)} - kWakeBefore;
    if (now < wake) {
      // Check for the end regularly, however far away the next work is.
      host_sleep_until(std::min(wake, now + nanoseconds{20'000'000}));
      idle_since = host_now();
    } else if (now - std::max(idle_since, wake) > kPatience + kWakeBefore) {
      host_sleep_until(now + kDoze);
    }
  }
  return false;
}

void SpinningTeam::work(std::size_t worker) noexcept {
  Slot& slot = slots_[worker];
  std::uint64_t done = 0;
  while (wait_for_work(slot, done)) {
    done = slot.posted.load(std::memory_order_acquire);
    slot.part(slot.context, static_cast<int>(worker) + 1);
    slot.done.store(done, std::memory_order_release);
  }
}

void SpinningTeam::run(int parts, Part part, void* context) noexcept {
  assert(parts >= 1 && parts <= size());
  ++works_;
  parts_ = parts;
  const auto helpers = static_cast<std::size_t>(parts - 1);
  for (std::size_t i = 0; i < helpers; ++i) {
    slots_[i].part = part;
    slots_[i].context = context;
    slots_[i].posted.store(works_, std::memory_order_release);
  }
  part(context, 0);
  for (std::size_t i = 0; i < helpers; ++i) {
    SpinWait wait;
    while (slots_[i].done.load(std::memory_order_acquire) != works_) wait.once();
  }
}

void SpinningTeam::barrier() noexcept {
  if (parts_ == 1) return;
  const std::uint32_t phase = phase_.load(std::memory_order_relaxed);
  if (arrived_.fetch_add(1, std::memory_order_acq_rel) == parts_ - 1) {
    arrived_.store(0, std::memory_order_relaxed);
    phase_.store(phase + 1, std::memory_order_release);
    return;
  }
  SpinWait wait;
  while (phase_.load(std::memory_order_acquire) == phase) wait.once();
}

}  // namespace merkel
