#include "drivers/sinks/open_sink.hpp"

#include <array>
#include <filesystem>
#include <regex>
#include <set>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "drivers/sessions/afferent_table.hpp"
#include "drivers/sinks/json_line.hpp"
#include "drivers/transports/host_name.hpp"
#include "tests/free_ports.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"

namespace merkel {
namespace {

const std::uint32_t kNeurons = 20;

SinkSetup setup(bool overwrite = false, bool allow_remote = false) {
  return {.neurons = kNeurons, .overwrite = overwrite, .allow_remote = allow_remote, .run = {}};
}

std::string refusal(const std::string& uri, const SinkSetup& with = setup()) {
  const auto sink = open_sink(uri, with);
  return sink ? "" : sink.error().sentence;
}

TEST(OpenSink, AnUnknownSchemeListsTheKnown) {
  const std::string sentence = refusal("drain:x");
  for (const char* scheme :
       {"csv:", "gdf:", "phy:", "sonata:", "nwb:", "xdf:", "zmq:", "osc:", "lsl:", "view:"}) {
    EXPECT_TRUE(has(sentence, scheme)) << scheme;
  }
}

TEST(OpenSink, TheHelpNamesEveryOption) {
  const TemporaryFolder folder;
  std::istringstream help(sink_options_help());
  std::size_t compared = 0;
  for (std::string line; std::getline(help, line);) {
    const auto options = line.find(": ");
    if (!line.starts_with("  ") || options == std::string::npos) continue;
    std::string uri = line.substr(2, options - 2);
    if (const auto file = uri.find(":FILE"); file != std::string::npos) {
      uri.replace(file + 1, 4, folder.path("x"));
    }
    const std::string sentence = refusal(uri + "?foo=1");
    const std::string known = "the known ones are: ";
    const auto place = sentence.find(known);
    if (place == std::string::npos) continue;  // the sink was not built, or needs electrodes
    const auto names = [](const std::string& text) {
      const std::string bare = std::regex_replace(text, std::regex(" [(][^)]*[)]"), "");
      const std::regex name("[a-z_]+");
      return std::set<std::string>(std::sregex_token_iterator(bare.begin(), bare.end(), name), {});
    };
    EXPECT_EQ(names(line.substr(options + 2)), names(sentence.substr(place + known.size())))
        << line;
    ++compared;
  }
  EXPECT_GE(compared, 6U);
}

TEST(OpenSink, OtherMachinesNeedToBeAllowed) {
  for (const char* uri : {"zmq:tcp://0.0.0.0:45557", "zmq:tcp://*:45557", "osc:192.0.2.1:9000",
                          "osc:127.evil.example:9000", "view:0.0.0.0:45558"}) {
    EXPECT_TRUE(has(refusal(uri), "--allow-remote")) << uri;
  }
  EXPECT_EQ(refusal("osc:192.0.2.1:9000", setup(false, true)), "");
  EXPECT_TRUE(
      has(refusal("osc:no.such.host.invalid:9000", setup(false, true)), "cannot find the host"));
}

TEST(OpenSink, TheLabStreamingLayerIsOpenedOrSaysWhatIsMissing) {
  // A missing library is reported before a missing permission.
  const std::string sentence = refusal("lsl:spikes");
  EXPECT_TRUE(has(sentence, "run tools/install_liblsl") || has(sentence, "--allow-remote"))
      << sentence;
}

TEST(OpenSink, AddressesAreRefusedWithHowToWriteThem) {
  EXPECT_TRUE(has(refusal("zmq:127.0.0.1:5557"), "zmq:tcp://127.0.0.1:5557"));
  EXPECT_TRUE(has(refusal("zmq:tcp://127.0.0.1"), "zmq:tcp://127.0.0.1:5557"));
  EXPECT_TRUE(has(refusal("osc:9000"), "osc:127.0.0.1:9000"));
  EXPECT_TRUE(has(refusal("osc:127.0.0.1:9000?path=spike"), "/merkel/spike"));
  EXPECT_TRUE(has(refusal("view:none"), "view:8080"));
  EXPECT_TRUE(has(refusal("view:70000"), "view:8080"));
  EXPECT_TRUE(has(refusal("zmq:tcp://127.0.0.1:5557?hwm=-1"), "option hwm"));
  // The table of node types is separated by blanks.
  EXPECT_TRUE(has(refusal("sonata:s.h5?population=left hand"), "without /, ., quotes and blanks"));
}

TEST(OpenSink, AFileOrFolderThatExistsNeedsOverwrite) {
  const TemporaryFolder folder;
  for (const char* scheme : {"csv:", "gdf:", "sonata:", "nwb:", "xdf:", "phy:"}) {
    const std::string name = std::string("a.") + std::string(scheme).substr(0, 3);
    if (std::string_view(scheme) == "phy:") {
      std::filesystem::create_directory(folder.path(name));
    } else {
      static_cast<void>(folder.file(name, "mine"));
    }
    EXPECT_TRUE(has(refusal(scheme + folder.path(name)), "already exists: add --overwrite"))
        << scheme;
    EXPECT_EQ(refusal(scheme + folder.path(name), setup(true)), "") << scheme;
    EXPECT_TRUE(has(refusal(scheme + folder.path("none/a")), "first")) << scheme;
  }
  EXPECT_EQ(refusal("phy:" + folder.path("new/")), "");
}

TEST(OpenSink, EveryFileHasItsSpikesDeliveredOnceItIsClosed) {
  const TemporaryFolder folder;
  for (const std::string scheme : {"csv", "gdf", "xdf", "phy", "trace"}) {
    auto sink = open_sink(scheme + ":" + folder.path(scheme), setup());
    ASSERT_TRUE(sink) << sink.error().sentence;
    const SpikeEvent spikes[] = {{.time = std::chrono::milliseconds{1}, .neuron = 1},
                                 {.time = std::chrono::milliseconds{2}, .neuron = 20}};
    for (int k = 0; k < 3; ++k) EXPECT_TRUE((*sink)->write({.spikes = spikes})) << scheme;
    EXPECT_TRUE((*sink)->close()) << scheme;
    EXPECT_EQ((*sink)->delivered(), 6U) << scheme;
  }
}

TEST(OpenSink, AFolderOfPhyThatCannotBeReplacedHasNoTimesBesideOtherFilesOfAnotherRun) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder.path("p/spike_clusters.npy"));  // cannot be written
  static_cast<void>(folder.file("p/spike_times.npy", "of an earlier run"));
  const auto sink = open_sink("phy:" + folder.path("p"), setup(true));
  ASSERT_TRUE(sink) << sink.error().sentence;
  EXPECT_FALSE((*sink)->close());
  EXPECT_TRUE(std::filesystem::exists(folder.path("p/params.py")));
  EXPECT_FALSE(std::filesystem::exists(folder.path("p/spike_times.npy")));
}

TEST(AfferentTable, HasARowForEachNeuronOfTheModel) {
  SinkSetup of_model = setup();
  const auto rows = afferents_of(of_model);
  ASSERT_EQ(rows.size(), 20U);
  EXPECT_EQ(rows[19].number, 20U);
  EXPECT_TRUE(afferent_csv(rows).starts_with("neuron,patch,"));
  of_model.neurons = 0;  // without a simulation
  EXPECT_TRUE(afferents_of(of_model).empty());
}

TEST(OpenSink, ARefusedRunLeavesNoFiles) {
  const TemporaryFolder folder;
  for (const char* scheme : {"csv:", "gdf:", "sonata:", "nwb:", "xdf:", "phy:"}) {
    EXPECT_EQ(refusal(scheme + folder.path("a")), "") << scheme;
    EXPECT_TRUE(std::filesystem::is_empty(folder.path(""))) << scheme;
  }
  EXPECT_TRUE(has(refusal("csv:a?b=1"), "option b is unknown"));
}

TEST(OpenSink, APortInUseIsNamed) {
  const auto ports = free_ports(2);
  const std::string zmq_port = std::to_string(ports[0]);
  const auto zmq = open_sink("zmq:tcp://127.0.0.1:" + zmq_port, setup());
  ASSERT_TRUE(zmq) << zmq.error().sentence;
  EXPECT_TRUE(has(refusal("zmq:tcp://localhost:" + zmq_port), "in use"));
  const std::string page = "view:" + std::to_string(ports[1]);
  const auto view = open_sink(page, setup());
  ASSERT_TRUE(view) << view.error().sentence;
  EXPECT_TRUE(has(refusal(page), "in use"));
  EXPECT_TRUE(has(refusal(page), "view:" + std::to_string(ports[1] + 1)));
}

TEST(OpenSink, WithoutASubscriberInTimeSaysSo) {
  EXPECT_TRUE(has(refusal("zmq:tcp://127.0.0.1:" + std::to_string(free_ports(1)[0]) +
                          "?subscribers=1&wait_s=0.01"),
                  "in time"));
}

TEST(OpenSink, AFullDiskEndsASinkWithASentence) {
  for (const char* uri : {"csv:/dev/full", "gdf:/dev/full", "xdf:/dev/full"}) {
    auto sink = open_sink(uri, setup());
    ASSERT_TRUE(sink);
    const std::array<SpikeEvent, 1> spikes{SpikeEvent{.neuron = 1}};
    const auto written = (*sink)->write({.spikes = spikes});
    const auto flushed = written ? (*sink)->flush() : written;
    ASSERT_FALSE(flushed);
    EXPECT_TRUE(has(flushed.error().sentence, "No space left")) << flushed.error().sentence;
    EXPECT_EQ((*sink)->delivered(), 0U);
  }
  EXPECT_TRUE(has(refusal("sonata:/dev/full"), "only be written to a regular file"));
}

TEST(HostAndPort, KnowsThisMachine) {
  for (const char* text : {"127.0.0.1:1", "localhost:80", "[::1]:9000", "127.9.9.9:65535"}) {
    const auto address = HostAndPort::parse(text);
    ASSERT_TRUE(address) << text;
    EXPECT_TRUE(address->loopback()) << text;
  }
  for (const char* text : {"127.0.0.1.evil.example:80", "*:80", "10.0.0.1:80", "[::]:80"}) {
    const auto address = HostAndPort::parse(text);
    ASSERT_TRUE(address) << text;
    EXPECT_FALSE(address->loopback()) << text;
  }
  for (const char* text :
       {"", ":80", "localhost", "localhost:", "localhost:0", "localhost:65536", "localhost:8x"}) {
    EXPECT_FALSE(HostAndPort::parse(text)) << text;
  }
}

TEST(JsonString, IsValidWhateverComesIn) {
  EXPECT_EQ(json_string("a\"b\\c\nd\x01\xFF"), "\"a\\\"b\\\\c\\nd\\u0001\uFFFD\"");
  EXPECT_EQ(json_string("Müller 手 😀"), "\"Müller 手 😀\"");
  // Overlong, surrogate, beyond Unicode, truncated: invalid UTF-8.
  for (const char* text : {"\xC0\x80", "\xED\xA0\x80", "\xF4\x90\x80\x80", "\xE6\x89"}) {
    const std::string json = json_string(text);
    EXPECT_EQ(json.substr(0, 4), "\"\uFFFD") << json;
    EXPECT_TRUE(nlohmann::json::accept(json)) << json;
  }
}

}  // namespace
}  // namespace merkel
