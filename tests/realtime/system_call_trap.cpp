#include "tests/realtime/system_call_trap.hpp"

#include <atomic>

#if defined(__x86_64__) && defined(__linux__)
#include <array>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <ctime>

#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/ucontext.h>
#endif

namespace merkel {
namespace {

std::atomic<bool> g_counting{false};
std::atomic<int> g_counted{0};
std::atomic<int> g_last{-1};

}  // namespace

void count_system_calls(bool counting) { g_counting = counting; }
int system_calls_counted() { return g_counted; }
int last_system_call() { return g_last; }

#if defined(__x86_64__) && defined(__linux__)

// The only place from which the filter allows every call.
extern "C" {
long merkel_let_through(long number, const long* arguments);
extern const char merkel_let_through_return;  // NOLINT(readability-identifier-naming): a label
}
asm(R"(
.text
.globl merkel_let_through
.type merkel_let_through, @function
merkel_let_through:
  mov %rdi, %rax
  mov %rsi, %r11
  mov 0(%r11), %rdi
  mov 8(%r11), %rsi
  mov 16(%r11), %rdx
  mov 24(%r11), %r10
  mov 32(%r11), %r8
  mov 40(%r11), %r9
  syscall
.globl merkel_let_through_return
merkel_let_through_return:
  ret
)");

namespace {

void count(int /*signal*/, siginfo_t* info, void* context) {
  auto& registers = static_cast<ucontext_t*>(context)->uc_mcontext.gregs;
  if (g_counting) {
    ++g_counted;
    g_last = info->si_syscall;
  }
  const std::array<long, 6> arguments = {registers[REG_RDI], registers[REG_RSI], registers[REG_RDX],
                                         registers[REG_R10], registers[REG_R8],  registers[REG_R9]};
  registers[REG_RAX] = merkel_let_through(info->si_syscall, arguments.data());
}

}  // namespace

bool trap_system_calls_of_this_thread() {
  struct sigaction action {};
  action.sa_sigaction = count;
  action.sa_flags = SA_SIGINFO | SA_NODEFER;
  if (::sigaction(SIGSYS, &action, nullptr) != 0) return false;
  const auto through = reinterpret_cast<std::uintptr_t>(&merkel_let_through_return);
  const auto low = static_cast<std::uint32_t>(through);
  const auto high = static_cast<std::uint32_t>(through >> 32U);
  constexpr auto kNumber = static_cast<std::uint32_t>(offsetof(seccomp_data, nr));
  constexpr auto kPlace = static_cast<std::uint32_t>(offsetof(seccomp_data, instruction_pointer));
  constexpr auto kClock = static_cast<std::uint32_t>(offsetof(seccomp_data, args));
  std::array<sock_filter, 12> filter = {{
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kPlace),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, low, 0, 2),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kPlace + 4),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, high, 7, 0),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kNumber),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_clock_nanosleep, 5, 0),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_rt_sigreturn, 4, 0),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_clock_gettime, 0, 2),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kClock),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, CLOCK_THREAD_CPUTIME_ID, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  }};
  const sock_fprog program{.len = filter.size(), .filter = filter.data()};
  return ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

#else

bool trap_system_calls_of_this_thread() { return false; }

#endif

}  // namespace merkel
