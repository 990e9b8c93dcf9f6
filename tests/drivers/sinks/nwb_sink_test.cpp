// NWB files, read back with the HDF5 library. tests/readers/nwb_test.py reads whole runs.
#include <chrono>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <hdf5.h>

#include "drivers/sinks/open_sink.hpp"
#include "tests/temporary_folder.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using Kind = StimulationCommand::Kind;
using Stop = StimulationCommand::Stop;

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
  using Numbers = std::vector<double>;
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
    ASSERT_TRUE((*sink)->write({.commands = nwb_commands()}));
    ASSERT_TRUE((*sink)->close());
  }
  const Hdf5Reader file(path);
  expect_series_of_commands(file);
  EXPECT_EQ(file.text(kFirst + "amplitude/data", "unit"), "amperes");
  EXPECT_EQ(file.number(kFirst + "amplitude/data", "conversion"), 1e-6F);
  EXPECT_EQ(file.text(kFirst + "frequency/data", "unit"), "hertz");
  EXPECT_EQ(file.number(kFirst + "frequency/data", "conversion"), 1.0F);
  EXPECT_EQ(file.text(kSecond + "amplitude", "neurodata_type"), "TimeSeries");
  EXPECT_EQ(file.text(kSecond + "amplitude", "comments"),
            "field of radius 3 mm around x = 15 mm, y = 10 mm on patch 0; one phase lasts 200 µs");
}

TEST(NwbSink, WithoutElectrodesDoesNotRequestCommands) {
  const TemporaryFolder folder;
  const auto sink = open_sink("nwb:" + folder.path("s.nwb"), setup_with({}));
  ASSERT_TRUE(sink) << sink.error().sentence;
  EXPECT_FALSE((*sink)->takes<StimulationCommand>());
}

/// The recovered file in a folder.
std::string recovered_in(const std::string& folder) {
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().string().find(".recovered-") != std::string::npos) return entry.path();
  }
  return {};
}

TEST(NwbSink, ARecoveredFileHasTheDescriptionOfItsOwnRun) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s.nwb");
  {
    SinkSetup setup = setup_with({"E1", "E2"});
    setup.run.facts = {{"version", "old"}, {"scene_text", std::string(5000, 'x') + "\n\x01\xff"}};
    const auto killed = open_sink("nwb:" + path, setup);
    ASSERT_TRUE(killed) << killed.error().sentence;
    ASSERT_TRUE((*killed)->write({.commands = nwb_commands()}));
    ASSERT_TRUE((*killed)->flush());  // without close(), as after a kill
  }
  const auto next = open_sink("nwb:" + path, setup_with({"other"}));
  ASSERT_TRUE(next) << next.error().sentence;
  const std::string recovered = recovered_in(folder.path(""));
  ASSERT_FALSE(recovered.empty());
  const Hdf5Reader file(recovered);
  expect_series_of_commands(file);
  EXPECT_FALSE(file.has("/stimulus/presentation/electrode_other_amplitude"));
}

TEST(NwbSink, KeepsRowsThatItCannotConvert) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s.nwb");
  for (const char* const rows :
       {"s,0.1,1\n", "# content=[1]\ns,0.1,1\n", "# content={\ns,0.1,1\n"}) {
    std::ofstream(path + ".part") << rows;
    std::string notices;
    SinkSetup setup = setup_with({});
    setup.notice = [&](const std::string& sentence) { notices += sentence + "\n"; };
    ASSERT_TRUE(open_sink("nwb:" + path, setup));
    EXPECT_NE(notices.find("it does not describe its run, or is damaged"), std::string::npos)
        << notices;
    const std::string kept = recovered_in(folder.path(""));
    EXPECT_TRUE(kept.ends_with(".part")) << kept;
    std::filesystem::remove(kept);
  }
}

}  // namespace
}  // namespace merkel
