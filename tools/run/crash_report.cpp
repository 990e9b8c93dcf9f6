#include "tools/run/crash_report.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <string_view>

#include <elf.h>
#include <link.h>
#include <sys/prctl.h>
#include <unistd.h>

namespace merkel {
namespace {

// The only state that a signal handler may access.
std::array<char, 64> g_build_id{};
std::atomic<const LoopStatistics*> g_statistics{nullptr};
std::atomic<std::int64_t> g_tick_ns{0};
[[maybe_unused]] alignas(16) std::array<char, 65536> g_stack{};

/// A line of text, built only from async-signal-safe functions.
class Line {
 public:
  Line& operator<<(std::string_view text) noexcept {
    const std::size_t count = std::min(text.size(), text_.size() - used_);
    std::memcpy(text_.data() + used_, text.data(), count);
    used_ += count;
    return *this;
  }
  Line& operator<<(std::uint64_t number) noexcept {
    std::array<char, 20> digits{};
    std::size_t first = digits.size();
    do {
      digits[--first] = static_cast<char>('0' + number % 10);
      number /= 10;
    } while (number > 0);
    return *this << std::string_view(digits.data() + first, digits.size() - first);
  }
  void print() const noexcept {
    if (::write(STDERR_FILENO, text_.data(), used_) < 0) return;
  }

 private:
  std::array<char, 1024> text_{};
  std::size_t used_ = 0;
};

std::string_view name_of_signal(int signal) noexcept {
  switch (signal) {
    case SIGSEGV:
      return "SIGSEGV, an invalid memory access";
    case SIGBUS:
      return "SIGBUS, a bus error";
    case SIGFPE:
      return "SIGFPE, an arithmetic error";
    case SIGILL:
      return "SIGILL, an instruction that this processor does not support";
    default:
      return "SIGABRT, an abort";
  }
}

[[maybe_unused]] void report(int signal) {
  std::array<char, 17> thread{};
  ::prctl(PR_GET_NAME, thread.data());
  Line line;
  line << "\nmerkel " MERKEL_VERSION " crashed: " << name_of_signal(signal) << ", in thread "
       << thread.data() << "; build id " << g_build_id.data() << "\n";
  if (const LoopStatistics* const run = g_statistics.load()) {
    const std::uint64_t ticks = run->ticks.value() + run->skipped_ticks.value();
    const auto ms = ticks * static_cast<std::uint64_t>(g_tick_ns.load()) / 1'000'000;
    line << "The simulation had reached tick " << ticks << " (" << ms << " ms), with "
         << run->spikes.value() << " spikes, " << run->overruns.value() << " overruns and "
         << run->gaps.value() << " gaps. Spikes up to the last flush (at most 200 ms ago) are in "
         << "the sinks' .part files.\n";
  } else {
    line << "No simulation was running.\n";
  }
  line << "Please report these lines together with the command line.\n";
  line.print();
  ::raise(signal);  // the default action: the handler was reset
}

int find_build_id(dl_phdr_info* info, std::size_t /*size*/, void* /*context*/) {
  for (int i = 0; i < info->dlpi_phnum; ++i) {
    const ElfW(Phdr)& header = info->dlpi_phdr[i];
    if (header.p_type != PT_NOTE) continue;
    // The loader gives addresses as integers.  NOLINTNEXTLINE(performance-no-int-to-ptr)
    const auto* note = reinterpret_cast<const char*>(info->dlpi_addr + header.p_vaddr);
    const char* const end = note + header.p_memsz;
    while (note + sizeof(ElfW(Nhdr)) <= end) {
      ElfW(Nhdr) head{};
      std::memcpy(&head, note, sizeof head);
      const auto padded = [](std::uint32_t size) { return (std::size_t{size} + 3) / 4 * 4; };
      const char* const name = note + sizeof head;
      const char* const content = name + padded(head.n_namesz);
      if (head.n_type == NT_GNU_BUILD_ID && head.n_namesz == 4 &&
          std::memcmp(name, "GNU", 4) == 0) {
        constexpr std::string_view kDigits = "0123456789abcdef";
        const std::size_t bytes = std::min<std::size_t>(head.n_descsz, (g_build_id.size() - 1) / 2);
        for (std::size_t k = 0; k < bytes; ++k) {
          const auto byte = static_cast<unsigned char>(content[k]);
          g_build_id[2 * k] = kDigits[byte >> 4U];
          g_build_id[2 * k + 1] = kDigits[byte & 15U];
        }
      }
      note = content + padded(head.n_descsz);
    }
  }
  return 1;  // the first object is the program
}

}  // namespace

void install_crash_report() {
  ::dl_iterate_phdr(find_build_id, nullptr);
#ifndef MERKEL_SANITIZED  // a sanitizer reports more
  stack_t stack{};
  stack.ss_sp = g_stack.data();
  stack.ss_size = g_stack.size();
  ::sigaltstack(&stack, nullptr);
  struct sigaction action {};
  action.sa_handler = report;
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_NODEFER | SA_ONSTACK);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) {
    ::sigaction(signal, &action, nullptr);
  }
#endif
}

CrashWatch::CrashWatch(const LoopStatistics& statistics, std::chrono::nanoseconds tick) noexcept {
  g_tick_ns.store(tick.count());
  g_statistics.store(&statistics);
}

CrashWatch::~CrashWatch() { g_statistics.store(nullptr); }

}  // namespace merkel
