#include "realtime/pipeline.hpp"

#include <algorithm>
#include <atomic>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/units.hpp"
#include "drivers/probes/open_probe.hpp"
#include "drivers/run_control.hpp"
#include "realtime/output/spike_callback.hpp"
#include "realtime/queues/bounded_queue.hpp"
#include "realtime/threads/spinning_team.hpp"
#include "tests/realtime/memory_probe.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

/// A device that never sends anything.
class SilentProbe final : public Probe {
 public:
  SilentProbe() { info_.uri = "silent:"; }
  [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override { return {&info_, 1}; }
  Expected<std::size_t, ProbeError> read(Readings& readings, milliseconds patience) override {
    readings.clear();
    std::this_thread::sleep_for(patience);
    return 0;
  }

 private:
  ProbeInfo info_;
};

/// Stores what it receives; fails after `limit` spikes.
class MemorySink final : public Sink {
 public:
  struct Content {
    std::vector<SpikeEvent> spikes;
    bool closed = false;
  };
  explicit MemorySink(Content& content, std::size_t limit = SIZE_MAX)
      : content_(content), limit_(limit) {}
  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  Expected<void, SinkError> write(const RecordBatch& batch) override {
    for (const SpikeEvent& spike : batch.spikes) {
      if (content_.spikes.size() == limit_) return Unexpected<SinkError>({"memory is full"});
      content_.spikes.push_back(spike);
    }
    return {};
  }
  Expected<void, SinkError> close() override {
    content_.closed = true;
    return {};
  }
  [[nodiscard]] std::uint64_t delivered() const noexcept override { return content_.spikes.size(); }

 private:
  Content& content_;
  std::size_t limit_;
  std::string uri_ = "memory:";
};

/// A press of 1.5 mm that comes and goes twice.
std::vector<ProbeSample> press(int ms = 600) {
  std::vector<ProbeSample> samples;
  for (int k = 0; k <= ms; ++k) {
    samples.push_back({.time = milliseconds{k},
                       .depth_mm = (k / 150) % 2 == 1 ? 1.5 : -0.1,
                       .channels = ProbeSample::kDepth});
  }
  return samples;
}

struct PipelineOutcome {
  RunReport report;
  std::vector<SpikeEvent> spikes;
  bool closed = false;
};

PipelineOutcome run(std::unique_ptr<Probe> probe, Pipeline::Parameters parameters = {.fast = true},
                    const TactileModel::Parameters& scene = {}, std::size_t sink_limit = SIZE_MAX) {
  auto model = TactileModel::create(scene);
  EXPECT_TRUE(model);
  Pipeline pipeline(*model, std::move(parameters));
  pipeline.add_probe(std::move(probe), {});
  MemorySink::Content content;
  pipeline.add_sink(std::make_unique<MemorySink>(content, sink_limit));
  auto report = pipeline.run();
  EXPECT_TRUE(report) << report.error().sentence;
  return {*report, content.spikes, content.closed};
}

TEST(Pipeline, ChunksOfAnySizeGiveTheSameSpikes) {
  const PipelineOutcome one = run(std::make_unique<MemoryProbe>(press(), 1));
  const PipelineOutcome seven = run(std::make_unique<MemoryProbe>(press(), 7));
  const PipelineOutcome thousand = run(std::make_unique<MemoryProbe>(press(), 1000));
  EXPECT_GT(one.spikes.size(), 30U);
  EXPECT_EQ(one.spikes, seven.spikes);
  EXPECT_EQ(one.spikes, thousand.spikes);
  EXPECT_TRUE(std::is_sorted(one.spikes.begin(), one.spikes.end()));
  EXPECT_TRUE(one.closed);
}

TEST(Pipeline, RealTimePacingGivesTheSpikesOfAFastRun) {
  const PipelineOutcome fast = run(std::make_unique<MemoryProbe>(press(400), 100));
  const PipelineOutcome paced =
      run(std::make_unique<MemoryProbe>(press(400), 100), {.fast = false});
  EXPECT_EQ(paced.spikes, fast.spikes);
  EXPECT_GE(paced.report.wall, milliseconds{399});  // the wall clock starts after the loop's
  EXPECT_EQ(paced.report.probes[0].counts.late, 0U);
}

TEST(Pipeline, AShorterTickGivesTheSameNeuronsAndCounts) {
  TactileModel::Parameters scene;
  scene.tick = std::chrono::microseconds{250};
  const PipelineOutcome fine =
      run(std::make_unique<MemoryProbe>(press(), 7), {.fast = true}, scene);
  const PipelineOutcome coarse = run(std::make_unique<MemoryProbe>(press(), 7));
  EXPECT_EQ(fine.report.spikes_of_neuron, coarse.report.spikes_of_neuron);
  EXPECT_EQ(fine.report.ticks, 4 * coarse.report.ticks);
}

TEST(Pipeline, CountersAddUp) {
  const PipelineOutcome outcome = run(std::make_unique<MemoryProbe>(press(), 7));
  const RunReport::ProbeReport& probe = outcome.report.probes[0];
  EXPECT_EQ(probe.samples_in, 601U);
  EXPECT_EQ(probe.samples_in, probe.counts.used + probe.counts.late + probe.dropped + probe.unused);
  const RunReport::OfSink& sink = outcome.report.sinks[0];
  EXPECT_EQ(sink.spikes_in, outcome.report.spikes);
  EXPECT_EQ(sink.spikes_in, sink.delivered + sink.dropped);
  std::uint64_t of_all_neurons = 0;
  for (const std::uint64_t count : outcome.report.spikes_of_neuron) of_all_neurons += count;
  EXPECT_EQ(of_all_neurons, outcome.report.spikes);
  EXPECT_TRUE(outcome.report.complete());
}

TEST(Pipeline, KeepsTheTimesOfTheRecording) {
  std::vector<ProbeSample> samples = press();
  for (ProbeSample& sample : samples) sample.time += std::chrono::hours{400'000};
  const PipelineOutcome late = run(std::make_unique<MemoryProbe>(samples, 7));
  const PipelineOutcome early = run(std::make_unique<MemoryProbe>(press(), 7));
  ASSERT_EQ(late.spikes.size(), early.spikes.size());
  for (std::size_t i = 0; i < late.spikes.size(); ++i) {
    EXPECT_EQ(late.spikes[i].time - std::chrono::hours{400'000}, early.spikes[i].time);
  }
}

TEST(Pipeline, DurationEndsTheRun) {
  const PipelineOutcome outcome =
      run(std::make_unique<MemoryProbe>(press(), 7), {.fast = true, .duration = milliseconds{250}});
  EXPECT_EQ(outcome.report.ticks, 250U);
  EXPECT_GT(outcome.report.probes[0].unused, 300U);
  EXPECT_TRUE(outcome.closed);
}

TEST(Pipeline, AFailingSinkIsNamedAndCountedAndTheRunContinues) {
  const PipelineOutcome outcome =
      run(std::make_unique<MemoryProbe>(press(), 7), {.fast = true}, {}, 5);
  EXPECT_EQ(outcome.report.ticks, 600U);
  EXPECT_EQ(outcome.report.sinks[0].error_message, "memory is full");
  EXPECT_EQ(outcome.report.sinks[0].delivered, 5U);
  EXPECT_FALSE(outcome.closed);
  EXPECT_FALSE(outcome.report.complete());
}

/// Has no memory for spikes, or for its end.
class GreedySink final : public Sink {
 public:
  explicit GreedySink(bool at_end) : at_end_(at_end) {}
  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  Expected<void, SinkError> write(const RecordBatch& batch) override {
    if (!at_end_ && !batch.spikes.empty()) throw std::bad_alloc();
    return {};
  }
  Expected<void, SinkError> close() override { throw std::bad_alloc(); }

 private:
  bool at_end_;
  std::string uri_ = "greedy:";
};

TEST(Pipeline, WithoutMemoryOnlyTheSinkFails) {
  auto model = TactileModel::create({});
  ASSERT_TRUE(model);
  Pipeline pipeline(*model, {.fast = true});
  pipeline.add_probe(std::make_unique<MemoryProbe>(press(), 7), {});
  MemorySink::Content whole;
  pipeline.add_sink(std::make_unique<GreedySink>(false));
  pipeline.add_sink(std::make_unique<GreedySink>(true));
  pipeline.add_sink(std::make_unique<MemorySink>(whole));
  const auto report = pipeline.run();
  ASSERT_TRUE(report);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(report->sinks[k].error_message,
              "greedy: failed: out of memory: raise the limit of memory (ulimit -v, MemoryMax of a "
              "service), and run again");
  }
  EXPECT_EQ(whole.spikes.size(), report->spikes);
  EXPECT_TRUE(whole.closed);
}

TEST(Pipeline, AFailingSinkIsReportedDuringTheRun) {
  auto model = TactileModel::create({});
  ASSERT_TRUE(model);
  std::vector<std::string> reported;
  std::atomic<bool> heard{false};
  Pipeline pipeline(
      *model, {.fast = true,
               .on_sink_failure = [&](const std::string& uri, const std::string& error_message) {
                 reported.push_back(uri + " " + error_message);
                 heard = true;
               }});
  auto probe = std::make_unique<MemoryProbe>(press(8000), 7);
  probe->wait_after(7000, [&heard] { return heard.load(); });  // or the run would already be over
  pipeline.add_probe(std::move(probe), {});
  MemorySink::Content broken;
  MemorySink::Content whole;
  pipeline.add_sink(std::make_unique<MemorySink>(broken, 0));
  pipeline.add_sink(std::make_unique<MemorySink>(whole));
  const auto report = pipeline.run();
  ASSERT_TRUE(report);
  EXPECT_EQ(reported, std::vector<std::string>{"memory: memory is full"});
  EXPECT_EQ(whole.spikes.size(), report->spikes);
  EXPECT_TRUE(whole.closed);
  EXPECT_FALSE(broken.closed);
}

/// Requests everything.
class CuriousSink final : public Sink {
 public:
  struct Content {
    std::uint64_t spikes = 0;
    std::vector<TickRecord> ticks;
    std::vector<LoopEvent> events;
    std::vector<ProbeSample> samples;
    RunStatus status;
    bool in_order = true;  ///< no spike arrived after its tick
  };
  CuriousSink(Content& content, std::uint32_t subscriptions)
      : content_(content), subscriptions_(subscriptions) {}
  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  [[nodiscard]] std::uint32_t subscriptions() const noexcept override { return subscriptions_; }
  Expected<void, SinkError> write(const RecordBatch& batch) override {
    content_.spikes += batch.spikes.size();
    for (const SpikeEvent& spike : batch.spikes) {
      if (!content_.ticks.empty() && spike.time <= content_.ticks.back().time) {
        content_.in_order = false;
      }
    }
    content_.ticks.insert(content_.ticks.end(), batch.ticks.begin(), batch.ticks.end());
    content_.events.insert(content_.events.end(), batch.events.begin(), batch.events.end());
    for (const DeliveredSample& item : batch.samples) content_.samples.push_back(item.sample);
    if (!batch.status.empty()) content_.status = batch.status.back();
    return {};
  }
  Expected<void, SinkError> close() override { return {}; }
  [[nodiscard]] std::uint64_t delivered() const noexcept override { return content_.spikes; }

 private:
  Content& content_;
  std::uint32_t subscriptions_;
  std::string uri_ = "curious:";
};

TEST(Pipeline, ASinkReceivesOnlyWhatItRequested) {
  auto model = TactileModel::create({});
  ASSERT_TRUE(model);
  Pipeline pipeline(*model, {.fast = true});
  auto samples = press(6000);
  samples.erase(samples.begin() + 300, samples.begin() + 500);  // an outage
  pipeline.add_probe(std::make_unique<MemoryProbe>(samples, 7), {.stale_after = milliseconds{50}});
  CuriousSink::Content all;
  CuriousSink::Content nothing;
  pipeline.add_sink(std::make_unique<CuriousSink>(
      all, kKinds<SpikeEvent, TickRecord, LoopEvent, DeliveredSample, RunStatus>));
  pipeline.add_sink(std::make_unique<CuriousSink>(nothing, kKinds<SpikeEvent>));
  const auto report = pipeline.run();
  ASSERT_TRUE(report);
  EXPECT_TRUE(all.in_order);
  EXPECT_EQ(all.spikes, report->spikes);
  ASSERT_EQ(all.ticks.size(), report->ticks);
  for (std::size_t k = 0; k < all.ticks.size(); ++k) {
    EXPECT_EQ(all.ticks[k].number, k + 1);
    EXPECT_EQ(all.ticks[k].time, milliseconds{k + 1});
  }
  EXPECT_EQ(all.ticks[350].state, TickRecord::State::kReleased);
  ASSERT_EQ(all.events.size(), 2U);
  EXPECT_EQ(all.events[0].kind, LoopEvent::Kind::kRelease);
  EXPECT_EQ(all.events[1].kind, LoopEvent::Kind::kResume);
  ASSERT_EQ(all.samples.size(), samples.size());
  EXPECT_EQ(all.samples.back().time, samples.back().time);
  EXPECT_EQ(all.status.counters.ticks, report->ticks);
  EXPECT_EQ(all.status.counters.samples, samples.size());
  EXPECT_EQ(all.status.losses, RunStatus::Losses{});

  EXPECT_EQ(nothing.spikes, report->spikes);
  EXPECT_TRUE(nothing.ticks.empty());
  EXPECT_TRUE(nothing.events.empty());
  EXPECT_TRUE(nothing.samples.empty());
  EXPECT_EQ(nothing.status.counters.ticks, 0U);
}

TEST(Pipeline, TheRunsCountersContainThoseOfItsDevices) {
  TactileModel::Parameters scene;
  scene.indenters = {Indenter{}, Indenter{}};
  auto model = TactileModel::create(scene);
  Pipeline pipeline(*model, {.fast = true});
  for (const std::uint64_t value : {100U, 1000U}) {
    auto probe = std::make_unique<MemoryProbe>(press(200), 7);
    DeviceCounts counts;
    for (const auto& field : kDeviceCounterFields<>) counts.*field.cell = value;
    probe->counts(counts);
    pipeline.add_probe(std::move(probe), {});
  }
  CuriousSink::Content content;
  pipeline.add_sink(std::make_unique<CuriousSink>(content, kKinds<SpikeEvent, RunStatus>));
  const auto report = pipeline.run();
  ASSERT_TRUE(report);
  for (const RunCounters& counters : {content.status.counters, RunCounters{*report}}) {
    EXPECT_EQ(counters.refused, 1100U);
    EXPECT_EQ(counters.saturated, 1100U);
    EXPECT_EQ(counters.damaged, 1100U);
    EXPECT_EQ(counters.outage_ns, 1100U);
    EXPECT_EQ(counters.largest_batch, 1000U);
  }
}

TEST(Pipeline, ACallbackReceivesEverySpikeOnItsOwnThread) {
  auto model = TactileModel::create({});
  Pipeline pipeline(*model, {.fast = true});
  pipeline.add_probe(std::make_unique<MemoryProbe>(press(), 7), {});
  std::uint64_t spikes = 0;
  std::thread::id thread;
  pipeline.add_sink(
      std::make_unique<SpikeCallback>("my encoder", [&](std::span<const SpikeEvent> some) {
        spikes += some.size();
        thread = std::this_thread::get_id();
      }));
  const auto report = pipeline.run();
  ASSERT_TRUE(report);
  EXPECT_GT(spikes, 30U);
  EXPECT_EQ(spikes, report->spikes);
  EXPECT_EQ(report->sinks[0].uri, "my encoder");
  EXPECT_EQ(report->sinks[0].delivered, spikes);
  EXPECT_TRUE(thread != std::this_thread::get_id());
}

TEST(Pipeline, BadDataEndsTheRunAndLeavesTheSinkUnfinished) {
  const PipelineOutcome outcome =
      run(std::make_unique<MemoryProbe>(press(300), 7, "trace.csv:5: nonsense"));
  EXPECT_EQ(outcome.report.error_message, "trace.csv:5: nonsense");
  EXPECT_GT(outcome.spikes.size(), 0U);
  EXPECT_FALSE(outcome.closed);
}

TEST(Pipeline, ProbesShareOneTimeBase) {
  TactileModel::Parameters scene;
  scene.indenters = {Indenter{}, Indenter{}};
  auto model = TactileModel::create(scene);
  ASSERT_TRUE(model);
  Pipeline pipeline(*model, {.fast = true});
  std::vector<ProbeSample> later = press(200);
  for (ProbeSample& sample : later) sample.time += milliseconds{300};
  pipeline.add_probe(std::make_unique<MemoryProbe>(press(600), 3), {.x_mm = 9.0, .y_mm = 7.5});
  pipeline.add_probe(std::make_unique<MemoryProbe>(later, 50), {.x_mm = 21.0, .y_mm = 12.5});
  const auto report = pipeline.run();
  ASSERT_TRUE(report);
  EXPECT_EQ(report->ticks, 600U);
  EXPECT_EQ(report->probes[0].counts.used, 601U);
  EXPECT_EQ(report->probes[1].counts.used, 201U);
  EXPECT_GT(report->spikes_of_neuron[6], 0U);
  EXPECT_GT(report->spikes_of_neuron[13], 0U);
}

TEST(Pipeline, WhatASinkReportsAtItsEndReachesTheUser) {
  class LastWordSink final : public Sink {
   public:
    [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
    void attach(RunControl& control) override { control_ = &control; }
    Expected<void, SinkError> write(const RecordBatch& /*batch*/) override { return {}; }
    Expected<void, SinkError> close() override {
      control_->notice("the last word");
      return {};
    }

   private:
    std::string uri_ = "last:";
    RunControl* control_ = nullptr;
  };
  auto model = TactileModel::create({});
  ASSERT_TRUE(model);
  std::vector<std::string> notices;
  Pipeline pipeline(*model, {.fast = true, .on_notice = [&](const std::string& notice) {
                               notices.push_back(notice);
                             }});
  pipeline.add_probe(std::make_unique<MemoryProbe>(press(100), 7), {});
  pipeline.add_sink(std::make_unique<LastWordSink>());
  ASSERT_TRUE(pipeline.run());
  EXPECT_EQ(notices, std::vector<std::string>{"the last word"});
}

TEST(Pipeline, ALiveProbeServesEveryKindOfConsumerAtOnce) {
  // A failing sink, a sink that hangs for a while, a working sink, a polling consumer, a team of
  // threads, timings, events and progress do not disturb each other.
  class StuckSink final : public Sink {
   public:
    [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
    Expected<void, SinkError> write(const RecordBatch& batch) override {
      std::this_thread::sleep_for(milliseconds{300});
      delivered_ += batch.spikes.size();
      return {};
    }
    Expected<void, SinkError> close() override { return {}; }
    [[nodiscard]] std::uint64_t delivered() const noexcept override { return delivered_; }

   private:
    std::string uri_ = "stuck:";
    std::uint64_t delivered_ = 0;
  };
  auto model = TactileModel::create({});
  const auto team = SpinningTeam::create(2, {}, 2);
  (*model).share_work(team->get());
  BoundedQueue<TickTiming> timings(10'000);
  RunProgress last;
  Pipeline* running = nullptr;
  // The run ends when it has shown everything, however long a loaded machine needs for it.
  const auto on_progress = [&](const RunProgress& progress) {
    last = progress;
    if (progress.counters.spikes > 30 && timings.front() != nullptr) running->request_stop();
  };
  Pipeline pipeline(*model, {.realtime = {.priority = 5},
                             .team = team->get(),
                             .timings = &timings,
                             .on_progress = on_progress});
  running = &pipeline;
  pipeline.add_probe(std::move(*open_probe("sim:sine?depth_mm=1.5&hold_s=60&live=1")), {});
  MemorySink::Content failing;
  MemorySink::Content working;
  pipeline.add_sink(std::make_unique<MemorySink>(failing, 3));
  pipeline.add_sink(std::make_unique<MemorySink>(working));
  pipeline.add_sink(std::make_unique<StuckSink>());
  SpikeConsumer consumer = pipeline.add_consumer(10'000);
  std::vector<SpikeEvent> polled;
  std::jthread poller([&polled, &consumer] {
    SpikeEvent spike;
    for (bool ended = false; !ended; consumer.wait()) {
      ended = consumer.ended();
      while (consumer.try_pop(spike)) polled.push_back(spike);
    }
  });
  const auto report = pipeline.run();
  ASSERT_TRUE(report);
  poller.join();
  EXPECT_GT(report->spikes, 30U);
  EXPECT_EQ(polled.size(), report->spikes);
  EXPECT_EQ(working.spikes, polled);
  EXPECT_EQ(report->sinks[0].delivered, 3U);
  EXPECT_EQ(report->sinks[1].delivered, report->spikes);
  EXPECT_EQ(report->sinks[2].delivered, report->spikes);
  EXPECT_GT(last.counters.samples, 0U);
  EXPECT_GT(last.counters.ticks, 0U);
  EXPECT_LE(last.counters.ticks, report->ticks);
  EXPECT_EQ(last.counters.demotions, 0U);
  const RunReport::ProbeReport& probe = report->probes[0];
  EXPECT_EQ(probe.samples_in, probe.counts.used + probe.counts.late + probe.dropped + probe.unused);
  ASSERT_TRUE(report->host_time);
  EXPECT_EQ(report->host_time->tick.count, report->ticks);
  EXPECT_EQ(report->host_time->rights.missing.empty(),
            report->host_time->rights.fifo && report->host_time->rights.memory_locked &&
                report->host_time->rights.cpu_awake);
  TickTiming timing;
  nanoseconds before{0};
  for (; timings.try_pop(timing); before = timing.published) {
    EXPECT_LE(before, timing.started);
    EXPECT_LE(timing.started, timing.computed);
    EXPECT_LE(timing.computed, timing.published);
  }
  EXPECT_GT(before, nanoseconds{0});
}

TEST(Pipeline, ASilentDeviceIsRefusedWithARemedy) {
  auto model = TactileModel::create({});
  Pipeline pipeline(*model, {});
  pipeline.add_probe(std::make_unique<SilentProbe>(), {});
  const auto report = pipeline.run();
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().sentence,
            "the probe silent: has sent nothing for 2 s: check that it is switched on and "
            "streaming");
}

TEST(Pipeline, AfterARefusedStartNoProbeIsReadWhileItsSinksEnd) {
  // The reader of the first probe fills the sink's tap until the pipeline ends.
  static std::atomic<bool> sink_gone;
  static std::atomic<int> reads_without_sink;
  sink_gone = false;
  reads_without_sink = 0;
  class TalkingProbe final : public Probe {
   public:
    TalkingProbe() { info_.channels = ProbeSample::kDepth; }
    [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override {
      return {&info_, 1};
    }
    Expected<std::size_t, ProbeError> read(Readings& readings, milliseconds) override {
      readings.clear();
      if (sink_gone) ++reads_without_sink;
      std::this_thread::sleep_for(milliseconds{1});
      time_ += milliseconds{1};
      readings.add_sample({.time = time_, .channels = ProbeSample::kDepth});
      return 1;
    }

   private:
    ProbeInfo info_;
    nanoseconds time_{0};
  };
  class SampleSink final : public Sink {
   public:
    ~SampleSink() override {
      sink_gone = true;
      std::this_thread::sleep_for(milliseconds{50});
    }
    [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
    [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
      return kKinds<SpikeEvent, DeliveredSample>;
    }
    Expected<void, SinkError> write(const RecordBatch&) override { return {}; }
    Expected<void, SinkError> close() override { return {}; }

   private:
    std::string uri_ = "samples:";
  };
  TactileModel::Parameters scene;
  scene.indenters = {Indenter{}, Indenter{}};
  auto model = TactileModel::create(scene);
  {
    Pipeline pipeline(*model, {});
    pipeline.add_probe(std::make_unique<TalkingProbe>(), {});
    pipeline.add_probe(std::make_unique<SilentProbe>(), {});
    pipeline.add_sink(std::make_unique<SampleSink>());
    EXPECT_FALSE(pipeline.run());
  }
  EXPECT_TRUE(sink_gone);
  EXPECT_EQ(reads_without_sink, 0);
}

TEST(Pipeline, ADeviceCannotRunFast) {
  auto model = TactileModel::create({});
  Pipeline pipeline(*model, {.fast = true});
  pipeline.add_probe(std::make_unique<SilentProbe>(), {});
  EXPECT_NE(pipeline.run().error().sentence.find("remove --fast"), std::string::npos);
}

TEST(Pipeline, NeedsOneProbePerIndenter) {
  auto model = TactileModel::create({});
  Pipeline pipeline(*model, {.fast = true});
  EXPECT_NE(pipeline.run().error().sentence.find("1 indenters, but 0 probes"), std::string::npos);
}

}  // namespace
}  // namespace merkel
