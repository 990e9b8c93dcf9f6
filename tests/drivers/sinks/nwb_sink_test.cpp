// NWB files, read back with the HDF5 library. tests/readers/nwb_test.py reads whole runs.
#include <chrono>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <hdf5.h>

#include "drivers/sinks/open_sink.hpp"
#include "drivers/sinks/run_journal.hpp"
#include "tests/temporary_folder.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using Kind = StimulationCommand::Kind;
using Stop = StimulationCommand::Stop;
using Numbers = std::vector<double>;

/// A file opened for reading.
class Hdf5Reader {
 public:
  explicit Hdf5Reader(const std::string& path)
      : file_(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT)) {}
  Hdf5Reader(const Hdf5Reader&) = delete;
  Hdf5Reader& operator=(const Hdf5Reader&) = delete;
  ~Hdf5Reader() { H5Fclose(file_); }

  [[nodiscard]] bool has(const std::string& path) const {
    return H5Lexists(file_, path.c_str(), H5P_DEFAULT) > 0;
  }
  /// The numbers of a dataset of one dimension.
  [[nodiscard]] std::vector<double> numbers(const std::string& path) const {
    const hid_t dataset = H5Dopen2(file_, path.c_str(), H5P_DEFAULT);
    const hid_t space = H5Dget_space(dataset);
    std::vector<double> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
    EXPECT_GE(H5Dread(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
    H5Sclose(space);
    H5Dclose(dataset);
    return values;
  }
  /// A text attribute.
  [[nodiscard]] std::string text(const std::string& path, const char* name) const {
    const hid_t attribute = H5Aopen_by_name(file_, path.c_str(), name, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t type = H5Aget_type(attribute);
    char* text = nullptr;
    EXPECT_GE(H5Aread(attribute, type, &text), 0);
    std::string copy = text;
    H5free_memory(text);
    H5Tclose(type);
    H5Aclose(attribute);
    return copy;
  }
  [[nodiscard]] float number(const std::string& path, const char* name) const {
    const hid_t attribute = H5Aopen_by_name(file_, path.c_str(), name, H5P_DEFAULT, H5P_DEFAULT);
    float value = 0.0F;
    EXPECT_GE(H5Aread(attribute, H5T_NATIVE_FLOAT, &value), 0);
    H5Aclose(attribute);
    return value;
  }

 private:
  hid_t file_;
};

SinkSetup setup_with(const std::vector<std::string>& electrodes) {
  SinkSetup setup{.neurons = 20, .run = {}};
  setup.run.scene = "test";
  for (const std::string& name : electrodes)
    setup.run.encoding.electrodes.push_back({.name = name});
  return setup;
}

std::vector<StimulationCommand> nwb_commands() {
  return {{.time = std::chrono::nanoseconds{3'200'001},
           .amplitude_uA = 80.0,
           .electrode = 1,
           .kind = Kind::kPulse},
          {.time = milliseconds{10}, .amplitude_uA = 20.5, .frequency_Hz = 55.5, .heartbeat = 1},
          {.time = milliseconds{10}, .heartbeat = 1, .electrode = 1, .stop = Stop::kGap},
          {.time = milliseconds{20}, .amplitude_uA = 30.0, .frequency_Hz = 60.0, .heartbeat = 2},
          {.time = milliseconds{20}, .heartbeat = 2, .electrode = 1}};
}

const std::string kFirst = "/stimulus/presentation/electrode_E1_";
const std::string kSecond = "/stimulus/presentation/electrode_E2_";

void expect_series_of_commands(const Hdf5Reader& file) {
  EXPECT_EQ(file.numbers(kFirst + "amplitude/data"), (Numbers{20.5, 30.0}));
  EXPECT_EQ(file.numbers(kFirst + "frequency/data"), (Numbers{55.5, 60.0}));
  EXPECT_EQ(file.numbers(kFirst + "amplitude/timestamps"), (Numbers{0.01, 0.02}));
  EXPECT_EQ(file.numbers(kFirst + "frequency/timestamps"), (Numbers{0.01, 0.02}));
  EXPECT_FALSE(file.has(kFirst + "pulses"));
  EXPECT_EQ(file.numbers(kSecond + "amplitude/data"), (Numbers{0.0, 0.0}));
  EXPECT_EQ(file.numbers(kSecond + "stop/data"), (Numbers{static_cast<double>(Stop::kGap), 0.0}));
  EXPECT_FALSE(file.has(kSecond + "amplitude/control"));  // Neo refuses a series with it
  EXPECT_EQ(file.numbers(kSecond + "pulses/data"), Numbers{80.0});
  EXPECT_EQ(file.numbers(kSecond + "pulses/timestamps"), Numbers{0.003200001});
}

TEST(NwbSink, HoldsTheCommandsOfEachElectrodeAsTimeSeries) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s.nwb");
  {
    const auto sink = open_sink("nwb:" + path, setup_with({"E1", "E2"}));
    ASSERT_TRUE(sink) << sink.error().sentence;
    EXPECT_TRUE((*sink)->takes<StimulationCommand>());
    const std::vector<StimulationCommand> commands = nwb_commands();
    const std::vector<SentCommand> sent = {
        {.command = commands[1], .sent = milliseconds{7500}},
        {.command = commands[1], .sent = milliseconds{7500}, .refused_by = 1},
        {.command = commands[2], .sent = milliseconds{7500}},
        {.command = commands[3], .sent = milliseconds{7510}}};
    ASSERT_TRUE((*sink)->write({.commands = commands, .sent = sent}));
    ASSERT_TRUE((*sink)->close());
  }
  const Hdf5Reader file(path);
  expect_series_of_commands(file);
  EXPECT_EQ(file.numbers(kFirst + "sent_amplitude/data"), (Numbers{20.5, 30.0}));
  EXPECT_EQ(file.numbers(kFirst + "sent_amplitude/timestamps"), (Numbers{0.01, 0.02}));
  EXPECT_EQ(file.numbers(kFirst + "sent_monotonic/data"), (Numbers{7.5, 7.51}));
  EXPECT_EQ(file.numbers(kSecond + "sent_stop/data"), Numbers{static_cast<double>(Stop::kGap)});
  EXPECT_FALSE(file.has(kSecond + "sent_pulses"));
  EXPECT_EQ(file.text(kFirst + "amplitude/data", "unit"), "amperes");
  EXPECT_EQ(file.number(kFirst + "amplitude/data", "conversion"), 1e-6F);
  EXPECT_EQ(file.text(kFirst + "frequency/data", "unit"), "hertz");
  EXPECT_EQ(file.number(kFirst + "frequency/data", "conversion"), 1.0F);
  EXPECT_EQ(file.text(kSecond + "amplitude", "neurodata_type"), "TimeSeries");
  EXPECT_EQ(file.text(kSecond + "amplitude", "comments"),
            "field of radius 3 mm around x = 15 mm, y = 10 mm on patch 0; one phase lasts 200 µs");
}

TEST(NwbSink, HoldsTheSamplesOfItsTicksAndThePulsesOfSyncLines) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s.nwb");
  SinkSetup setup = setup_with({});
  setup.run.model.tick = milliseconds{1};
  setup.run.facts = {{"tick_ns", "1000000"}};
  setup.run.probes = {{.uri = "p", .name = "p", .channels = ProbeSample::kDepth}};
  {
    const auto sink = open_sink("nwb:" + path, setup);
    ASSERT_TRUE(sink) << sink.error().sentence;
    ASSERT_TRUE((*sink)->begin({.start = milliseconds{100}}));
    std::vector<DeliveredSample> samples;
    for (const int ms : {98, 99, 100, 101, 102, 103}) {
      samples.push_back({.sample = {.time = milliseconds{ms},
                                    .depth_mm = ms > 100 ? 1.0 : 0.0,
                                    .channels = ProbeSample::kDepth}});
    }
    const std::vector<TickRecord> ticks = {{.time = milliseconds{101}, .number = 1},
                                           {.time = milliseconds{102}, .number = 2}};
    const std::vector<SpikeEvent> spikes = {{.time = milliseconds{101}, .neuron = 3}};
    const std::vector<SyncEdge> edges = {{.time = milliseconds{100}, .line = 2, .level = 1},
                                         {.time = milliseconds{105}, .line = 2, .level = 0},
                                         {.time = milliseconds{110}, .line = 2, .level = 1}};
    ASSERT_TRUE(
        (*sink)->write({.samples = samples, .edges = edges, .spikes = spikes, .ticks = ticks}));
    ASSERT_TRUE((*sink)->close());
  }
  const Hdf5Reader file(path);
  EXPECT_EQ(file.numbers("/stimulus/presentation/depth/data"), (Numbers{0.0, 1.0, 1.0}));
  EXPECT_EQ(file.numbers("/intervals/contacts/stop_time"), Numbers{0.002});
  EXPECT_EQ(file.numbers("/intervals/trials/stop_time"), Numbers{0.002});
  EXPECT_EQ(file.numbers("/intervals/sync/start_time"), Numbers{0.0});
  EXPECT_EQ(file.numbers("/intervals/sync/stop_time"), Numbers{0.005});
}

TEST(NwbSink, EachSeriesHasAPathWhateverColumnsAndElectrodesAreCalled) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s.nwb");
  SinkSetup setup = setup_with({"E1", "E1_sent"});
  const std::vector<std::string> columns = {
      "depth", "a/b", "a_b", ".", "", "t_\xB0", "electrode_E1_stop"};
  setup.run.probes = {
      {.uri = "p", .name = "p", .channels = ProbeSample::kDepth, .extra_columns = columns}};
  {
    const auto sink = open_sink("nwb:" + path, setup);
    ASSERT_TRUE(sink) << sink.error().sentence;
    const std::vector<DeliveredSample> samples = {
        {.sample = {.time = milliseconds{10}, .depth_mm = 0.5, .channels = ProbeSample::kDepth},
         .further = {1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0}}};
    const std::vector<StimulationCommand> commands = {
        {.time = milliseconds{10}, .amplitude_uA = 20.0, .electrode = 1}};
    const std::vector<SentCommand> sent = {
        {.command = {.time = milliseconds{10}, .amplitude_uA = 30.0}}};
    ASSERT_TRUE((*sink)->write({.samples = samples, .commands = commands, .sent = sent}));
    const auto closed = (*sink)->close();
    ASSERT_TRUE(closed) << closed.error().sentence;
  }
  const Hdf5Reader file(path);
  const std::string series = "/stimulus/presentation/";
  EXPECT_EQ(file.numbers(series + "depth/data"), Numbers{0.5});
  EXPECT_EQ(file.numbers(series + "depth_2/data"), Numbers{1.0});
  EXPECT_EQ(file.text(series + "depth_2", "description"),
            "the column \"depth\" of the recording, not used by the model");
  EXPECT_EQ(file.numbers(series + "a_b/data"), Numbers{2.0});
  EXPECT_EQ(file.numbers(series + "a_b_2/data"), Numbers{3.0});
  EXPECT_EQ(file.numbers(series + "._2/data"), Numbers{4.0});
  EXPECT_EQ(file.numbers(series + "_2/data"), Numbers{5.0});
  EXPECT_EQ(file.text(series + "t_\xEF\xBF\xBD", "description"),
            "the column \"t_\xEF\xBF\xBD\" of the recording, not used by the model");
  EXPECT_EQ(file.numbers(series + "electrode_E1_stop_2/data"), Numbers{7.0});
  EXPECT_EQ(file.numbers(series + "electrode_E1_sent_amplitude/data"), Numbers{20.0});
  EXPECT_EQ(file.numbers(series + "electrode_E1_sent_amplitude_2/data"), Numbers{30.0});
}

TEST(NwbSink, AnOutageIsTheTimeBeforeItsResume) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s.nwb");
  {
    const auto sink = open_sink("nwb:" + path, setup_with({}));
    ASSERT_TRUE(sink) << sink.error().sentence;
    using Event = LoopEvent::Kind;
    const std::vector<LoopEvent> events = {
        {.time = milliseconds{1050}, .kind = Event::kRelease},
        {.time = milliseconds{1800}, .length = milliseconds{800}, .kind = Event::kResume},
        {.time = milliseconds{3000}, .length = milliseconds{500}, .kind = Event::kZeroCertain},
        {.time = milliseconds{4000}, .length = milliseconds{250}, .kind = Event::kGap}};
    ASSERT_TRUE((*sink)->write({.events = events}));
    ASSERT_TRUE((*sink)->close());
  }
  const Hdf5Reader file(path);
  EXPECT_EQ(file.numbers("/intervals/events/start_time"), (Numbers{1.0, 1.05, 2.5, 4.0}));
  EXPECT_EQ(file.numbers("/intervals/events/stop_time"), (Numbers{1.8, 1.05, 3.0, 4.25}));
}

/// Of a trace with its zero at a stimulus, or of a rig that began before that of the first session.
TEST(NwbSink, IntervalsBeforeTimeZeroKeepTheirTimes) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s.nwb");
  SinkSetup setup = setup_with({});
  setup.run.probes = {{.uri = "p", .name = "p", .channels = ProbeSample::kDepth}};
  {
    const auto sink = open_sink("nwb:" + path, setup);
    ASSERT_TRUE(sink) << sink.error().sentence;
    std::vector<DeliveredSample> samples;
    for (const int ms : {-4000, -3000, -1000, 500}) {
      samples.push_back({.sample = {.time = milliseconds{ms},
                                    .depth_mm = ms == -3000 ? 1.0 : 0.0,
                                    .channels = ProbeSample::kDepth}});
    }
    const std::vector<SyncEdge> edges = {{.time = milliseconds{-2000}, .line = 1, .level = 1},
                                         {.time = milliseconds{250}, .line = 1, .level = 0}};
    ASSERT_TRUE((*sink)->write({.samples = samples, .edges = edges}));
    ASSERT_TRUE((*sink)->close());
  }
  const Hdf5Reader file(path);
  for (const std::string table : {"/intervals/contacts", "/intervals/trials"}) {
    EXPECT_EQ(file.numbers(table + "/start_time"), Numbers{-3.0});
    EXPECT_EQ(file.numbers(table + "/stop_time"), Numbers{-1.0});
  }
  EXPECT_EQ(file.numbers("/intervals/sync/start_time"), Numbers{-2.0});
  EXPECT_EQ(file.numbers("/intervals/sync/stop_time"), Numbers{0.25});
}

/// Writes the commands to a new file and does not close it, as a kill.
void kill_while_writing(const std::string& path) {
  SinkSetup setup = setup_with({"E1", "E2"});
  setup.run.facts = {{"version", "old"}, {"scene_text", std::string(5000, 'x')}};
  const auto killed = open_sink("nwb:" + path, setup);
  ASSERT_TRUE(killed) << killed.error().sentence;
  ASSERT_TRUE((*killed)->write({.commands = nwb_commands()}));
  ASSERT_TRUE((*killed)->flush());
}

TEST(NwbSink, AKilledRunLeavesASessionFromWhichTheFileIsMade) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s.nwb");
  kill_while_writing(path);
  SinkSetup setup = setup_with({"E1", "E2"});
  setup.journal = std::make_shared<SessionJournal>(path + ".journal.xdf.part");
  const auto sink = open_sink("nwb:" + path, setup);
  ASSERT_TRUE(sink) << sink.error().sentence;
  ASSERT_TRUE((*sink)->close());
  expect_series_of_commands(Hdf5Reader(path));
}

TEST(NwbSink, TheNextRunKeepsTheSessionOfAKilledOneAndSaysHowToExportIt) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s.nwb");
  kill_while_writing(path);
  std::string notices;
  SinkSetup setup = setup_with({});
  setup.notice = [&](const std::string& sentence) { notices += sentence; };
  ASSERT_TRUE(open_sink("nwb:" + path, setup));
  EXPECT_NE(notices.find("s.nwb.journal.recovered-"), std::string::npos) << notices;
  EXPECT_NE(notices.find("merkel export SESSION --sink nwb:FILE"), std::string::npos) << notices;
}

TEST(NwbSink, ARunWhoseFileCannotBeMadeKeepsItsSession) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s.nwb");
  const auto sink = open_sink("nwb:" + path, setup_with({"E1", "E2"}));
  ASSERT_TRUE(sink) << sink.error().sentence;
  ASSERT_TRUE((*sink)->write({.commands = nwb_commands()}));
  static_cast<void>(folder.file("s.nwb", "mine"));  // appears during the run
  const auto closed = (*sink)->close();
  ASSERT_FALSE(closed);
  EXPECT_NE(closed.error().sentence.find("merkel export " + path + ".journal.xdf --sink 'nwb:"),
            std::string::npos)
      << closed.error().sentence;
  EXPECT_NE(closed.error().sentence.find("created during the run and is not replaced"),
            std::string::npos)
      << closed.error().sentence;
  EXPECT_EQ(closed.error().sentence.find("space"), std::string::npos) << closed.error().sentence;
  SinkSetup setup = setup_with({"E1", "E2"});
  setup.overwrite = true;
  setup.journal = std::make_shared<SessionJournal>(path + ".journal.xdf");
  const auto again = open_sink("nwb:" + path, setup);
  ASSERT_TRUE(again) << again.error().sentence;
  ASSERT_TRUE((*again)->close());
  expect_series_of_commands(Hdf5Reader(path));
}

TEST(NwbSink, IsMadeFromTheSessionThatTheRunRecordsWhateverIsClosedFirst) {
  const TemporaryFolder folder;
  const std::vector<std::string> uris = {"nwb:" + folder.path("s.nwb"),
                                         "xdf:" + folder.path("s.xdf")};
  auto sinks = open_sinks(uris, setup_with({"E1", "E2"}));
  ASSERT_TRUE(sinks) << sinks.error().sentence;
  const auto commands = nwb_commands();
  for (const auto& sink : *sinks) ASSERT_TRUE(sink->write({.commands = commands}));
  std::thread nwb([&] { EXPECT_TRUE((*sinks)[0]->close()); });
  EXPECT_TRUE((*sinks)[1]->close());
  nwb.join();
  expect_series_of_commands(Hdf5Reader(folder.path("s.nwb")));
  EXPECT_FALSE(std::filesystem::exists(folder.path("s.nwb.journal.xdf.part")));
}

TEST(NwbSink, SaysWhySoonWhenTheSessionOfTheRunFails) {
  const TemporaryFolder folder;
  const std::vector<std::string> uris = {"xdf:" + folder.path("s.xdf"),
                                         "nwb:" + folder.path("s.nwb")};
  auto sinks = open_sinks(uris, setup_with({"E1", "E2"}));
  ASSERT_TRUE(sinks) << sinks.error().sentence;
  (*sinks)[0].reset();
  const auto closed = (*sinks)[1]->close();
  ASSERT_FALSE(closed);
  EXPECT_NE(closed.error().sentence.find("s.xdf was not completed"), std::string::npos)
      << closed.error().sentence;
}

}  // namespace
}  // namespace merkel
