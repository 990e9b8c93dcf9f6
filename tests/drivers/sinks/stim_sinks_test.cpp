// The sinks of stimulation commands as CSV and over ZeroMQ.
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <zmq.hpp>

#include "drivers/clock/clock_pair.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "drivers/sinks/stimulation_text.hpp"
#include "tests/drivers/sinks/sent_commands.hpp"
#include "tests/free_ports.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;

TEST(StimCsvSink, WritesOneRowACommand) {
  const TemporaryFolder folder;
  const std::string path = folder.path("commands.csv");
  {
    const auto sink = open_sink("stim-csv:" + path, stim_setup());
    ASSERT_TRUE(sink) << sink.error().sentence;
    EXPECT_FALSE((*sink)->takes<SpikeEvent>());
    ASSERT_TRUE((*sink)->write({.sent = commands()}));
    EXPECT_EQ((*sink)->delivered(), 0U);  // no spike
    ASSERT_TRUE((*sink)->close());
  }
  std::ifstream file(path);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}),
            "time_s,electrode,kind,amplitude_uA,frequency_Hz,heartbeat,stop,sent_monotonic_ns,"
            "valid_until_ns\n"
            "0.003200001,E2,pulse,80,0,0,,500000000,560000000\n"
            "0.010000000,E1,update,0.3333333333333333,55.5,1,,500000000,560000000\n"
            "0.010000000,E2,update,0,0,1,gap,500000000,560000000\n");
}

TEST(StimCsvSink, EachRowIsInTheFileOnceAndAtOnceInTheTimeAskedFor) {
  const TemporaryFolder folder;
  const std::string path = folder.path("commands.csv");
  const auto text_of = [](const std::string& name) {
    std::ifstream file(name);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const auto sink = open_sink("stim-csv:" + path + "?time=run", stim_setup());
  ASSERT_TRUE(sink) << sink.error().sentence;
  ASSERT_TRUE((*sink)->begin({.start = milliseconds{2}, .utc = {}}));
  ASSERT_TRUE((*sink)->write({}));
  std::string rows = StimulationText::csv_header() + "\n";
  const auto all = commands();
  ASSERT_TRUE((*sink)->write({.sent = std::span(all).first(1)}));
  rows += "0.001200001,E2,pulse,80,0,0,,500000000,560000000\n";
  EXPECT_EQ(text_of(path + ".part"), rows);
  ASSERT_TRUE((*sink)->write({.sent = std::span(all).subspan(2)}));
  rows += "0.008000000,E2,update,0,0,1,gap,500000000,560000000\n";
  EXPECT_EQ(text_of(path + ".part"), rows);
  ASSERT_TRUE((*sink)->close());
  EXPECT_EQ(text_of(path), rows);
  EXPECT_TRUE(has(text_of(path + ".time"), "time_zero = run\n")) << text_of(path + ".time");
}

TEST(StimCsvSink, ARunThatEndsWithoutACommandLeavesNoPartOfAFile) {
  const TemporaryFolder folder;
  {
    const auto sink = open_sink("stim-csv:" + folder.path("commands.csv"), stim_setup());
    ASSERT_TRUE(sink) << sink.error().sentence;
    ASSERT_TRUE((*sink)->begin({}));
    ASSERT_TRUE((*sink)->flush());
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path("")));
}

TEST(StimCsvSink, KeepsTheConversionOfTimesThatItMayNotReplace) {
  const TemporaryFolder folder;
  const std::string uri = "stim-csv:" + folder.path("commands.csv") + "?time=run";
  {
    const auto other = OutputFile::create(folder.path("commands.csv.time"), false);
    ASSERT_TRUE(other);
    const auto sink = open_sink(uri, stim_setup());
    ASSERT_FALSE(sink);
    EXPECT_TRUE(has(sink.error().sentence, "commands.csv.time")) << sink.error().sentence;
  }
  const auto sink = open_sink(uri, stim_setup());
  ASSERT_TRUE(sink) << sink.error().sentence;
  static_cast<void>(folder.file("commands.csv.time", "kept"));  // appears during the run
  const auto begun = (*sink)->begin({.start = milliseconds{2}, .utc = {}});
  ASSERT_FALSE(begun);
  EXPECT_TRUE(has(begun.error().sentence, "commands.csv.time")) << begun.error().sentence;
}

TEST(StimSinks, RefuseWhatTheyDoNotKnowAndWhatExists) {
  const TemporaryFolder folder;
  const std::string path = folder.file("commands.csv", "kept");
  const auto refusal = [](const std::string& uri) {
    const auto sink = open_sink(uri, stim_setup());
    return sink ? "" : sink.error().sentence;
  };
  EXPECT_TRUE(has(refusal("stim-csv:" + path), "already exists")) << refusal("stim-csv:" + path);
  EXPECT_TRUE(has(refusal("stim-csv:" + folder.path("a.csv") + "?tme=run"), "tme"));
  EXPECT_TRUE(has(refusal("stim-zmq:tcp://127.0.0.1:25571?strem=a"), "strem"));
  EXPECT_TRUE(has(refusal("stim-zmq:tcp://192.0.2.1:25571"), "--allow-remote"));
}

/// Two electrodes whose every member differs from its default.
EncodingParameters rich_encoding() {
  EncodingParameters encoding = stim_setup().run.encoding;
  StimulationParameters& limits = encoding.stimulation;
  limits.update = milliseconds{20};
  limits.phase = std::chrono::microseconds{250};
  limits.interphase = std::chrono::microseconds{60};
  limits.polarity = Polarity::kAnodicFirst;
  limits.max_charge_nC = 20.0;
  limits.max_total_uA = 150.5;
  limits.max_slope_uA_per_s = 4000.0;
  limits.max_electrodes = 2;
  encoding.groups.emplace_back().pattern.name = "tip";
  Electrode& first = encoding.electrodes[0];
  first.field_mm = {15.0, 10.0, 2.5};
  first.group = 0;
  Electrode& second = encoding.electrodes[1];
  second.patch = 1;
  second.field_mm = {1.0, 2.0, 3.0};
  second.phase = std::chrono::microseconds{100};
  second.max_charge_nC = 8.0;
  second.max_slope_uA_per_s = 500.0;
  second.max_amplitude_uA = 60.0;
  return encoding;
}

TEST(StimulationText, SaysEveryMemberOfACommand) {
  const StimulationText text(rich_encoding());
  const auto members = [&](SentCommand sent) {
    std::string json;
    text.append_members(json, sent);
    return json;
  };
  auto all = commands();
  EXPECT_EQ(members(all[0]),
            R"("kind":"pulse","electrode":"E2","amplitude_uA":80,"frequency_Hz":0,"phase_us":100,)"
            R"("heartbeat":0,"stop":"","timestamp":0.003200001,"time_ns":3200001,)"
            R"("sent_monotonic_ns":500000000,"valid_until_ns":560000000)");
  all[2].command.electrode = 2;  // of none
  EXPECT_EQ(members(all[2]),
            R"("kind":"update","electrode":"unknown","amplitude_uA":0,"frequency_Hz":0,)"
            R"("phase_us":250,"heartbeat":1,"stop":"gap","timestamp":0.010000000,)"
            R"("time_ns":10000000,"sent_monotonic_ns":500000000,"valid_until_ns":560000000)");
}

TEST(StimulationText, SaysEveryMemberOfTheElectrodesAndTheirLimits) {
  EncodingParameters encoding = rich_encoding();
  EXPECT_EQ(encoding_members(encoding),
            R"("electrodes":[{"name":"E1","patch":0,"field_mm":[15,10,2.5],)"
            R"("amplitude_uA":[20,80],"frequency_Hz":[0,200],"group":"tip","phase_us":250,)"
            R"("second_phase_us":250,"max_charge_nC":20,"max_amplitude_uA":null,)"
            R"("max_slope_uA_per_s":4000},{"name":"E2","patch":1,"field_mm":[1,2,3],)"
            R"("amplitude_uA":[20,80],"frequency_Hz":[0,200],"phase_us":100,)"
            R"("second_phase_us":100,"max_charge_nC":8,"max_amplitude_uA":60,)"
            R"("max_slope_uA_per_s":500}],"update_ms":20,"phase_us":250,"interphase_us":60,)"
            R"("polarity":"anodic_first","max_charge_nC":20,"max_total_uA":150.5,)"
            R"("max_slope_uA_per_s":4000,"max_electrodes":2,"watchdog_ms":200)");
  encoding.stimulation.polarity = Polarity::kCathodicFirst;
  encoding.stimulation.max_slope_uA_per_s.reset();
  encoding.stimulation.max_electrodes.reset();
  const std::string none = encoding_members(encoding);
  EXPECT_TRUE(has(none, R"("polarity":"cathodic_first")")) << none;
  EXPECT_TRUE(has(none, R"("max_slope_uA_per_s":null,"max_electrodes":null)")) << none;
}

TEST(StimZmqSink, SendsItsElectrodesAndEveryCommandOnce) {
  const std::string endpoint = "tcp://127.0.0.1:" + std::to_string(free_ports(1).front());
  zmq::context_t context;
  zmq::socket_t subscriber(context, zmq::socket_type::sub);
  subscriber.set(zmq::sockopt::rcvtimeo, 30'000);
  subscriber.set(zmq::sockopt::subscribe, "");
  subscriber.connect(endpoint);
  SinkSetup setup = stim_setup();
  setup.run.encoding = rich_encoding();
  const auto sink =
      open_sink("stim-zmq:" + endpoint + "?stream=a\"b&subscribers=1&wait_s=30", setup);
  ASSERT_TRUE(sink) << sink.error().sentence;
  ASSERT_TRUE((*sink)->begin({.start = milliseconds{2}, .utc = std::chrono::nanoseconds{77}}));
  std::vector<SentCommand> sent = commands();
  const ClockPair now = read_clock_pair();
  sent[0].sent = now.monotonic - std::chrono::hours{1};
  sent[1].sent = {};
  ASSERT_TRUE((*sink)->write({.sent = sent}));
  ASSERT_TRUE((*sink)->close());
  const StimulationText text(setup.run.encoding);
  for (std::size_t k = 0; k < sent.size(); ++k) {
    zmq::message_t head;
    zmq::message_t body;
    ASSERT_TRUE(subscriber.recv(head));
    ASSERT_TRUE(subscriber.recv(body));
    EXPECT_EQ(head.to_string(), std::string("d\0", 2));
    std::string expected = R"({"event_type":"stimulation","stream":"a\"b",)";
    text.append_members(expected, sent[k]);
    expected += R"(,"seq":)" + std::to_string(k) + R"(,"sent_utc_ns":)";
    const std::string json = body.to_string();
    ASSERT_TRUE(json.starts_with(expected)) << json;
    // Converted by clocks that are read when the command is sent.
    const std::chrono::nanoseconds utc{std::stoll(json.substr(expected.size()))};
    const auto wanted = now.utc - (k == 0 ? std::chrono::hours{1} : std::chrono::nanoseconds{0});
    EXPECT_TRUE(k >= 2 || std::chrono::abs(utc - wanted) < std::chrono::minutes{5}) << json;
    EXPECT_TRUE(json.ends_with("}")) << json;
  }
  EXPECT_TRUE(open_sink("stim-zmq:" + endpoint, setup)) << "the address is free after close()";
}

TEST(StimZmqSink, AFullQueueOfASubscriberIsAnError) {
  const std::string endpoint = "tcp://127.0.0.1:" + std::to_string(free_ports(1).front());
  zmq::context_t context;
  zmq::socket_t subscriber(context, zmq::socket_type::sub);
  subscriber.set(zmq::sockopt::rcvhwm, 1);
  subscriber.set(zmq::sockopt::subscribe, "");
  subscriber.connect(endpoint);
  const auto sink =
      open_sink("stim-zmq:" + endpoint + "?hwm=1&subscribers=1&wait_s=30", stim_setup());
  ASSERT_TRUE(sink) << sink.error().sentence;
  ASSERT_TRUE((*sink)->begin({}));
  std::string sentence;
  for (int k = 0; k < 1'000'000 && sentence.empty(); ++k) {
    const auto written = (*sink)->write({.sent = commands()});
    if (!written) sentence = written.error().sentence;
  }
  EXPECT_TRUE(has(sentence, "the queue of a subscriber is full, so stimulation was stopped"))
      << sentence;
}

TEST(StimZmqSink, TellsItsElectrodesToWhoeverSubscribesToThem) {
  const std::string endpoint = "tcp://127.0.0.1:" + std::to_string(free_ports(1).front());
  const auto sink = open_sink("stim-zmq:" + endpoint, stim_setup());
  ASSERT_TRUE(sink) << sink.error().sentence;
  ASSERT_TRUE((*sink)->begin({.start = milliseconds{2}, .utc = std::chrono::nanoseconds{77}}));
  zmq::context_t context;
  zmq::socket_t subscriber(context, zmq::socket_type::sub);
  subscriber.set(zmq::sockopt::rcvtimeo, 20);
  subscriber.set(zmq::sockopt::subscribe, "\x02M");
  subscriber.connect(endpoint);
  zmq::message_t head;
  for (int k = 0; k < 1000 && head.size() == 0; ++k) {
    ASSERT_TRUE((*sink)->flush());
    static_cast<void>(subscriber.recv(head));
  }
  EXPECT_EQ(head.to_string(), "\x02M");
  zmq::message_t body;
  ASSERT_TRUE(subscriber.recv(body));
  EXPECT_EQ(body.to_string(), R"({"event_type":"stimulation_start","stream":"merkel",)"
                              R"("start_device_ns":2000000,"start_utc_ns":77,)" +
                                  encoding_members(stim_setup().run.encoding) + "}");
}

TEST(StimSinks, ThoseWithThreadsOfATransportNameThem) {
  SinkSetup setup = stim_setup();
  const auto one = open_sink("stim-zmq:tcp://127.0.0.1:25574", setup);
  const auto other = open_sink("stim-zmq:tcp://127.0.0.1:25575", setup);
  ASSERT_TRUE(one && other);
  const auto threads = (*one)->transport_threads();
  ASSERT_FALSE(threads.empty());
  for (const pid_t thread : threads) {
    EXPECT_TRUE(std::filesystem::exists("/proc/self/task/" + std::to_string(thread)));
    for (const pid_t of_other : (*other)->transport_threads()) EXPECT_NE(thread, of_other);
  }
}

TEST(StimSinks, NeedElectrodes) {
  SinkSetup none = stim_setup();
  none.run.encoding.electrodes.clear();
  for (const char* const uri : {"stim-csv:commands.csv", "stim-zmq:tcp://127.0.0.1:25571"}) {
    const auto sink = open_sink(uri, none);
    ASSERT_FALSE(sink);
    EXPECT_NE(sink.error().sentence.find("the scene has no electrodes"), std::string::npos) << uri;
  }
}

}  // namespace
}  // namespace merkel
