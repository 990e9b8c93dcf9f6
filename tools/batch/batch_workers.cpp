#include "tools/batch/batch_workers.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <memory>
#include <new>
#include <thread>
#include <utility>

#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace merkel {
namespace {

constexpr std::size_t kNone = SIZE_MAX;
constexpr std::size_t kMaxProcesses = 1024;

/// What the processes share.
struct Board {
  std::atomic<std::size_t> next{0};
  std::atomic<std::size_t> finished{0};
  std::atomic<std::size_t> item_of[kMaxProcesses];  ///< that a worker runs; kNone: none
};
static_assert(std::atomic<std::size_t>::is_always_lock_free);

/// A job's threads hand data to each other: left to the scheduler, those of two jobs meet on one
/// core while another is idle.
void keep_to_one_core(std::size_t place, std::size_t processes) {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  if (::sched_getaffinity(0, sizeof allowed, &allowed) != 0) return;
  if (processes > static_cast<std::size_t>(CPU_COUNT(&allowed))) return;
  for (std::size_t core = 0; core < CPU_SETSIZE; ++core) {
    if (!CPU_ISSET(core, &allowed) || place-- > 0) continue;
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(core, &one);
    ::sched_setaffinity(0, sizeof one, &one);
    return;
  }
}

[[noreturn]] void work_in_child(const SharedWork& work, Board& board, std::size_t place) {
  for (;;) {
    const std::size_t item = board.next.fetch_add(1);
    if (item >= work.items) break;
    board.item_of[place].store(item);
    if (!work.run(item)) break;
    board.item_of[place].store(kNone);
    board.finished.fetch_add(1);
  }
  ::_exit(0);
}

/// \return the child's number; −1 if there is none
pid_t start_worker(const SharedWork& work, Board& board, std::size_t place) {
  board.item_of[place].store(kNone);
  // A worker takes these signals only within a run, which then ends early.
  sigset_t ending;
  sigset_t before;
  sigemptyset(&ending);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&ending, signal);
  ::pthread_sigmask(SIG_BLOCK, &ending, &before);
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child != 0) {
    ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
    return child;
  }
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != parent) ::_exit(1);
  keep_to_one_core(place, std::min(work.processes, work.items));
  work_in_child(work, board, place);
}

std::string end_of(int status) {
  if (!WIFSIGNALED(status)) return "the process that ran the job ended unexpectedly";
  return std::string("the process that ran the job was ended by the signal ") +
         ::strsignal(WTERMSIG(status)) +
         (WTERMSIG(status) == SIGKILL ? ": if memory ran out, use fewer --jobs" : "");
}

}  // namespace

Expected<std::size_t, SetupError> run_shared(const SharedWork& work,
                                             const std::atomic<bool>& stop) {
  void* const memory =
      ::mmap(nullptr, sizeof(Board), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) {
    return unavailable(std::string("no memory for the workers: ") + std::strerror(errno));
  }
  Board& board = *new (memory) Board;
  const std::unique_ptr<void, void (*)(void*)> release(
      memory, [](void* bytes) { ::munmap(bytes, sizeof(Board)); });
  std::vector<pid_t> workers(
      std::clamp<std::size_t>(work.processes, 1, std::min(kMaxProcesses, work.items)));
  for (std::size_t place = 0; place < workers.size(); ++place) {
    workers[place] = start_worker(work, board, place);
    if (workers[place] > 0) continue;
    const std::string reason = std::strerror(errno);
    for (std::size_t i = 0; i < place; ++i) ::kill(workers[i], SIGTERM);
    return unavailable("cannot start a worker: " + reason);
  }
  bool told = false;
  for (std::size_t running = workers.size(); running > 0;) {
    if (stop.load() && !std::exchange(told, true)) {
      for (const pid_t worker : workers) {
        if (worker > 0) ::kill(worker, SIGTERM);
      }
    }
    int status = 0;
    const pid_t ended = ::waitpid(-1, &status, WNOHANG);
    if (work.on_progress) work.on_progress(board.finished.load());
    const auto at = std::find(workers.begin(), workers.end(), ended);
    if (ended <= 0 || at == workers.end()) {
      std::this_thread::sleep_for(std::chrono::milliseconds{5});
      continue;
    }
    *at = -1;
    --running;
    const auto place = static_cast<std::size_t>(at - workers.begin());
    const std::size_t item = board.item_of[place].load();
    if (stop.load() || (WIFEXITED(status) && WEXITSTATUS(status) == 0)) continue;
    if (item == kNone) continue;
    work.on_death(item, end_of(status));
    board.finished.fetch_add(1);
    *at = start_worker(work, board, place);
    if (*at > 0) ++running;
  }
  return board.finished.load();
}

}  // namespace merkel
