#include "drivers/sessions/session_reader.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <set>
#include <string_view>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "drivers/probes/open_probe.hpp"
#include "drivers/sessions/xdf_file.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "drivers/sinks/recording_switch.hpp"
#include "tests/temporary_folder.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;
constexpr nanoseconds kLongAgo{-123'456'789'012'345'678};

/// The whole content of a session.
struct Everything {
  std::vector<SpikeEvent> spikes;
  std::vector<TickRecord> ticks;
  std::vector<DeliveredSample> samples;
  std::vector<LoopEvent> events;
  std::vector<RunStatus> status;
  std::vector<PortFrame> frames;
  std::vector<Mark> marks;
  std::vector<StimulationCommand> commands;
  std::vector<SentCommand> sent;
  bool complete = false;
  std::string error;
};

template <class T>
void append(std::vector<T>& all, const std::vector<T>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

Everything read_all(const std::string& path) {
  Everything all;
  auto session = SessionReader::open(path);
  if (!session) {
    all.error = session.error().sentence;
    return all;
  }
  SessionChunk chunk;
  for (;;) {
    const auto more = session->next(chunk);
    if (!more) {
      all.error = more.error().sentence;
      return all;
    }
    if (!*more) break;
    append(all.spikes, chunk.spikes);
    append(all.ticks, chunk.ticks);
    append(all.samples, chunk.samples);
    append(all.events, chunk.events);
    append(all.status, chunk.status);
    append(all.frames, chunk.frames);
    append(all.marks, chunk.marks);
    append(all.commands, chunk.commands);
    append(all.sent, chunk.sent);
  }
  all.complete = session->complete();
  return all;
}

const std::array<SpikeEvent, 2> kSpikes = {
    SpikeEvent{.time = kLongAgo, .neuron = 8, .patch = 0, .flags = SpikeEvent::kInputHeld},
    SpikeEvent{.time = nanoseconds{2'000'000'001}, .neuron = 13}};
const std::array<TickRecord, 2> kTicks = {
    TickRecord{.time = kLongAgo,
               .latency = nanoseconds{81'234},
               .contact = {.depth_mm = 0.1, .force_mN = -1e-300, .x_mm = 1.0 / 3.0, .y_mm = 10.0},
               .number = 1,
               .probe = 0,
               .late = 3,
               .state = TickRecord::State::kHeld},
    TickRecord{.time = kLongAgo + std::chrono::milliseconds{1},
               .number = 2,
               .state = TickRecord::State::kReleased}};
const std::array<LoopEvent, 1> kEvents = {LoopEvent{.time = nanoseconds{5},
                                                    .length = nanoseconds{7'000'000},
                                                    .subject = 0,
                                                    .kind = LoopEvent::Kind::kGap}};
const std::array<ProbeSample, 1> kSamples = {ProbeSample{.time = nanoseconds{1'600'000'001},
                                                         .arrival = nanoseconds{1'600'000'999},
                                                         .depth_mm = 0.7,
                                                         .sequence = 4'000'000'000,
                                                         .channels = ProbeSample::kDepth}};

const std::array<RawFrame, 2> kFrames = {
    RawFrame{.time = kLongAgo,
             .parsed = 2,
             .damaged = 1,
             .lost = 4'000'000'000,
             .kind = RawFrame::Kind::kReceived,
             .length = 64,
             .bytes = {0xFF, 0x00, 0x80, 0x0A, 0x7F, 0xFF, 0xFF, 0xFF, 0xFE}},
    RawFrame{.time = nanoseconds{3}, .kind = RawFrame::Kind::kStarted}};
constexpr RunStatus::Rights kRights = {.scheduling_class = 1,
                                       .priority = 70,
                                       .cpu = -1,
                                       .locked_memory_kB = 123'456,
                                       .timer_slack_ns = 0,
                                       .cpu_awake = 0};

const std::array<StimulationCommand, 3> kCommands = {
    StimulationCommand{.time = nanoseconds{1'000'250'001},
                       .amplitude_uA = 60.0,
                       .heartbeat = 4,
                       .electrode = 1,
                       .kind = StimulationCommand::Kind::kPulse},
    StimulationCommand{.time = nanoseconds{1'001'000'000},
                       .amplitude_uA = 1.0 / 3.0,
                       .frequency_Hz = 55.5,
                       .heartbeat = 5},
    StimulationCommand{.time = nanoseconds{1'001'000'000},
                       .heartbeat = 5,
                       .electrode = 1,
                       .stop = StimulationCommand::Stop::kGap}};

const std::array<SentCommand, 2> kSent = {
    SentCommand{.command = kCommands[1],
                .sent = nanoseconds{9'200'000'000'123'456'789 / 100},
                .valid_until = nanoseconds{9'200'000'060'123'456'789 / 100}},
    SentCommand{.command = kCommands[2], .sent = nanoseconds{1}, .refused_by = 3}};

/// Two probes, of which one measures less.
std::vector<ProbeInfo> two_probes() {
  std::vector<ProbeInfo> probes(2);
  probes[0].channels = ProbeSample::kDepth | ProbeSample::kForce;
  probes[1].channels = ProbeSample::kDepth;
  probes[1].extra_columns = {"humidity", "time_ns"};
  return probes;
}

/// A session with one chunk of each kind. \param closed  true if properly closed
std::string record(const TemporaryFolder& folder, bool closed) {
  const std::string path = folder.path(closed ? "closed.xdf" : "open.xdf");
  auto sink = open_sink("xdf:" + path + "?frames=1",
                        SinkSetup{.neurons = 20,
                                  .overwrite = false,
                                  .allow_remote = false,
                                  .run = {.scene = "a <b> & \"c\"",
                                          .facts = {{"scene_text", "[skin]\n# ]]> \t <é>\n"}},
                                          .model = {},
                                          .probes = two_probes()}});
  EXPECT_TRUE(sink) << sink.error().sentence;
  EXPECT_TRUE((*sink)->write({.spikes = kSpikes}));
  EXPECT_TRUE((*sink)->write({.commands = kCommands, .sent = kSent}));
  EXPECT_TRUE((*sink)->write({.ticks = kTicks}));
  EXPECT_TRUE((*sink)->write({.events = kEvents}));
  std::vector<DeliveredSample> samples;
  for (const ProbeSample& sample : kSamples) samples.push_back({.probe = 1, .sample = sample});
  EXPECT_TRUE((*sink)->write({.samples = samples}));
  const RunStatus status{.counters = {.ticks = 2, .demotions = 1},
                         .losses = {.spikes = 9, .frames = 8},
                         .rights = kRights};
  EXPECT_TRUE((*sink)->write({.status = {&status, 1}}));
  std::vector<PortFrame> frames;
  for (const RawFrame& frame : kFrames) frames.push_back({.probe = 1, .port = 2, .frame = frame});
  EXPECT_TRUE((*sink)->write({.frames = frames}));
  const std::array<Mark, 2> marks = {
      Mark{.time = nanoseconds{1'500'000'000}, .label = "trial 1, Müller"},
      Mark{.time = nanoseconds{2'000'000'000}, .label = ""}};
  EXPECT_TRUE((*sink)->write({.marks = marks}));
  EXPECT_EQ((*sink)->delivered(), 0U);
  EXPECT_TRUE((*sink)->flush());
  EXPECT_EQ((*sink)->delivered(), 2U);
  if (!closed) return path + ".part";
  EXPECT_TRUE((*sink)->close());
  return path;
}

void expect_same(const TickRecord& a, const TickRecord& b) {
  EXPECT_EQ(a.time, b.time);
  EXPECT_EQ(a.latency, b.latency);
  EXPECT_EQ(a.contact, b.contact);
  EXPECT_EQ(a.number, b.number);
  EXPECT_EQ(a.probe, b.probe);
  EXPECT_EQ(a.late, b.late);
  EXPECT_EQ(a.state, b.state);
}

TEST(SessionReader, GivesBackEveryBitThatWasRecorded) {
  const TemporaryFolder folder;
  const std::string path = record(folder, true);
  const auto session = SessionReader::open(path);
  ASSERT_TRUE(session) << session.error().sentence;
  EXPECT_EQ(session->fact("scene"), "a <b> & \"c\"");
  EXPECT_EQ(session->fact("scene_text"), "[skin]\n# ]]> \t <é>\n");
  EXPECT_EQ(session->fact("nothing"), "");

  const Everything all = read_all(path);
  EXPECT_EQ(all.error, "");
  EXPECT_TRUE(all.complete);
  ASSERT_EQ(all.spikes.size(), 2U);
  EXPECT_EQ(all.spikes[0], kSpikes[0]);
  EXPECT_EQ(all.spikes[1], kSpikes[1]);
  ASSERT_EQ(all.ticks.size(), 2U);
  expect_same(all.ticks[0], kTicks[0]);
  expect_same(all.ticks[1], kTicks[1]);
  ASSERT_EQ(all.events.size(), 1U);
  EXPECT_EQ(all.events[0], kEvents[0]);
  ASSERT_EQ(all.commands.size(), kCommands.size());
  for (std::size_t i = 0; i < kCommands.size(); ++i) EXPECT_EQ(all.commands[i], kCommands[i]);
  ASSERT_EQ(all.sent.size(), kSent.size());
  for (std::size_t i = 0; i < kSent.size(); ++i) EXPECT_EQ(all.sent[i], kSent[i]);
  ASSERT_EQ(all.marks.size(), 2U);
  EXPECT_EQ(all.marks[0].time, nanoseconds{1'500'000'000});
  EXPECT_EQ(all.marks[0].label, "trial 1, Müller");
  EXPECT_EQ(all.marks[1].label, "");
  ASSERT_EQ(all.samples.size(), 1U);
  EXPECT_EQ(all.samples[0].probe, 1U);
  EXPECT_EQ(all.samples[0].sample.time, kSamples[0].time);
  EXPECT_EQ(all.samples[0].sample.arrival, kSamples[0].arrival);
  EXPECT_EQ(all.samples[0].sample.depth_mm, 0.7);
  EXPECT_EQ(all.samples[0].sample.sequence, 4'000'000'000);
  ASSERT_EQ(all.status.size(), 1U);
  EXPECT_EQ(all.status[0].counters.ticks, 2U);
  EXPECT_EQ(all.status[0].losses.spikes, 9U);
  EXPECT_EQ(all.status[0].losses.frames, 8U);
  EXPECT_EQ(all.status[0].rights, kRights);
  ASSERT_EQ(all.frames.size(), 2U);
  EXPECT_EQ(all.frames[0].probe, 1U);
  EXPECT_EQ(all.frames[0].port, 2U);
  EXPECT_EQ(all.frames[0].frame, kFrames[0]);
  EXPECT_EQ(all.frames[1].frame, kFrames[1]);
}

/// Ticks of two probes, as the loop publishes them: with a gap, a late sample, a release and a lost
/// record.
std::vector<TickRecord> ticks_of_two_probes() {
  std::vector<TickRecord> ticks;
  for (std::uint64_t number = 1; number <= 50; ++number) {
    for (std::uint32_t probe = 0; probe < 2; ++probe) {
      if (number == 40 && probe == 1) continue;
      const double phase = 0.1 * static_cast<double>(number);
      ticks.push_back(
          {.time = std::chrono::seconds{77} + std::chrono::milliseconds{number} +
                   std::chrono::milliseconds{number > 20 ? 33 : 0},
           .latency = nanoseconds{static_cast<std::int64_t>(number * 17 + probe)},
           .delay = nanoseconds{2'000'000},
           .contact = {.depth_mm = std::sin(phase),
                       .force_mN = number == 11 && probe == 1 ? -0.0 : 0.0,
                       .x_mm = 15.0,
                       .y_mm = probe == 0 ? 10.0 : 1.0 / 3.0},
           .number = number,
           .probe = probe,
           .late = static_cast<std::uint16_t>(number == 7 ? 2 : 0),
           .state = number > 30 ? TickRecord::State::kReleased : TickRecord::State::kFollowing});
    }
  }
  return ticks;
}

TEST(SessionReader, TicksOfSeveralProbesComeInTheirOrderToTheBit) {
  const TemporaryFolder folder;
  const std::string path = folder.path("two.xdf");
  const auto ticks = ticks_of_two_probes();
  auto sink = open_sink("xdf:" + path,
                        SinkSetup{.neurons = 20,
                                  .overwrite = false,
                                  .allow_remote = false,
                                  .run = {.scene = "a",
                                          .facts = {{"scene_text", "a"}, {"tick_ns", "1000000"}},
                                          .model = {},
                                          .probes = two_probes()}});
  ASSERT_TRUE(sink) << sink.error().sentence;
  // Cut within a tick: its records are in different chunks.
  ASSERT_TRUE((*sink)->write({.ticks = std::span(ticks).first(31)}));
  ASSERT_TRUE((*sink)->flush());
  ASSERT_TRUE((*sink)->write({.ticks = std::span(ticks).subspan(31)}));
  ASSERT_TRUE((*sink)->close());
  const Everything all = read_all(path);
  EXPECT_EQ(all.error, "");
  ASSERT_EQ(all.ticks.size(), ticks.size());
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    expect_same(all.ticks[i], ticks[i]);
    EXPECT_EQ(all.ticks[i].delay, ticks[i].delay);
    EXPECT_EQ(std::signbit(all.ticks[i].contact.force_mN), std::signbit(ticks[i].contact.force_mN))
        << i;
  }
  // Wherever a file was cut, it ends with a whole tick, or lacks one record of it.
  const std::string whole = read_file(path);
  for (std::size_t bytes = whole.size() / 2; bytes < whole.size(); bytes += 23) {
    const Everything cut = read_all(folder.file("cut.xdf", whole.substr(0, bytes)));
    if (!cut.error.empty() || cut.ticks.empty()) continue;
    const auto of_first = std::count_if(cut.ticks.begin(), cut.ticks.end(),
                                        [](const TickRecord& tick) { return tick.probe == 0; });
    const std::ptrdiff_t others = static_cast<std::ptrdiff_t>(cut.ticks.size()) - of_first;
    const std::ptrdiff_t lost = cut.ticks.back().number >= 40 ? 1 : 0;
    EXPECT_LE(of_first - others, 1 + lost) << bytes;
  }
}

TEST(SessionReader, ItsSamplesAreReplayedAsAProbe) {
  const TemporaryFolder folder;
  const std::string path = record(folder, true);
  auto probe = open_probe("replay:" + path + "?probe=1");
  ASSERT_TRUE(probe) << probe.error().sentence;
  std::vector<ProbeSample> samples(10);
  const auto count = (*probe)->read(samples, std::chrono::milliseconds{100});
  ASSERT_TRUE(count);
  ASSERT_EQ(*count, kSamples.size());
  EXPECT_EQ(samples[0].depth_mm, kSamples[0].depth_mm);
  const auto other = open_probe("replay:" + path + "?probe=0");
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().sentence.find("no samples of probe 0"), std::string::npos);

  const std::string both = folder.path("both.xdf");
  auto sink = open_sink("xdf:" + both, SinkSetup{.neurons = 20,
                                                 .overwrite = false,
                                                 .allow_remote = false,
                                                 .run = {.scene = "a",
                                                         .facts = {{"scene_text", "a"}},
                                                         .model = {},
                                                         .probes = two_probes()}});
  ASSERT_TRUE(sink) << sink.error().sentence;
  std::vector<DeliveredSample> mixed;
  for (std::uint32_t k = 0; k < 8; ++k) {
    ProbeSample sample = kSamples[0];
    sample.time += std::chrono::milliseconds{k};
    sample.depth_mm = k;
    mixed.push_back({.probe = k % 2, .sample = sample});
  }
  ASSERT_TRUE((*sink)->write({.samples = mixed}));
  ASSERT_TRUE((*sink)->close());
  for (const std::uint32_t number : {0U, 1U}) {
    auto one = open_probe("replay:" + both + "?probe=" + std::to_string(number));
    ASSERT_TRUE(one) << one.error().sentence;
    const auto read = (*one)->read(samples, std::chrono::milliseconds{100});
    ASSERT_TRUE(read);
    ASSERT_EQ(*read, 4U);
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_EQ(samples[k].depth_mm, static_cast<double>(2 * k + number));
  }
}

// A reader that finds damage goes on at the next boundary; offsets show how two clocks run apart.
TEST(SessionReader, BoundariesAndClockOffsetsComeNowAndThen) {
  const TemporaryFolder folder;
  const std::string path = folder.path("long.xdf");
  auto sink = open_sink("xdf:" + path, SinkSetup{.neurons = 20,
                                                 .overwrite = false,
                                                 .allow_remote = false,
                                                 .run = {.scene = "a",
                                                         .facts = {{"scene_text", "a"}},
                                                         .model = {},
                                                         .probes = two_probes()}});
  ASSERT_TRUE(sink) << sink.error().sentence;
  for (int k = 0; k < 120; ++k) {
    const SpikeEvent spike{.time = nanoseconds{1'000'000 * k}, .neuron = 1};
    ASSERT_TRUE((*sink)->write({.spikes = {&spike, 1}}));
    ASSERT_TRUE((*sink)->flush());
  }
  ASSERT_TRUE((*sink)->close());
  auto file = XdfFile::open(path);
  ASSERT_TRUE(file);
  std::map<XdfTag, int> chunks;
  for (XdfChunk chunk;;) {
    const auto more = file->next(chunk);
    ASSERT_TRUE(more);
    if (!*more) break;
    ++chunks[chunk.tag];
  }
  EXPECT_EQ(chunks[XdfTag::kBoundary], 2);
  EXPECT_EQ(chunks[XdfTag::kClockOffset], 6 * chunks[XdfTag::kStreamHeader]);
}

TEST(SessionReader, WhoeverHasATickHasEverythingElseOfIt) {
  const TemporaryFolder folder;
  const std::string path = folder.path("order.xdf");
  auto sink = open_sink("xdf:" + path, SinkSetup{.neurons = 20,
                                                 .overwrite = false,
                                                 .allow_remote = false,
                                                 .run = {.scene = "a",
                                                         .facts = {{"scene_text", "a"}},
                                                         .model = {},
                                                         .probes = two_probes()}});
  ASSERT_TRUE(sink) << sink.error().sentence;
  const Mark mark{.time = nanoseconds{1}, .label = "a"};
  ASSERT_TRUE((*sink)->write(
      {.spikes = kSpikes, .commands = kCommands, .ticks = kTicks, .events = kEvents}));
  ASSERT_TRUE((*sink)->write({.marks = {&mark, 1}}));
  ASSERT_TRUE((*sink)->close());
  auto session = SessionReader::open(path);
  ASSERT_TRUE(session) << session.error().sentence;
  std::size_t others = 0;
  SessionChunk chunk;
  while (session->next(chunk).value_or(false) && chunk.ticks.empty()) others += count_of(chunk);
  EXPECT_EQ(others, kSpikes.size() + kCommands.size() + kEvents.size() + 1);
  EXPECT_EQ(chunk.ticks.size(), kTicks.size());
}

TEST(SessionReader, SamplesOfEachProbeHaveItsOwnColumns) {
  const TemporaryFolder folder;
  const std::string path = folder.path("columns.xdf");
  auto sink = open_sink("xdf:" + path, SinkSetup{.neurons = 20,
                                                 .overwrite = false,
                                                 .allow_remote = false,
                                                 .run = {.scene = "a",
                                                         .facts = {{"scene_text", "a"}},
                                                         .model = {},
                                                         .probes = two_probes()}});
  ASSERT_TRUE(sink) << sink.error().sentence;
  std::vector<DeliveredSample> samples;
  for (std::uint32_t i = 0; i < 10; ++i) {
    ProbeSample sample = kSamples[0];
    sample.time += std::chrono::milliseconds{i};
    sample.sequence = i < 5 ? i : i + 3;  // three were lost
    sample.valid_for = std::chrono::milliseconds{50};
    samples.push_back({.probe = i % 2, .sample = sample, .further = {0.25 * i, -7.0}});
  }
  ASSERT_TRUE((*sink)->write({.samples = samples}));
  ASSERT_TRUE((*sink)->close());
  const auto session = SessionReader::open(path);
  ASSERT_TRUE(session) << session.error().sentence;
  EXPECT_EQ(session->extra_columns(), (std::vector<std::string>{"humidity", "column_time_ns"}));
  EXPECT_TRUE(session->has_validity());
  const Everything all = read_all(path);
  ASSERT_EQ(all.samples.size(), samples.size());
  for (const DeliveredSample& each : samples) {
    const auto found =
        std::find_if(all.samples.begin(), all.samples.end(), [&](const DeliveredSample& read) {
          return read.probe == each.probe && read.sample.time == each.sample.time;
        });
    ASSERT_NE(found, all.samples.end());
    EXPECT_EQ(found->sample.sequence, each.sample.sequence);
    EXPECT_EQ(found->sample.channels, each.sample.channels);
    EXPECT_EQ(found->sample.valid_for, each.sample.valid_for);
    EXPECT_EQ(found->sample.arrival, each.sample.arrival);
    if (each.probe == 1) {
      EXPECT_EQ(found->further, each.further);
    } else {
      EXPECT_TRUE(std::isnan(found->further[0]));
    }
  }
}

/// Other readers of XML refuse the whole file for one such byte.
TEST(SessionFormat, HeadersHoldNoBytesThatXmlForbids) {
  const TemporaryFolder folder;
  const std::string path = folder.path("latin.xdf");
  std::vector<ProbeInfo> probes = two_probes();
  probes[1].extra_columns = {"t_\xB0"};
  auto sink = open_sink(
      "xdf:" + path,
      SinkSetup{.run = {.scene = "caf\xE9.toml",
                        .facts = {{"scene_text", "µ€😀"},
                                  {"bytes", "a\xE2\x82 \xC0\xAF \xED\xA0\x80 \xEF\xBF\xBE\xF5z"}},
                        .model = {},
                        .probes = probes}});
  ASSERT_TRUE(sink) << sink.error().sentence;
  ASSERT_TRUE((*sink)->close());
  const auto session = SessionReader::open(path);
  ASSERT_TRUE(session) << session.error().sentence;
  const std::string bad = "\xEF\xBF\xBD";
  EXPECT_EQ(session->fact("scene"), "caf" + bad + ".toml");
  EXPECT_EQ(session->fact("scene_text"), "µ€😀");
  EXPECT_EQ(session->fact("bytes"),
            "a" + bad + bad + " " + bad + bad + " " + bad + " " + bad + bad + "z");
  EXPECT_EQ(session->extra_columns().back(), "t_" + bad);
}

TEST(SessionFormat, EveryChannelHasItsOwnLabelAndSaysWhatItIs) {
  for (const SessionStream& stream : session_streams()) {
    std::set<std::string_view> labels;
    for (const SessionStream::Channel& channel : stream.channels) {
      EXPECT_TRUE(labels.insert(channel.label).second) << stream.name << " " << channel.label;
      EXPECT_FALSE(channel.unit.empty() && channel.meaning.empty())
          << stream.name << " " << channel.label;
      EXPECT_EQ(channel.unit.find(' '), std::string_view::npos) << channel.unit;
    }
  }
  const auto spikes = session_streams()[0].channels;
  EXPECT_EQ(spikes[1].label, "neuron");
  EXPECT_EQ(spikes[1].meaning, "number in the model, across all patches, from 1");
}

TEST(SessionReader, ReadsSessionsOfVersionsWithoutStimulationCommands) {
  const TemporaryFolder folder;
  std::string bytes = read_file(record(folder, true));
  const std::string name = "merkel.stimulation";
  for (auto at = bytes.find(name); at != std::string::npos; at = bytes.find(name)) {
    bytes.replace(at, name.size(), "unknown.stimulatio");
  }
  const Everything all = read_all(folder.file("old.xdf", bytes));
  EXPECT_EQ(all.error, "");
  EXPECT_TRUE(all.commands.empty());
  EXPECT_EQ(all.ticks.size(), 2U);
  EXPECT_EQ(all.marks.size(), 2U);
}

TEST(SessionReader, ReadsThePressuresOfTaxelsAsTheyWere) {
  const TemporaryFolder folder;
  const std::string path = folder.path("taxels.xdf");
  SinkSetup setup{.neurons = 20, .overwrite = false, .allow_remote = false, .run = {}};
  setup.run.facts = {{"scene_text", ""}};
  setup.run.model.indenters.front().tip = TaxelArray{};
  TaxelBlock block{.time = kLongAgo, .tick = 3, .probe = 1, .first = 32, .count = 2};
  block.pressure_kPa[0] = 1.0F / 3.0F;
  block.pressure_kPa[1] = 1e-30F;
  {
    auto sink = open_sink("xdf:" + path, setup);
    ASSERT_TRUE(sink) << sink.error().sentence;
    EXPECT_TRUE((*sink)->write({.taxels = {&block, 1}}));
    EXPECT_TRUE((*sink)->close());
  }
  const auto read = [](const std::string& file) {
    auto session = SessionReader::open(file);
    SessionChunk chunk;
    return session && session->next(chunk).value_or(false) ? chunk.taxels
                                                           : std::vector<TaxelBlock>{};
  };
  const std::vector<TaxelBlock> found = read(path);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].time, block.time);
  EXPECT_EQ(found[0].tick, block.tick);
  EXPECT_EQ(found[0].probe, block.probe);
  EXPECT_EQ(found[0].first, block.first);
  EXPECT_EQ(found[0].count, block.count);
  EXPECT_EQ(found[0].pressure_kPa, block.pressure_kPa);
  // A pull, or no number, is none of the loop's.
  std::string bytes = read_file(path);
  const double third = static_cast<double>(block.pressure_kPa[0]);
  const auto at = bytes.find(std::string(reinterpret_cast<const char*>(&third), sizeof third));
  ASSERT_NE(at, std::string::npos);
  for (const double wrong : {-1.0, std::nan(""), 1e9}) {
    bytes.replace(at, sizeof wrong, reinterpret_cast<const char*>(&wrong), sizeof wrong);
    EXPECT_TRUE(read(folder.file("wrong.xdf", bytes)).empty());
  }
}

TEST(SessionReader, RefusesTwoStreamsOfOneName) {
  const TemporaryFolder folder;
  std::string bytes = read_file(record(folder, true));
  bytes.replace(bytes.find("merkel.events"), 13, "merkel.spikes");
  EXPECT_NE(read_all(folder.file("two.xdf", bytes)).error.find("two streams have the same name"),
            std::string::npos);
}

TEST(SessionOnRequest, RecordsStimulationCommands) {
  const TemporaryFolder folder;
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path(""));
  const auto recording = std::make_shared<RecordingSwitch>();
  const auto sink = session_on_request(
      recording, {.neurons = 20,
                  .overwrite = false,
                  .allow_remote = false,
                  .run = {.scene = "paper", .facts = {{"scene_text", ""}}, .model = {}}});
  EXPECT_TRUE(sink->takes<StimulationCommand>());
  recording->request(true);
  EXPECT_TRUE(sink->flush());
  EXPECT_TRUE(recording->recording());
  EXPECT_TRUE(sink->write({.commands = kCommands}));
  EXPECT_TRUE(sink->close());
  std::filesystem::current_path(before);
  const auto file = std::filesystem::directory_iterator(folder.path(""))->path();
  const Everything all = read_all(file.string());
  EXPECT_EQ(all.error, "");
  EXPECT_EQ(all.commands, std::vector(kCommands.begin(), kCommands.end()));
}

TEST(SessionReader, AFileCutAtAnyByteReadsUpToItsLastWholeChunk) {
  const TemporaryFolder folder;
  const std::string whole = read_file(record(folder, true));
  std::size_t items_before = 0;
  std::size_t readable = 0;
  // All bytes of the sample chunks, and some of the headers before them.
  const std::size_t samples = read_file(record(folder, false)).size() - 1000;
  for (std::size_t bytes = 0; bytes < whole.size(); bytes += bytes < samples ? 37 : 1) {
    const Everything all = read_all(folder.file("cut.xdf", whole.substr(0, bytes)));
    const std::size_t items = all.spikes.size() + all.ticks.size() + all.events.size() +
                              all.samples.size() + all.status.size() + all.frames.size();
    EXPECT_GE(items, items_before) << bytes;
    items_before = items;
    if (all.error.empty()) {
      ++readable;
    } else {
      EXPECT_EQ(items, 0U) << bytes << ": " << all.error;
      EXPECT_EQ(readable, 0U) << bytes << ": " << all.error;
    }
  }
  EXPECT_EQ(items_before, 9U);
  EXPECT_GT(readable, 500U);
}

TEST(SessionReader, ASessionThatWasNotEndedSaysSo) {
  const TemporaryFolder folder;
  const Everything all = read_all(record(folder, false));
  EXPECT_EQ(all.error, "");
  EXPECT_EQ(all.spikes.size(), 2U);
  EXPECT_FALSE(all.complete);
}

TEST(SessionReader, RefusesWhatIsNoSession) {
  const TemporaryFolder folder;
  EXPECT_NE(read_all(folder.path("none")).error.find("cannot read the session"), std::string::npos);
  EXPECT_NE(read_all("/dev/zero").error.find("is not a file"), std::string::npos);
  EXPECT_NE(read_all(folder.file("a", "time_s,neuron\n")).error.find("is not a session"),
            std::string::npos);
  EXPECT_NE(read_all(folder.file("b", "XDF:")).error.find("ends before its metadata"),
            std::string::npos);
  const std::string others("\x04\x08\x00\x00\x00\x01\x00<info/>", 14);
  EXPECT_NE(read_all(folder.file("c", "XDF:" + others)).error, "");
}

TEST(SessionReader, LengthsThatLieCostNoMemory) {
  const TemporaryFolder folder;
  std::string bytes = read_file(record(folder, true));
  // A chunk that claims to hold 2⁶³ spikes.
  bytes += std::string("\x01\x0F\x03\x00\x01\x00\x00\x00\x08\x00\x00\x00\x00\x00\x00\x00\x80", 17);
  EXPECT_NE(
      read_all(folder.file("count.xdf", bytes)).error.find("merkel.spikes has an invalid value"),
      std::string::npos);
  // A chunk that claims to be longer than the file.
  const std::string longer = read_file(record(TemporaryFolder(), true)) +
                             std::string("\x08\xFF\xFF\xFF\xFF\xFF\xFF\xFF\x7F\x03\x00", 11);
  const Everything all = read_all(folder.file("longer.xdf", longer));
  EXPECT_EQ(all.error, "");
  EXPECT_FALSE(all.complete);
  EXPECT_EQ(all.spikes.size(), 2U);
}

TEST(SessionReader, SurvivesAnyBytesAndHandsOutPossibleValuesOnly) {
  const TemporaryFolder folder;
  const std::string whole = read_file(record(folder, true));
  Random random(7);
  int refused = 0;
  for (int round = 0; round < 2000; ++round) {
    std::string bytes = whole;
    const int changes = 1 + static_cast<int>(random.next() % 4);
    for (int k = 0; k < changes; ++k) {
      // Half of the changes are after the headers, where the samples are.
      const std::size_t low = random.next() % 2 == 0 ? 0 : whole.find("</info>", whole.size() / 2);
      bytes[low + random.next() % (bytes.size() - low)] = static_cast<char>(random.next());
    }
    const Everything all = read_all(folder.file("fuzzed.xdf", bytes));
    refused += all.error.empty() ? 0 : 1;
    for (const TickRecord& tick : all.ticks) {
      EXPECT_LE(std::abs(tick.contact.depth_mm), 1e3);
      EXPECT_LE(tick.state, TickRecord::State::kEnded);
    }
    for (const LoopEvent& event : all.events) {
      EXPECT_LE(event.kind, LoopEvent::Kind::kNeuronReset);
    }
    for (const SpikeEvent& spike : all.spikes) EXPECT_GT(spike.neuron, 0U);
    for (const auto& each : all.frames) {
      EXPECT_LE(each.frame.content().size(), RawFrame::kMaxBytes);
      EXPECT_LE(each.frame.kind, RawFrame::Kind::kStarted);
    }
  }
  EXPECT_GT(refused, 200);
}

}  // namespace
}  // namespace merkel
