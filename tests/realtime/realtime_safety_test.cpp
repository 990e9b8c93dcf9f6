// Replaces, for this whole program, the functions by which a thread allocates, maps, locks, wakes
// or writes, to prove that the simulation thread calls none of them. The loop reads its thread's
// resource usage (getrusage) at its beginning and end; the test checks all calls in between.
#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdarg>
#include <cstddef>
#include <cstdlib>
#include <ctime>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <dlfcn.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "core/encoding/stimulation_encoder.hpp"
#include "core/scene/tactile_model.hpp"
#include "drivers/probes/open_probe.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "realtime/pipeline.hpp"
#include "realtime/queues/bounded_queue.hpp"
#include "realtime/threads/spinning_team.hpp"
#include "realtime/threads/thread_setup.hpp"
#include "tests/realtime/system_call_trap.hpp"

namespace {

thread_local bool t_simulating = false;
std::atomic<int> g_calls{0};
std::atomic<int> g_sleeps{0};
std::atomic<const char*> g_last{""};
std::atomic<bool> g_trap_system_calls{false};  ///< for the next simulation thread
std::atomic<bool> g_trapped{false};
std::atomic<int> g_wall_step_s{0};  ///< jump of the wall clock at every reading, back and forth
std::atomic<int> g_looks_at_wall_clock{0};

void note_call(const char* name) {
  if (!t_simulating) return;
  ++g_calls;
  g_last = name;
}

template <class Function>
Function* original(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

// dlsym may allocate before the originals are known; this memory serves it.
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
  note_call("malloc");
  return real(size);
}

void free(void* memory) {
  static void (*real)(void*) = original<void(void*)>("free");
  if (memory == nullptr || is_early(memory)) return;
  note_call("free");
  real(memory);
}

void* calloc(std::size_t count, std::size_t size) {
  static std::atomic<bool> resolving{false};
  static void* (*real)(std::size_t, std::size_t) = nullptr;
  if (real == nullptr) {
    if (resolving.exchange(true)) return early(count * size);
    real = original<void*(std::size_t, std::size_t)>("calloc");
  }
  note_call("calloc");
  return real(count, size);
}

void* realloc(void* memory, std::size_t size) {
  static void* (*real)(void*, std::size_t) = original<void*(void*, std::size_t)>("realloc");
  note_call("realloc");
  return real(memory, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) {
  static void* (*real)(std::size_t, std::size_t) =
      original<void*(std::size_t, std::size_t)>("aligned_alloc");
  note_call("aligned_alloc");
  return real(alignment, size);
}

int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  static auto* real = original<int(void**, std::size_t, std::size_t)>("posix_memalign");
  note_call("posix_memalign");
  return real(memory, alignment, size);
}

void* mmap(void* address, std::size_t length, int protection, int flags, int file, off_t offset) {
  static auto* real = original<void*(void*, std::size_t, int, int, int, off_t)>("mmap");
  note_call("mmap");
  return real(address, length, protection, flags, file, offset);
}

int munmap(void* address, std::size_t length) {
  static auto* real = original<int(void*, std::size_t)>("munmap");
  note_call("munmap");
  return real(address, length);
}

int pthread_mutex_lock(pthread_mutex_t* mutex) {
  static auto* real = original<int(pthread_mutex_t*)>("pthread_mutex_lock");
  note_call("pthread_mutex_lock");
  return real(mutex);
}

int pthread_mutex_trylock(pthread_mutex_t* mutex) {
  static auto* real = original<int(pthread_mutex_t*)>("pthread_mutex_trylock");
  note_call("pthread_mutex_trylock");
  return real(mutex);
}

int pthread_cond_signal(pthread_cond_t* condition) {
  static auto* real = original<int(pthread_cond_t*)>("pthread_cond_signal");
  note_call("pthread_cond_signal");
  return real(condition);
}

int pthread_cond_broadcast(pthread_cond_t* condition) {
  static auto* real = original<int(pthread_cond_t*)>("pthread_cond_broadcast");
  note_call("pthread_cond_broadcast");
  return real(condition);
}

int sem_post(sem_t* semaphore) {
  static auto* real = original<int(sem_t*)>("sem_post");
  note_call("sem_post");
  return real(semaphore);
}

/// The path to futex, which has no wrapper of its own; std::atomic's notify uses it.
long syscall(long number, ...) {
  static auto* real = original<long(long, ...)>("syscall");
  note_call("syscall");
  std::va_list list;
  va_start(list, number);
  std::array<long, 6> a{};
  for (long& argument : a) argument = va_arg(list, long);
  va_end(list);
  return real(number, a[0], a[1], a[2], a[3], a[4], a[5]);
}

ssize_t write(int file, const void* bytes, std::size_t count) {
  static auto* real = original<ssize_t(int, const void*, std::size_t)>("write");
  note_call("write");
  return real(file, bytes, count);
}

ssize_t send(int file, const void* bytes, std::size_t count, int flags) {
  static auto* real = original<ssize_t(int, const void*, std::size_t, int)>("send");
  note_call("send");
  return real(file, bytes, count, flags);
}

ssize_t sendto(int file, const void* bytes, std::size_t count, int flags, const sockaddr* to,
               socklen_t length) {
  static auto* real =
      original<ssize_t(int, const void*, std::size_t, int, const sockaddr*, socklen_t)>("sendto");
  note_call("sendto");
  return real(file, bytes, count, flags, to, length);
}

int clock_nanosleep(clockid_t clock, int flags, const timespec* request, timespec* remain) {
  static auto* real = original<int(clockid_t, int, const timespec*, timespec*)>("clock_nanosleep");
  if (t_simulating) {
    ++g_sleeps;
    if (flags != TIMER_ABSTIME || clock != CLOCK_MONOTONIC) note_call("a relative sleep");
  }
  return real(clock, flags, request, remain);
}

int nanosleep(const timespec* request, timespec* remain) {
  static auto* real = original<int(const timespec*, timespec*)>("nanosleep");
  note_call("nanosleep");
  return real(request, remain);
}

/// The wall clock, which may be set at any time; the simulation must not depend on it.
int clock_gettime(clockid_t clock, timespec* time) noexcept {
  static auto* real = original<int(clockid_t, timespec*)>("clock_gettime");
  if (clock == CLOCK_REALTIME && g_wall_step_s != 0) {
    ++g_looks_at_wall_clock;
    const int result = real(clock, time);
    time->tv_sec += g_wall_step_s.exchange(-g_wall_step_s);
    return result;
  }
  return real(clock, time);
}

int getrusage(__rusage_who_t who, rusage* usage) noexcept {
  static auto* real = original<int(__rusage_who_t, rusage*)>("getrusage");
  if (who != RUSAGE_THREAD) return real(who, usage);
  if (t_simulating) merkel::count_system_calls(false);
  const int result = real(who, usage);
  t_simulating = !t_simulating;
  if (t_simulating && g_trap_system_calls.exchange(false)) {
    g_trapped = merkel::trap_system_calls_of_this_thread();
    merkel::count_system_calls(true);
  }
  return result;
}

}  // extern "C"

namespace merkel {
namespace {

/// Runs `call` as if on the simulation thread, and returns the number of detected calls.
template <class Call>
int seen(Call call) {
  g_calls = 0;
  static_cast<void>(ThreadUsage::of_this_thread());
  call();
  static_cast<void>(ThreadUsage::of_this_thread());
  return g_calls;
}

TEST(RealtimeSafety, TheTrapDetectsForbiddenCalls) {
  EXPECT_EQ(seen([] {}), 0);
  EXPECT_EQ(seen([] {
              void* volatile memory = std::malloc(100);
              std::free(memory);
            }),
            2);
  EXPECT_EQ(seen([] { const std::vector<int> allocated(10); }), 2);
  std::mutex mutex;
  EXPECT_EQ(seen([&mutex] { const std::lock_guard lock(mutex); }), 1);
  EXPECT_EQ(seen([] {
              void* const page =
                  ::mmap(nullptr, 4096, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
              ::munmap(page, 4096);
            }),
            2);
  const int file = ::open("/dev/null", O_WRONLY);
  EXPECT_EQ(seen([file] { EXPECT_EQ(::write(file, "x", 1), 1); }), 1);
  ::close(file);
  std::condition_variable condition;
  EXPECT_EQ(seen([&condition] { condition.notify_one(); }), 1);
  EXPECT_EQ(seen([] { ::syscall(SYS_futex, nullptr, 0, 0, nullptr, nullptr, 0); }), 1);
  EXPECT_EQ(seen([] { std::this_thread::sleep_for(std::chrono::nanoseconds{1}); }), 1);
}

/// Watches neurons, marks every batch of ticks and requests tares continuously.
class WatchingSink final : public Sink {
 public:
  struct Seen {
    std::atomic<std::uint64_t> samples{0};
    std::atomic<std::uint64_t> marks{0};
  };
  explicit WatchingSink(Seen& seen) : seen_(seen) {}
  const std::string& uri() const noexcept override { return uri_; }
  std::uint32_t subscriptions() const noexcept override {
    return kKinds<SpikeEvent, TickRecord, Mark, NeuronSample>;
  }
  void attach(RunControl& control) override {
    control_ = &control;
    const std::array<std::uint32_t, 4> watched = {8, 13, 20, 21};  // neuron 21 does not exist
    control.watch(watched);
  }
  Expected<void, SinkError> write(const RecordBatch& batch) override {
    seen_.marks += batch.marks.size();
    seen_.samples += batch.neurons.size();
    if (batch.ticks.empty()) return {};
    control_->mark({.time = batch.ticks.back().time, .label = "batch"});
    EXPECT_FALSE(control_->tare(0));  // simulated
    EXPECT_FALSE(control_->tare(7));
    EXPECT_EQ(control_->link(0), RunControl::Link::kConnected);
    return {};
  }
  Expected<void, SinkError> close() override { return {}; }

 private:
  std::string uri_ = "watching:";
  Seen& seen_;
  RunControl* control_ = nullptr;
};

/// One electrode of each kind, in the middle of the patch, and a group, on a stimulator that holds
/// few waveforms.
StimulationEncoder encoder_of(const TactileModel& model) {
  EncodingParameters parameters;
  parameters.groups.emplace_back().pattern.name = "group";
  parameters.groups[0].pattern.encoder = EncoderKind::kLinear;
  parameters.groups[0].pattern.frequency_Hz = {0.0, 200.0};
  constexpr int kKinds = static_cast<int>(EncoderKind::kOwn) + 1;
  for (int i = 0; i < kKinds + 2; ++i) {
    Electrode electrode{.name = "E" + std::to_string(i)};
    electrode.field_mm = {15.0, 10.0, 8.0};
    electrode.encoder = static_cast<EncoderKind>(i % kKinds);
    if (i >= kKinds) electrode.group = 0;
    electrode.amplitude_uA = {20.0, 80.0};
    electrode.frequency_Hz = {0.0, 200.0};
    parameters.electrodes.push_back(electrode);
  }
  parameters.stimulation.max_charge_nC = 16.0;
  parameters.stimulation.max_total_uA = 150.0;
  parameters.stimulation.watchdog = std::chrono::milliseconds{100};
  parameters.stimulation.max_electrodes = 3;
  parameters.stimulation.max_slope_uA_per_s = 2000.0;
  parameters.stimulator.name = "box";
  parameters.stimulator.amplitude_step_uA = 1.0;
  parameters.stimulator.waveforms = 2;
  parameters.join_groups();
  return *StimulationEncoder::create(parameters, encoded_model(model));
}

TEST(RealtimeSafety, TheSimulationThreadNeitherAllocatesNorLocksNorWakesNorWrites) {
  // Two probes with dropouts, so that holding, releasing and resuming also occur.
  TactileModel::Parameters scene;
  scene.indenters = {Indenter{}, Indenter{}};
  auto model = TactileModel::create(scene);
  ASSERT_TRUE(model);
  const auto team = SpinningTeam::create(2, {}, 2);
  BoundedQueue<TickTiming> timings(10'000);
  StimulationEncoder encoder = encoder_of(*model);
  Pipeline pipeline(*model, {.fast = false,
                             .delay = std::chrono::milliseconds{2},
                             .encoder = &encoder,
                             .team = team->get(),
                             .timings = &timings});
  const std::string uri = "sim:taps?tap_s=0.1&interval_s=0.15&depth_mm=2&dropouts_per_s=5&live=1";
  pipeline.add_probe(std::move(*open_probe(uri + "&seed=1")), {.x_mm = 9.0, .y_mm = 7.5});
  pipeline.add_probe(std::move(*open_probe(uri + "&seed=2")), {.x_mm = 21.0, .y_mm = 12.5});
  const auto neurons = static_cast<std::uint32_t>(model->neurons());
  pipeline.add_sink(std::move(*open_sink("csv:/dev/null", neurons, false)));
  // A sink that requests everything.
  pipeline.add_sink(std::move(*open_sink("xdf:/dev/null", neurons, false)));
  WatchingSink::Seen seen;
  pipeline.add_sink(std::make_unique<WatchingSink>(seen));
  g_calls = 0;
  g_sleeps = 0;
  const auto report = pipeline.run();
  ASSERT_TRUE(report);
  EXPECT_GT(report->spikes, 0U);
  EXPECT_EQ(seen.samples, 3 * report->ticks);
  EXPECT_GT(seen.marks, 10U);
  EXPECT_GT(report->probes[0].releases, 0U);
  EXPECT_GT(report->commands, 0U);
  EXPECT_GT(report->stimulation_stops, 0U);
  EXPECT_GT(encoder.clippings().all(), 0U);
  EXPECT_GT(report->host_time->queue.count, 0U);
  EXPECT_GT(g_sleeps, 500);
  EXPECT_EQ(g_calls, 0) << g_last.load();
}

TEST(RealtimeSafety, ATactileArrayNeitherAllocatesNorLocks) {
  TactileModel::Parameters scene;
  scene.patches.front().layout = ReceptorLayout::kFields;
  scene.network.gain = 0.0;
  set_kind(scene, NeuronKind::kIntegrateAndFire);
  Indenter& array = scene.indenters.front();
  array.tip = TaxelArray{.columns = 8, .rows = 8, .place = {.x_mm = 15.0, .y_mm = 10.0}};
  array.control = Indenter::Control::kForce;
  auto model = TactileModel::create(scene);
  ASSERT_TRUE(model) << model.error().reason;
  Pipeline pipeline(*model, {.fast = false, .delay = std::chrono::milliseconds{2}});
  pipeline.add_probe(
      std::move(*open_probe("sim:pad?columns=8&rows=8&count=2&tap_s=0.3&interval_s=0.3&tail_s=0.1"
                            "&noise_kPa=0.1&rate_hz=4000&live=1#taxels=64")),
      {.decimate = ProbeInput::Decimate::kMean});
  pipeline.add_sink(
      std::move(*open_sink("xdf:/dev/null", static_cast<std::uint32_t>(model->neurons()), false)));
  g_calls = 0;
  const auto report = pipeline.run();
  ASSERT_TRUE(report) << report.error().sentence;
  EXPECT_GT(report->spikes, 20U);
  EXPECT_GT(model->deepest()[0].contact.force_mN, 500.0);
  EXPECT_EQ(g_calls, 0) << g_last.load();
}

TEST(RealtimeSafety, TheSimulationThreadOnlySleepsAndReadsItsProcessorTime) {
  const auto run = [] {
    auto model = TactileModel::create({});
    Pipeline pipeline(*model, {.fast = false});
    const std::string uri = "sim:taps?tap_s=0.1&interval_s=0.15&depth_mm=2&live=1&tail_s=0.1";
    pipeline.add_probe(std::move(*open_probe(uri)), {});
    pipeline.add_sink(std::move(
        *open_sink("csv:/dev/null", static_cast<std::uint32_t>(model->neurons()), false)));
    return pipeline.run();
  };
  // First check that the trap works.
  std::jthread([] {
    g_trap_system_calls = true;
    static_cast<void>(ThreadUsage::of_this_thread());
    if (g_trapped) ::sched_yield();
    static_cast<void>(ThreadUsage::of_this_thread());
  }).join();
  if (!g_trapped) GTEST_SKIP() << "this kernel or processor has no such trap";
  EXPECT_EQ(system_calls_counted(), 1);
  EXPECT_EQ(last_system_call(), SYS_sched_yield);

  g_trap_system_calls = true;
  const auto report = run();
  ASSERT_TRUE(report);
  EXPECT_GT(report->spikes, 0U);
  EXPECT_GT(report->ticks, 500U);
  EXPECT_EQ(system_calls_counted(), 1) << "system call " << last_system_call();
}

/// Spikes of a recorded press in real time.
std::uint64_t spikes_in_real_time() {
  auto model = TactileModel::create({});
  Pipeline pipeline(*model, {.fast = false});
  pipeline.add_probe(std::move(*open_probe("sim:taps?count=2&interval_s=0.15&tail_s=0.05")), {});
  const auto report = pipeline.run();
  EXPECT_EQ(report->probes[0].counts.late, 0U);
  EXPECT_EQ(report->probes[0].counts.held_ticks, 0U);
  return report->spikes;
}

TEST(RealtimeSafety, AWallClockThatIsSetChangesNothing) {
  const std::uint64_t spikes = spikes_in_real_time();
  EXPECT_GT(spikes, 0U);
  g_wall_step_s = 3600;
  EXPECT_EQ(spikes_in_real_time(), spikes);
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);  // the trap works
  EXPECT_GT(g_looks_at_wall_clock, 0);
  g_wall_step_s = 0;
}

}  // namespace
}  // namespace merkel
