#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#ifdef MERKEL_TEST_SONATA
#include <hdf5.h>
#endif

#include "drivers/protocols/trace_file.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "drivers/spike_files/spike_file.hpp"
#include "tests/drivers/files/fault_injection.hpp"
#include "tests/temporary_folder.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr int kPortions = 4;
constexpr int kPerPortion = 50;

SinkSetup setup() {
  return {.neurons = 20,
          .overwrite = false,
          .allow_remote = false,
          .run = {.scene = "test", .facts = {{"tick_ns", "1000000"}}, .model = {}}};
}

SpikeEvent spike(int number) {
  return {.time = milliseconds{1000 + number},
          .neuron = static_cast<std::uint32_t>(1 + number % 20)};
}

/// A whole run into a sink; the run starts at 1 s. \return the first error, or an empty string
std::string run_into(const std::string& uri) {
  auto sink = open_sink(uri, setup());
  if (!sink) return sink.error().sentence;
  std::string error;
  const auto keep = [&](const Expected<void, SinkError>& result) {
    if (!result && error.empty()) error = result.error().sentence;
    return result.has_value();
  };
  if (!keep((*sink)->begin({.start = milliseconds{1000}, .utc = std::chrono::hours{1}}))) {
    return error;
  }
  for (int portion = 0; portion < kPortions; ++portion) {
    std::vector<SpikeEvent> spikes;
    std::vector<DeliveredSample> samples;
    for (int i = 0; i < kPerPortion; ++i) {
      spikes.push_back(spike(portion * kPerPortion + i));
      samples.push_back({.sample = {.time = spikes.back().time,
                                    .arrival = spikes.back().time,
                                    .depth_mm = 0.5,
                                    .channels = ProbeSample::kDepth}});
    }
    if (!keep((*sink)->write({.samples = samples, .spikes = spikes})) || !keep((*sink)->flush())) {
      return error;
    }
  }
  keep((*sink)->close());
  return error;
}

/// Checks that a text holds complete rows of the first spikes. \return their number
int check_rows(const std::string& text, char separator, int neuron_column, int first_neuron) {
  int rows = 0;
  std::size_t begin = 0;
  while (begin < text.size()) {
    const auto end = text.find('\n', begin);
    EXPECT_NE(end, std::string::npos) << "half a row: " << text.substr(begin);
    if (end == std::string::npos) break;
    const std::string line = text.substr(begin, end - begin);
    begin = end + 1;
    if (line.starts_with('#') || line.starts_with("time")) continue;
    const auto comma = line.find(separator);
    EXPECT_NE(comma, std::string::npos) << line;
    if (comma == std::string::npos) break;
    const std::string neuron = neuron_column == 0 ? line.substr(0, comma) : line.substr(comma + 1);
    EXPECT_EQ(std::stoi(neuron), rows % 20 + first_neuron) << line;
    ++rows;
  }
  return rows;
}

int check_session(const std::string& path) {
  auto session = SessionReader::open(path);
  if (!session) return 0;  // truncated before its header
  int spikes = 0;
  SessionChunk chunk;
  for (;;) {
    const auto more = session->next(chunk);
    EXPECT_TRUE(more) << more.error().sentence;
    if (!more || !*more) return spikes;
    for (const SpikeEvent& each : chunk.spikes) EXPECT_EQ(each, spike(spikes++));
  }
}

/// The values of a NumPy file of whole numbers; as many as its header gives.
std::vector<std::int64_t> npy_values(const std::string& path, std::size_t bytes) {
  const std::string file = read_file(path);
  std::vector<std::int64_t> values;
  const auto shape = file.find("'shape': (");
  if (shape == std::string::npos) return values;
  const auto count = static_cast<std::size_t>(std::stoul(file.substr(shape + 10)));
  EXPECT_LE(128 + count * bytes, file.size()) << path;
  for (std::size_t i = 0; i < count && 128 + (i + 1) * bytes <= file.size(); ++i) {
    std::int64_t value = 0;
    std::memcpy(&value, file.data() + 128 + i * bytes, bytes);
    values.push_back(value);
  }
  return values;
}

std::string finished_or_part(const std::string& path) {
  return std::filesystem::exists(path) ? path : path + ".part";
}

/// The file of a format that is made at the end of the run, else the session that it is made from.
template <class Check>
int check_export(const std::string& path, const Check& check) {
  if (std::filesystem::exists(path)) return check();
  return check_session(finished_or_part(path + ".journal.xdf"));
}

int check_phy(const std::string& folder) {
  return check_export(folder, [&] {
    const auto times = npy_values(folder + "/spike_times.npy", 8);
    const auto clusters = npy_values(folder + "/spike_clusters.npy", 4);
    EXPECT_EQ(times.size(), clusters.size());
    for (std::size_t i = 0; i < times.size(); ++i) {
      EXPECT_EQ(times[i], static_cast<std::int64_t>(i) * 1000);  // µs from the run's start
      EXPECT_EQ(clusters[i], static_cast<std::int64_t>(i % 20 + 1));
    }
    return static_cast<int>(times.size());
  });
}

#ifdef MERKEL_TEST_SONATA
int check_nwb(const std::string& path) {
  return check_export(path, [&] {
    const auto spikes = read_spike_file(path);
    EXPECT_TRUE(spikes) << spikes.error().sentence;
    return spikes ? static_cast<int>(spikes->spikes.size()) : 0;
  });
}

int check_sonata(const std::string& path) {
  return check_export(path, [&] {
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    EXPECT_GE(file, 0) << path;
    const hid_t nodes = H5Dopen2(file, "/spikes/merkel/node_ids", H5P_DEFAULT);
    const hid_t space = H5Dget_space(nodes);
    const auto count = static_cast<int>(H5Sget_simple_extent_npoints(space));
    H5Sclose(space);
    H5Dclose(nodes);
    H5Fclose(file);
    return count;
  });
}
#endif

struct Format {
  const char* scheme;
  int (*check)(
      const std::string& path);  ///< checks the content of a path; returns the number of spikes
};

const std::vector<Format>& formats() {
  static const std::vector<Format> all = {
      {"csv",
       [](const std::string& path) {
         return check_rows(read_file(finished_or_part(path)), ',', 1, 1);
       }},
      {"gdf",
       [](const std::string& path) {
         return check_rows(read_file(finished_or_part(path)), '\t', 0, 1);
       }},
      {"xdf", [](const std::string& path) { return check_session(finished_or_part(path)); }},
      {"phy", check_phy},
#ifdef MERKEL_TEST_SONATA
      {"sonata", check_sonata},
      {"nwb", check_nwb},
#endif
      {"trace", [](const std::string& path) {
         const std::string text = read_file(finished_or_part(path));
         EXPECT_TRUE(text.empty() || text.back() == '\n') << text;
         return static_cast<int>(std::count(text.begin(), text.end(), '.')) / 2;
       }}};
  return all;
}

class DurableFiles : public testing::TestWithParam<std::size_t> {};

TEST_P(DurableFiles, EveryFailingCallIsAnErrorAndCostsNoSpikeThatWasFlushed) {
  const Format& format = formats()[GetParam()];
  constexpr int kAll = kPortions * kPerPortion;
  for (const int error : {ENOSPC, EIO}) {
    int before = 0;
    int call = 0;
    for (; call < 500; ++call) {
      const TemporaryFolder folder;
      const std::string path = folder.path("s");
      std::string said;
      bool happened = false;
      {
        const FaultInjection fault(call, error);
        said = run_into(format.scheme + (":" + path));
        happened = FaultInjection::happened();
      }
      if (!happened) {
        EXPECT_EQ(said, "");
        EXPECT_EQ(format.check(path), kAll);
        EXPECT_FALSE(std::filesystem::exists(path + ".part"));
        EXPECT_FALSE(std::filesystem::exists(path + ".journal.xdf"));
        break;
      }
      EXPECT_NE(said, "") << format.scheme << " call " << call;
      // Nothing is said to be kept in a folder that is gone.
      EXPECT_TRUE(said.find("data is in " + path + "/") == std::string::npos ||
                  std::filesystem::exists(path))
          << said;
      const int spikes = format.check(path);
      EXPECT_GE(spikes, before) << format.scheme << " call " << call << ": " << said;
      EXPECT_LE(spikes, kAll);
      before = spikes;
      // The file of a killed or failed run does not block the next run.
      if (!std::filesystem::exists(path)) {
        EXPECT_EQ(run_into(format.scheme + (":" + path)), "");
        EXPECT_EQ(format.check(path), kAll);
      }
    }
    EXPECT_GT(call, 3) << format.scheme;
    EXPECT_LT(call, 500) << format.scheme;
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, DurableFiles, testing::Range(std::size_t{0}, formats().size()),
                         [](const auto& entry) { return formats()[entry.param].scheme; });

}  // namespace
}  // namespace merkel
