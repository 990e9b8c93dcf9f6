// Replaces the allocator of this whole program, to prove that the simulation thread does not touch
// it. A thread counts as the simulation thread from its first absolute sleep on: only the loop's
// periodic clock sleeps that way. What it does after its last sleep is its end, and not judged.
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <ctime>
#include <vector>

#include <dlfcn.h>
#include <gtest/gtest.h>

#include "core/scene/tactile_model.hpp"
#include "drivers/probes/open_probe.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "realtime/pipeline.hpp"

namespace {

thread_local bool t_simulating = false;
thread_local int t_calls_since_sleep = 0;
std::atomic<int> g_calls{0};
std::atomic<int> g_sleeps{0};

void note_call() {
  if (t_simulating) ++t_calls_since_sleep;
}

template <class Function>
Function* original(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

// dlsym itself may allocate before the originals are known: from here.
std::array<char, 65536> g_early;
std::size_t g_early_used = 0;

void* early(std::size_t size) {
  void* const memory = g_early.data() + g_early_used;
  g_early_used += (size + 15) / 16 * 16;
  return g_early_used <= g_early.size() ? memory : nullptr;
}

bool is_early(const void* memory) {
  return memory >= g_early.data() && memory < g_early.data() + g_early.size();
}

}  // namespace

extern "C" {

void* malloc(std::size_t size) {
  static std::atomic<bool> resolving{false};
  static void* (*real)(std::size_t) = nullptr;
  if (real == nullptr) {
    if (resolving.exchange(true)) return early(size);
    real = original<void*(std::size_t)>("malloc");
  }
  note_call();
  return real(size);
}

void free(void* memory) {
  static void (*real)(void*) = original<void(void*)>("free");
  if (memory == nullptr || is_early(memory)) return;
  note_call();
  real(memory);
}

void* calloc(std::size_t count, std::size_t size) {
  static std::atomic<bool> resolving{false};
  static void* (*real)(std::size_t, std::size_t) = nullptr;
  if (real == nullptr) {
    if (resolving.exchange(true)) return early(count * size);
    real = original<void*(std::size_t, std::size_t)>("calloc");
  }
  note_call();
  return real(count, size);
}

void* realloc(void* memory, std::size_t size) {
  static void* (*real)(void*, std::size_t) = original<void*(void*, std::size_t)>("realloc");
  note_call();
  return real(memory, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) {
  static void* (*real)(std::size_t, std::size_t) =
      original<void*(std::size_t, std::size_t)>("aligned_alloc");
  note_call();
  return real(alignment, size);
}

int clock_nanosleep(clockid_t clock, int flags, const timespec* request, timespec* remain) {
  static int (*real)(clockid_t, int, const timespec*, timespec*) =
      original<int(clockid_t, int, const timespec*, timespec*)>("clock_nanosleep");
  if (flags == TIMER_ABSTIME) {
    t_simulating = true;
    g_calls += std::exchange(t_calls_since_sleep, 0);
    ++g_sleeps;
  }
  return real(clock, flags, request, remain);
}

}  // extern "C"

namespace merkel {
namespace {

TEST(RealtimeSafety, TheTrapSeesAnAllocation) {
  g_calls = 0;
  const timespec past{};
  ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &past, nullptr);
  void* volatile memory = std::malloc(100);
  std::free(memory);
  ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &past, nullptr);
  t_simulating = false;
  EXPECT_EQ(g_calls, 2);
}

TEST(RealtimeSafety, TheSimulationThreadDoesNotAllocate) {
  // Two probes with dropouts, so that holding, releasing and resuming happen too.
  TactileModel::Parameters scene;
  scene.indenters = {Indenter{}, Indenter{}};
  auto model = TactileModel::create(scene);
  ASSERT_TRUE(model);
  Pipeline pipeline(*model, {.fast = false});
  const std::string uri = "sim:taps?tap_s=0.1&interval_s=0.15&depth_mm=2&dropouts_per_s=5";
  pipeline.add_probe(std::move(*open_probe(uri + "&seed=1")), {.x_mm = 9.0, .y_mm = 7.5});
  pipeline.add_probe(std::move(*open_probe(uri + "&seed=2")), {.x_mm = 21.0, .y_mm = 12.5});
  const std::size_t neurons = model->neurons();
  pipeline.add_sink(std::move(*open_sink("csv:/dev/null", NeuronNumbering({&neurons, 1}), false)));
  // One that asks for all there is.
  pipeline.add_sink(std::move(*open_sink("xdf:/dev/null", NeuronNumbering({&neurons, 1}), false)));
  g_calls = 0;
  g_sleeps = 0;
  const auto report = pipeline.run();
  ASSERT_TRUE(report);
  EXPECT_GT(report->spikes, 0U);
  EXPECT_GT(report->probes[0].releases, 0U);
  EXPECT_GT(g_sleeps, 500);
  EXPECT_EQ(g_calls, 0);
}

}  // namespace
}  // namespace merkel
