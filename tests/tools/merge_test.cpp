// Sessions of clocks that drift, merged. tests/python/merge_test.py merges by the program.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <memory>
#include <regex>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/math/random.hpp"
#include "core/units.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/files/line_reader.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tests/tools/program.hpp"
#include "tools/run/merged_sessions.hpp"
#include "tools/run/session_alignment.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/scene/session_scene.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;

constexpr int kLength_s = 240;

/// The clock of a rig: its time at a true time, which counts from the start of both runs.
struct RigClock {
  double offset_s = 0.0;
  double rate_ppm = 0.0;
  [[nodiscard]] nanoseconds operator()(nanoseconds time) const {
    return time + units::nanoseconds_from_s(offset_s) +
           nanoseconds{
               static_cast<std::int64_t>(rate_ppm * 1e-6 * static_cast<double>(time.count()))};
  }
};

/// The end of a pulse, 1 to 20 ms after its begin.
nanoseconds end_of(nanoseconds begin) {
  return begin + milliseconds{1} + std::chrono::microseconds{begin.count() / 1000 % 19'000};
}

using Facts = std::vector<std::pair<std::string, std::string>>;

/// Records a session of a rig: a spike and a sample every 100 ms, and marks.
/// \param pulses  begins of pulses of its sync line, on its clock
std::string record(const std::string& path, const RigClock& clock, const std::vector<int>& marks_s,
                   const RunOrigin& origin, const Facts& facts,
                   const std::vector<nanoseconds>& pulses = {}, int length_s = kLength_s) {
  static const Scene scene = *preset_scene("paper");
  static const TactileModel model = *TactileModel::create(scene.model);
  RunDescription run = describe_run(scene, model);
  std::erase_if(run.facts, [](const auto& fact) { return fact.first == "boot_id"; });
  run.facts.insert(run.facts.end(), facts.begin(), facts.end());
  add_probe_facts({.uri = "sim:ramp", .name = {}, .serial_number = {}}, run);
  auto sink = open_sink("xdf:" + path, {.neurons = static_cast<std::uint32_t>(model.neurons()),
                                        .run = std::move(run)});
  EXPECT_TRUE(sink);
  EXPECT_TRUE((*sink)->begin(origin));
  std::size_t next_pulse = 0;
  for (int step = 0; step < 10 * length_s; ++step) {
    const nanoseconds time = clock(milliseconds{100 * step});
    std::vector<SyncEdge> edges;
    for (; next_pulse < pulses.size() && pulses[next_pulse] <= time; ++next_pulse) {
      edges.push_back({.time = pulses[next_pulse], .level = 1});
      edges.push_back({.time = end_of(pulses[next_pulse]), .level = 0});
    }
    const SpikeEvent spike{.time = time, .neuron = static_cast<std::uint32_t>(1 + step % 20)};
    const DeliveredSample sample{.sample = {.time = time,
                                            .arrival = time,
                                            .depth_mm = 1.0 + 1e-3 * step,
                                            .channels = ProbeSample::kDepth}};
    std::vector<Mark> marks;
    for (const int mark_s : marks_s) {
      if (10 * mark_s == step) marks.push_back({.time = time, .label = "sync"});
    }
    TickRecord tick;
    tick.number = static_cast<std::uint64_t>(step + 1);
    tick.time = time + milliseconds{1};
    TaxelBlock block;
    block.time = tick.time;
    block.tick = tick.number;
    block.count = 2;
    block.pressure_kPa = {1.0F, static_cast<float>(step)};
    TaxelZeros zeros{block};
    const GivenDrive drive{.time = time, .amplitude = 0.5, .frequency = 0.25};
    EXPECT_TRUE((*sink)->write({.samples = {&sample, 1},
                                .edges = edges,
                                .zeros = {&zeros, 1},
                                .drives = {&drive, 1},
                                .spikes = {&spike, 1},
                                .taxels = {&block, 1},
                                .ticks = {&tick, 1},
                                .marks = marks}));
    if (step % 5 != 0) continue;
    EXPECT_TRUE((*sink)->flush());
  }
  EXPECT_TRUE((*sink)->close());
  return path;
}

/// The largest distance of the two sessions' spikes of one step, and whether all is in order.
double largest_error_ms(MergedSessions& merged) {
  std::vector<nanoseconds> first;
  std::vector<nanoseconds> other;
  nanoseconds last = nanoseconds::min();
  std::size_t samples = 0;
  std::array<std::array<std::size_t, 3>, 2> of_arrays{};
  EXPECT_TRUE(merged.read([&](const RecordBatch& batch) {
    for (const SpikeEvent& spike : batch.spikes) {
      EXPECT_GE(spike.time, last);
      last = spike.time;
      (spike.neuron <= 20 ? first : other).push_back(spike.time);
      EXPECT_EQ(spike.patch, spike.neuron <= 20 ? 0 : 1);
    }
    samples += batch.samples.size();
    for (const TaxelBlock& block : batch.taxels) {
      EXPECT_EQ(block.pressure_kPa[1], static_cast<float>(block.tick - 1));
      ++of_arrays.at(block.probe)[0];
    }
    for (const TaxelZeros& zeros : batch.zeros) ++of_arrays.at(zeros.probe)[1];
    for (const GivenDrive& drive : batch.drives) {
      EXPECT_EQ(drive.frequency, 0.25);
      ++of_arrays.at(0)[2];
    }
    return true;
  }));
  // The scenes have no electrodes: both drives keep their number.
  EXPECT_EQ(of_arrays[0], (std::array{10UL * kLength_s, 10UL * kLength_s, 20UL * kLength_s}));
  EXPECT_EQ(of_arrays[1], (std::array{10UL * kLength_s, 10UL * kLength_s, 0UL}));
  EXPECT_EQ(first.size(), 10U * kLength_s);
  EXPECT_EQ(other.size(), first.size());
  EXPECT_EQ(samples, 2 * first.size());
  double largest_ms = 0.0;
  for (std::size_t i = 0; i < std::min(first.size(), other.size()); ++i) {
    largest_ms = std::max(largest_ms, units::ms_from(std::chrono::abs(other[i] - first[i])));
  }
  return largest_ms;
}

TEST(Merge, MarksGiveOffsetAndRateOfADriftingClock) {
  for (const RigClock& clock : {RigClock{3.25, 50.0}, RigClock{-1.5, -300.0}}) {
    const TemporaryFolder folder;
    const std::vector<int> marks = {10, 130, 220};
    const auto a = record(folder.path("a.xdf"), {}, marks, {}, {});
    const auto b = record(folder.path("b.xdf"), clock, marks, {}, {});
    const auto merged = MergedSessions::open({a, b}, {.mark = "sync"});
    ASSERT_TRUE(merged) << merged.error().sentence;
    const double error_ms = largest_error_ms(**merged);
    EXPECT_LT(error_ms, 0.2);
    const auto& alignment = (*merged)->alignments().front();
    ASSERT_TRUE(alignment.residual);
    EXPECT_GE(units::ms_from(*alignment.residual), error_ms);
    EXPECT_LT(units::ms_from(*alignment.residual), 0.2);
    EXPECT_NEAR(alignment.rate * 1e6, -clock.rate_ppm, 0.1 + 1e-3 * std::abs(clock.rate_ppm));
  }
}

TEST(Merge, UtcOfOneReadingIsAsUncertainAsAClockThatDrifts) {
  const TemporaryFolder folder;
  const RunOrigin origin{.start = nanoseconds{0}, .utc = seconds{1'700'000'000}};
  const Facts synchronised = {{"utc_error_ns", "1000000"}};
  const auto a = record(folder.path("a.xdf"), {}, {}, origin, synchronised);
  const auto b = record(folder.path("b.xdf"), {0.0, 500.0}, {}, origin, synchronised);
  const auto merged = MergedSessions::open({a, b}, {});
  ASSERT_TRUE(merged) << merged.error().sentence;
  const auto& alignment = (*merged)->alignments().front();
  ASSERT_TRUE(alignment.residual);
  const double error_ms = largest_error_ms(**merged);
  EXPECT_GT(error_ms, 100.0);
  EXPECT_GE(units::ms_from(*alignment.residual), error_ms);
}

TEST(Merge, RecordsOfManySessionsComeInOrderWhicheverBeginsFirst) {
  const TemporaryFolder folder;
  std::vector<std::string> paths;
  for (int i = 0; i < 7; ++i) {
    const RigClock clock{.offset_s = 20.0 * (i * 3 % 7) + 0.0123 * i};
    const nanoseconds start = clock(nanoseconds{0});
    paths.push_back(record(folder.path(std::to_string(i) + ".xdf"), clock, {},
                           {.start = start, .utc = seconds{1'700'000'000} + start},
                           {{"boot_id", "one"}}));
  }
  const auto merged = MergedSessions::open(paths, {});
  ASSERT_TRUE(merged) << merged.error().sentence;
  for (int reading = 0; reading < 2; ++reading) {
    nanoseconds last = nanoseconds::min();
    std::vector<std::size_t> of_session(7);
    ASSERT_TRUE((*merged)->read([&](const RecordBatch& batch) {
      EXPECT_TRUE(std::is_sorted(batch.spikes.begin(), batch.spikes.end()));
      for (const SpikeEvent& spike : batch.spikes) {
        EXPECT_GE(spike.time, last);
        last = spike.time;
        ++of_session[(spike.neuron - 1) / 20];
      }
      return true;
    }));
    EXPECT_EQ(of_session, std::vector<std::size_t>(7, 10U * kLength_s));
    EXPECT_TRUE((*merged)->complete());
  }
}

/// Pulses at irregular intervals as a recorder sees them, on its clock: some missing, some extra,
/// jittered.
std::vector<nanoseconds> seen_pulses(const RigClock& clock, int length_s, std::uint64_t seed) {
  Random line(99);  // the same for all recorders
  Random own(seed);
  std::vector<nanoseconds> seen;
  for (double time_s = line.uniform(0.06, 0.5); time_s < length_s;
       time_s += line.uniform(0.06, 0.5)) {
    const double jitter_s = own.uniform(-20e-6, 20e-6);
    if (own.uniform() < 0.01) {
      seen.push_back(clock(units::nanoseconds_from_s(time_s - own.uniform(0.0, 0.05))));
    }
    if (own.uniform() >= 0.03) seen.push_back(clock(units::nanoseconds_from_s(time_s + jitter_s)));
  }
  std::sort(seen.begin(), seen.end());
  return seen;
}

std::string csv_of(const std::vector<nanoseconds>& times) {
  std::string text = "time_s\n";
  for (const nanoseconds each : times) {
    append_seconds(text, each);
    text += '\n';
  }
  return text;
}

TEST(Align, TwoHoursOfSpikesAreOnTheRecordersClockToATenthOfAMillisecond) {
  constexpr int kTwoHours_s = 7200;
  const TemporaryFolder folder;
  const RigClock own{.offset_s = 1000.0};
  const RigClock recorder{.offset_s = 37.5, .rate_ppm = 100.0};
  const auto session = record(folder.path("a.xdf"), own, {}, {.start = own(nanoseconds{0})}, {},
                              seen_pulses(own, kTwoHours_s, 1), kTwoHours_s);
  const auto pulses = folder.file("pulses.csv", csv_of(seen_pulses(recorder, kTwoHours_s, 2)));
  const std::string spikes = folder.path("aligned.csv");
  const ProgramRun run =
      run_program({"align", session, "--to", pulses, "--sink", "csv:" + spikes, "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto summary = nlohmann::json::parse(run.out);
  EXPECT_NEAR(summary["rate_ppm"].get<double>(), 100.0, 0.01);
  EXPECT_NEAR(summary["offset_s"].get<double>(), 37.5 - 1000.0, 1e-4);
  EXPECT_LT(summary["residual_ms"].get<double>(), 0.1);
  EXPECT_GT(summary["matched"].get<double>(), 0.92 * summary["pulses"].get<double>());
  auto lines = LineReader::open(spikes);
  ASSERT_TRUE(lines);
  ASSERT_EQ(lines->next(), LineReader::Outcome::kLine);  // the header
  double largest_ms = 0.0;
  int step = 0;
  for (; lines->next() == LineReader::Outcome::kLine; ++step) {
    std::string_view row = lines->line();
    const auto error = *parse_seconds(take_field(row)) - recorder(milliseconds{100 * step});
    largest_ms = std::max(largest_ms, std::fabs(units::ms_from(error)));
  }
  EXPECT_EQ(step, 10 * kTwoHours_s);
  EXPECT_LT(largest_ms, 0.1);
}

TEST(SessionAlignment, IsReadWholeOrNotAtAll) {
  const auto recorded = [](const char* session_ns, const char* to_ns) {
    return parse_alignment(R"({"to": "TTL", "session_ns": )" + std::string(session_ns) +
                           R"(, "to_ns": )" + to_ns + "}");
  };
  const auto read = recorded("[0, 1000]", "[5, 1005]");
  ASSERT_TRUE(read);
  EXPECT_EQ(read->to, "TTL");
  ASSERT_EQ(read->points.size(), 2U);
  EXPECT_EQ(read->points[1].to, nanoseconds{1005});
  const char* const good = "[0, 1000]";
  for (const char* const bad : {"[0, \"1\"]", "[0, 0.5]", "[0, 9000000000000000000]",
                                "[0, 18446744073709551615]", "[0]", "[]", "7"}) {
    EXPECT_FALSE(recorded(bad, good)) << bad;
    EXPECT_FALSE(recorded(good, bad)) << bad;
  }
  EXPECT_FALSE(recorded("[]", "[]"));
  EXPECT_FALSE(parse_alignment(R"({"session_ns": [0], "to_ns": [0]})"));
}

TEST(Align, ACopyOfTheSessionRecordsTheAlignmentForLater) {
  const TemporaryFolder folder;
  const RigClock recorder{.offset_s = 37.5, .rate_ppm = 100.0};
  const auto session =
      record(folder.path("a.xdf"), {}, {10, 20}, {}, {}, seen_pulses({}, kLength_s, 1));
  const auto pulses = folder.file("pulses.csv", csv_of(seen_pulses(recorder, kLength_s, 2)));
  const std::string copy = folder.path("aligned.xdf");
  const std::string before = read_file(session);
  const auto align_to = [&](const std::string& from, const std::string& to,
                            const std::string& sink) {
    return run_program({"align", from, "--to", to, "--sink", sink, "--overwrite"});
  };
  const ProgramRun run = align_to(session, pulses, "xdf:" + copy);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  ASSERT_EQ(align_to(session, pulses, "xdf:" + folder.path("dated-%t.xdf")).exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(folder.path("dated-%t.xdf")));
  EXPECT_EQ(read_file(session), before);
  const auto parts = [](const std::string& path, const std::string& stream) {
    return run_program({"inspect", "session", path, "--stream", stream}).out;
  };
  for (const char* stream : {"spikes", "ticks", "samples", "sync", "marks"}) {
    EXPECT_EQ(parts(copy, stream), parts(session, stream)) << stream;
  }
  const auto facts_of = [](const std::string& path) {
    return run_program({"inspect", "session", path, "--fact", "alignment"}).out;
  };
  const auto fact = nlohmann::json::parse(facts_of(copy));
  EXPECT_EQ(fact["to"], pulses);
  EXPECT_NEAR(fact["rate_ppm"].get<double>(), 100.0, 1.0);
  EXPECT_GE(fact["session_ns"].size(), 2U);
  EXPECT_EQ(fact["session_ns"].size(), fact["to_ns"].size());

  // The same spikes on the other clock, by the pulses or by what the copy records.
  const std::string direct = folder.path("direct.csv");
  const std::string later = folder.path("later.csv");
  ASSERT_EQ(align_to(session, pulses, "csv:" + direct).exit_code, 0);
  const ProgramRun recorded = run_program({"align", copy, "--sink", "csv:" + later});
  ASSERT_EQ(recorded.exit_code, 0) << recorded.err;
  EXPECT_TRUE(has(recorded.err, "spikes on the clock of " + pulses)) << recorded.err;
  EXPECT_GT(read_file(direct).size(), 1000U);
  EXPECT_EQ(read_file(later), read_file(direct));
  const ProgramRun printed = run_program({"align", copy, "--json"});
  ASSERT_EQ(printed.exit_code, 0) << printed.err;
  EXPECT_EQ(nlohmann::json::parse(printed.out), fact);
  const ProgramRun sentence = run_program({"align", copy});
  EXPECT_TRUE(has(sentence.err, "the recorded alignment to " + pulses + ": +37.5")) << sentence.err;
  EXPECT_TRUE(has(sentence.err, " ppm\n")) << sentence.err;

  // Again: the same file, and one alignment for each recorder.
  const std::string bytes = read_file(copy);
  ASSERT_EQ(align_to(session, pulses, "xdf:" + copy).exit_code, 0);
  EXPECT_EQ(read_file(copy), bytes);
  const std::string again = folder.path("again.xdf");
  ASSERT_EQ(align_to(copy, pulses, "xdf:" + again).exit_code, 0);
  EXPECT_EQ(read_file(again), bytes);
  const auto second = folder.file("second.csv", read_file(pulses));
  ASSERT_EQ(align_to(copy, second, "xdf:" + again).exit_code, 0);
  const std::string both = facts_of(again);
  EXPECT_EQ(std::count(both.begin(), both.end(), '\n'), 2) << both;

  const auto refused = [](const std::vector<std::string>& arguments, const std::string& words) {
    const ProgramRun wrong = run_program(arguments);
    EXPECT_EQ(wrong.exit_code, 2) << wrong.err;
    EXPECT_TRUE(has(wrong.err, words)) << wrong.err;
  };
  refused({"align", session, "--to", pulses, "--sink", "xdf:" + session, "--overwrite"}, session);
  refused({"align", session, "--sink", "csv:" + folder.path("x.csv")}, "records no alignment");
  refused({"align", again, "--sink", "csv:" + folder.path("x.csv")},
          "records alignments to " + pulses + ", " + second);
  refused({"align", copy, "--sink", "xdf:" + folder.path("x.xdf")}, "--to PULSES");
  for (const char* const option : {"--mark", "--line", "--to-line", "--jitter-ms"}) {
    refused({"align", copy, option, "1"}, std::string(option) + " is about the pulses");
  }
  for (const char* const option : {"--line", "--to-line"}) {
    for (const char* const line : {"0", "65536", "4294967297"}) {
      refused({"align", session, "--to", pulses, option, line},
              "must be a whole number from 1 to 65535");
    }
    EXPECT_EQ(run_program({"align", session, "--to", pulses, option, "1"}).exit_code, 0);
  }
  EXPECT_EQ(read_file(session), before);

  // Of a session that broke off, the copy is one, too.
  const auto cut = folder.file("cut.xdf", before.substr(0, 3 * before.size() / 4));
  ASSERT_EQ(align_to(cut, pulses, "xdf:" + folder.path("c.xdf")).exit_code, 0);
  EXPECT_TRUE(has(run_program({"inspect", "session", folder.path("c.xdf")}).out, "ended,no"));
  EXPECT_EQ(parts(folder.path("c.xdf"), "spikes"), parts(cut, "spikes"));
}

TEST(Align, TheSpikesOfAnNwbFileAreComparedFromTheStartOfTheirRun) {
  const TemporaryFolder folder;
  const RigClock recorder{.offset_s = 37.5, .rate_ppm = 0.0};
  const auto session = record(folder.path("a.xdf"), {}, {}, {}, {}, seen_pulses({}, kLength_s, 1));
  const auto pulses = folder.file("pulses.csv", csv_of(seen_pulses(recorder, kLength_s, 2)));
  const std::string nwb = folder.path("a.nwb");
  for (const char* const zero : {"session", "device", "unix"}) {
    const ProgramRun align = run_program({"align", session, "--to", pulses, "--time-zero", zero,
                                          "--sink", "nwb:" + nwb, "--overwrite"});
    ASSERT_EQ(align.exit_code, 0) << align.err;
    const ProgramRun compare = run_program({"compare", nwb, session, "--within-us", "2000"});
    EXPECT_EQ(compare.exit_code, 0) << zero << ": " << compare.out;
  }
}

TEST(Align, PulsesOfAnotherRecordingAreRefused) {
  const TemporaryFolder folder;
  const auto session =
      record(folder.path("a.xdf"), {}, {10, 20}, {}, {}, seen_pulses({}, kLength_s, 1));
  std::vector<nanoseconds> others;
  Random random(5);
  for (double time_s = 0.0; time_s < kLength_s; time_s += random.uniform(0.06, 0.5)) {
    others.push_back(units::nanoseconds_from_s(time_s));
  }
  const auto pulses = folder.file("pulses.csv", csv_of(others));
  const std::string spikes = folder.path("aligned.csv");
  const ProgramRun run = run_program({"align", session, "--to", pulses, "--sink", "csv:" + spikes});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_TRUE(has(run.err, "do not match: no place fits")) << run.err;
  EXPECT_FALSE(std::filesystem::exists(spikes));
  const ProgramRun marks = run_program({"align", session, "--to", pulses, "--mark", "start"});
  EXPECT_EQ(marks.exit_code, 2);
  EXPECT_TRUE(has(marks.err, "its marks are sync")) << marks.err;
}

TEST(Align, AnInvertedLineIsMatchedByItsFallingEdges) {
  const TemporaryFolder folder;
  const auto begins = seen_pulses({}, kLength_s, 1);
  std::vector<nanoseconds> ends;
  for (const nanoseconds each : begins) ends.push_back(end_of(each));
  std::sort(ends.begin(), ends.end());
  const auto session = record(folder.path("a.xdf"), {}, {}, {}, {}, begins);
  const ProgramRun run =
      run_program({"align", session, "--to", folder.file("p.csv", csv_of(ends))});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(has(run.err, "the line is inverted")) << run.err;
}

TEST(Align, TheEdgesOfARecordingGoIntoTheSessionOfARunWithIt) {
  const TemporaryFolder folder;
  const auto a = record(folder.path("a.xdf"), {}, {}, {}, {}, seen_pulses({}, 20, 1), 20);
  const std::string b = folder.path("b.xdf");
  const ProgramRun run =
      run_program({"run", "paper", "--fast", "--probe", "replay:" + a, "--sink", "xdf:" + b});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const ProgramRun recorded = run_program({"inspect", "session", a, "--stream", "sync"});
  EXPECT_GT(std::count(recorded.out.begin(), recorded.out.end(), '\n'), 100);
  EXPECT_EQ(run_program({"inspect", "session", b, "--stream", "sync"}).out, recorded.out);
}

/// Records a session with one electrode: ten commands, of which every other one left.
/// \param live  the session holds what left
std::string record_commands(const std::string& path, bool live,
                            const std::string& phase_us = "200") {
  auto scene = parse_scene(
      "[[electrode]]\nname = \"E\"\nfield_mm = [15, 10, 4]\nencoder = \"rate\"\n"
      "full_rate_Hz = 50\namplitude_uA = [20, 80]\nfrequency_Hz = [0, 200]\n[stimulation]\n"
      "update_ms = 10\nphase_us = " +
          phase_us + "\nmax_charge_nC = 16\nmax_total_uA = 250\nwatchdog_ms = 100\n",
      "scene.toml");
  EXPECT_TRUE(scene) << scene.error().sentence;
  const TactileModel model = *TactileModel::create(scene->model);
  RunDescription run = describe_run(*scene, model);
  add_probe_facts({.uri = "sim:ramp", .name = {}, .serial_number = {}}, run);
  auto sink = open_sink("xdf:" + path, {.neurons = static_cast<std::uint32_t>(model.neurons()),
                                        .run = std::move(run)});
  EXPECT_TRUE(sink);
  EXPECT_TRUE((*sink)->begin({}));
  const Mark mark{.time = nanoseconds{0}, .label = "sync"};
  std::vector<StimulationCommand> commands;
  std::vector<SentCommand> sent;
  for (std::uint32_t i = 1; i <= 10; ++i) {
    commands.push_back({.time = milliseconds{10 * i}, .amplitude_uA = 30.0, .heartbeat = i});
    if (live) sent.push_back({.command = commands.back(), .refused_by = i % 2});
  }
  EXPECT_TRUE((*sink)->write({.commands = commands, .sent = sent, .marks = {&mark, 1}}));
  EXPECT_TRUE((*sink)->close());
  return path;
}

TEST(Merge, ReceiversGetTheCommandsOfASessionWithoutSentOnesBesideOneWithThem) {
  const TemporaryFolder folder;
  const std::string live = record_commands(folder.path("live.xdf"), true);
  const std::string fast = record_commands(folder.path("fast.xdf"), false);
  for (const auto& paths : {std::vector{live, fast}, std::vector{fast, live}}) {
    const auto merged = MergedSessions::open(paths, {.mark = "sync"});
    ASSERT_TRUE(merged) << merged.error().sentence;
    const std::string file = folder.path("stim.csv");
    std::vector<std::unique_ptr<Sink>> sinks;
    sinks.push_back(
        *open_sink("stim-csv:" + file,
                   {.neurons = (*merged)->neurons(), .overwrite = true, .run = (*merged)->run()}));
    std::uint64_t spikes = 0;
    ASSERT_TRUE(write_run(**merged, (*merged)->origin(), sinks, spikes));
    const std::string rows = read_file(file);
    const auto rows_of = [&](const char* electrode) {
      const std::regex name(electrode);
      return std::distance(std::sregex_iterator(rows.begin(), rows.end(), name), {});
    };
    EXPECT_EQ(rows_of("live"), 5) << rows;
    EXPECT_EQ(rows_of("fast"), 10) << rows;
  }
}

/// As two rigs with the same scene have them, or with other limits.
TEST(Merge, ElectrodesOfOneNameStayApartWithTheLimitsOfTheirOwnRig) {
  const TemporaryFolder folder;
  const auto merged = MergedSessions::open({record_commands(folder.path("left.xdf"), true, "200"),
                                            record_commands(folder.path("right.xdf"), true, "100")},
                                           {.mark = "sync"});
  ASSERT_TRUE(merged) << merged.error().sentence;
  const EncodingParameters& encoding = (*merged)->run().encoding;
  ASSERT_EQ(encoding.electrodes.size(), 2);
  EXPECT_EQ(encoding.electrodes[0].name, "left.E");
  EXPECT_EQ(encoding.electrodes[1].name, "right.E");
  EXPECT_EQ(encoding.electrodes[0].patch, 0);
  EXPECT_EQ(encoding.electrodes[1].patch, 1);
  EXPECT_EQ(ElectrodeLimits::of(encoding.electrodes[0], encoding.stimulation).phase,
            std::chrono::microseconds{200});
  EXPECT_EQ(ElectrodeLimits::of(encoding.electrodes[1], encoding.stimulation).phase,
            std::chrono::microseconds{100});
}

TEST(Merge, PulsesOfASyncLineGiveOffsetAndRate) {
  for (const RigClock& clock : {RigClock{3.25, 50.0}, RigClock{-1.5, -300.0}}) {
    const TemporaryFolder folder;
    const auto a = record(folder.path("a.xdf"), {}, {}, {}, {}, seen_pulses({}, kLength_s, 1));
    const auto b =
        record(folder.path("b.xdf"), clock, {}, {}, {}, seen_pulses(clock, kLength_s, 2));
    const auto merged = MergedSessions::open({a, b}, {.pulses = true});
    ASSERT_TRUE(merged) << merged.error().sentence;
    const double error_ms = largest_error_ms(**merged);
    EXPECT_LT(error_ms, 0.1);
    const auto& alignment = (*merged)->alignments().front();
    ASSERT_TRUE(alignment.residual);
    EXPECT_LT(units::ms_from(*alignment.residual), 0.1);
  }
  const TemporaryFolder folder;
  const auto a = record(folder.path("a.xdf"), {}, {}, {}, {});
  EXPECT_TRUE(has(MergedSessions::open({a, a}, {.pulses = true}).error().sentence,
                  "has no pulses of a sync line"));
}

}  // namespace
}  // namespace merkel
