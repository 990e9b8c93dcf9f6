#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "drivers/clock/clock_pair.hpp"
#include "drivers/files/raw_bytes.hpp"
#include "drivers/sample_channels.hpp"
#include "drivers/sinks/json_line.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "drivers/sinks/stimulation_text.hpp"
#include "drivers/transports/redis_connection.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr int kMaxBins = 1000;
constexpr milliseconds kReplyPatience{1000};  ///< without electrodes
constexpr milliseconds kRejoinPatience{100};  ///< for a connection during a run
constexpr nanoseconds kFirstRejoin{50'000'000};
constexpr nanoseconds kMaxRejoin{1'000'000'000};

/// Adds entries to Redis streams in batches.
class StreamWriter {
 public:
  using Fields = std::vector<std::pair<std::string_view, std::string>>;

  /// \param patience  for a reply
  StreamWriter(Uri uri, bool allow_remote, milliseconds patience, std::int64_t longest)
      : uri_(std::move(uri)),
        allow_remote_(allow_remote),
        patience_(patience),
        longest_(std::to_string(longest)) {}

  /// \param patience  for the connection
  Expected<void, SetupError> connect(milliseconds patience) {
    auto made = connect_to_redis(uri_, allow_remote_, patience, patience_);
    if (!made) return Unexpected<SetupError>(made.error());
    connection_ = std::move(*made);
    return {};
  }
  /// Discards what waits.
  void disconnect() {
    connection_.reset();
    waiting_ = 0;
  }
  [[nodiscard]] bool connected() const noexcept { return connection_ != nullptr; }

  /// Queues an entry; there must be a connection. An error shows in settle().
  void add(const std::string& stream, const Fields& fields) {
    std::vector<std::string> arguments = {"XADD", stream, "MAXLEN", "~", longest_, "*"};
    for (const auto& [name, value] : fields) {
      arguments.emplace_back(name);
      arguments.push_back(value);
    }
    std::vector<const char*> texts;
    std::vector<std::size_t> sizes;
    for (const std::string& argument : arguments) {
      texts.push_back(argument.data());
      sizes.push_back(argument.size());
    }
    ++waiting_;
    redisAppendCommandArgv(connection_.get(), static_cast<int>(texts.size()), texts.data(),
                           sizes.data());
  }

  /// Sends the queued entries and reads all replies. \return the error, or nothing
  std::string settle() {
    std::string error;
    while (waiting_ > 0) {
      --waiting_;
      void* raw = nullptr;
      if (redisGetReply(connection_.get(), &raw) != REDIS_OK) return connection_->errstr;
      const RedisReply reply(static_cast<redisReply*>(raw));
      if (reply->type == REDIS_REPLY_ERROR && error.empty()) error.assign(reply->str, reply->len);
    }
    return error;
  }

 private:
  Uri uri_;
  bool allow_remote_;
  milliseconds patience_;
  RedisConnection connection_;
  std::string longest_;
  int waiting_ = 0;
};

/// A number as its bytes, little-endian: what NumPy reads by frombuffer.
template <class Number>
std::string bytes_of(Number number) {
  std::string bytes;
  append_raw(bytes, number);
  return bytes;
}

/// A run as entries of Redis streams, as a node of a BRAND graph writes them
/// (github.com/brandbci/brand, BRAND_spec and DataSyncGuidelines). Every entry of data has `ts`,
/// the monotonic time of sending in ns as a uint64, and `sync`, the probe time of the data as JSON.
/// NODE_samples gets the samples of the first probe, NODE_samples_1 those of the second, …;
/// NODE_spikes gets the spikes; NODE_counts the spikes per afferent and bin; NODE one entry per
/// update of the electrodes; NODE_pulses one per pulse; NODE_state the node's states.
///
/// If the server does not answer within the watchdog, restarts, or refuses entries, the sink
/// discards what comes, connects again with growing pauses, and begins with an off for all
/// electrodes. The run and its other sinks go on.
class RedisSink final : public Sink {
 public:
  RedisSink(std::string uri, std::string node, StreamWriter streams, const SinkSetup& setup,
            nanoseconds bin)
      : Sink(std::move(uri)),
        node_(std::move(node)),
        streams_(std::move(streams)),
        text_(setup.run.encoding),
        encoding_("{" + encoding_members(setup.run.encoding) + "}"),
        bin_(bin),
        counts_(setup.neurons),
        probes_(setup.run.probes) {}

  /// Connects and announces the node.
  [[nodiscard]] Expected<void, SetupError> open() {
    if (auto connected = streams_.connect(kReplyPatience); !connected) return connected;
    add_state("NODE_STARTED", {"parameters", encoding_});
    const std::string error = streams_.settle();
    if (error.empty()) return {};
    return unavailable("\"" + uri_ + "\": the Redis server refused: " + error);
  }

  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kKinds<SpikeEvent, SentCommand, TickRecord, DeliveredSample>;
  }
  void attach(RunControl& control) override { control_ = &control; }
  [[nodiscard]] bool interrupted() override { return std::exchange(interrupted_, is_away()); }

  [[nodiscard]] Expected<void, SinkError> begin(const RunOrigin& origin) override {
    bin_start_ = origin.start;
    add_state("NODE_READY");
    settle();
    return {};
  }

  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    if (!batch.ticks.empty()) newest_tick_ = batch.ticks.back().time;
    const bool was_away = is_away();
    if (was_away && !rejoin()) return {};
    for (std::uint32_t probe = 0; probe < probes_.size(); ++probe) {
      add_samples(probe, batch.samples);
    }
    add_spikes(batch.spikes);
    // Those that come with the end of an interruption are older than its off.
    if (!was_away) {
      for (const SentCommand& sent : batch.sent) add_command(sent);
    }
    // The ticks end bins without spikes.
    if (bin_.count() > 0 && !batch.ticks.empty()) end_bins(batch.ticks.back().time);
    if (settle()) delivered_ += batch.spikes.size();
    return {};
  }
  [[nodiscard]] Expected<void, SinkError> close() override {
    if (!is_away()) add_state("NODE_SHUTDOWN");
    if (!is_away() && settle()) return {};
    return Unexpected<SinkError>(
        {.sentence = uri_ + " failed: " + reason_ + "; check the Redis server and run again"});
  }

 private:
  /// One entry: the samples of a probe, with the channels that it measures.
  void add_samples(std::uint32_t probe, std::span<const DeliveredSample> samples) {
    std::string times;
    std::array<std::string, kProbeChannels.size()> values;
    nanoseconds newest{0};
    for (const DeliveredSample& item : samples) {
      if (item.probe != probe) continue;
      newest = item.sample.time;
      append_raw(times, std::int64_t{newest.count()});
      for (std::size_t i = 0; i < values.size(); ++i) {
        append_raw(values[i], kProbeChannels[i].of(item.sample));
      }
    }
    if (times.empty()) return;
    StreamWriter::Fields fields = {
        {"ts", sending_time()}, {"sync", sync_of(newest)}, {"time_ns", times}};
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!kProbeChannels[i].in(probes_[probe].channels)) continue;
      fields.emplace_back(kProbeChannels[i].column, std::move(values[i]));
    }
    streams_.add(node_ + "_samples" + (probe == 0 ? "" : "_" + std::to_string(probe)), fields);
  }
  void add_spikes(std::span<const SpikeEvent> spikes) {
    if (spikes.empty()) return;
    std::string times;
    std::string neurons;
    for (const SpikeEvent& spike : spikes) {
      append_raw(times, std::int64_t{spike.time.count()});
      append_raw(neurons, spike.neuron);
      if (bin_.count() == 0) continue;
      end_bins(spike.time);
      if (spike.neuron >= 1 && spike.neuron <= counts_.size()) ++counts_[spike.neuron - 1];
    }
    streams_.add(node_ + "_spikes", {{"ts", sending_time()},
                                     {"sync", sync_of(spikes.back().time)},
                                     {"time_ns", times},
                                     {"neuron", neurons}});
  }
  [[nodiscard]] bool stimulates() const noexcept { return text_.electrodes() > 0; }
  [[nodiscard]] bool is_away() const noexcept { return !streams_.connected(); }

  /// Sends what was added. False if the server is away, from now on.
  bool settle() {
    const std::string error = streams_.settle();
    if (error.empty()) return true;
    streams_.disconnect();
    interrupted_ = true;
    reason_ = error;
    pause_ = kFirstRejoin;
    rejoin_at_ = read_clock_pair().monotonic + pause_;
    report("it failed (" + reason_ + "): its receivers get nothing" +
           (stimulates() ? ", and stimulation is over there," : "") +
           " until it answers; the run and its other sinks go on");
    return false;
  }

  /// Connects again if it is time for it. The first entry is an off.
  bool rejoin() {
    const nanoseconds now = read_clock_pair().monotonic;
    if (now < rejoin_at_) return false;
    const bool connected = streams_.connect(kRejoinPatience).has_value();
    if (connected) {
      add_off(now);
      add_state("NODE_STARTED", {"parameters", encoding_});
      add_state("NODE_READY");
    }
    const std::string error = connected ? streams_.settle() : "no answer";
    if (!error.empty()) {
      streams_.disconnect();
      pause_ = std::min(2 * pause_, kMaxRejoin);
      rejoin_at_ = read_clock_pair().monotonic + pause_;
      return false;
    }
    report(std::string("it answers again") +
           (stimulates() ? ": its receivers got an off, and amplitudes rise from 0" : ""));
    return true;
  }

  void add_off(nanoseconds now) {
    for (std::uint16_t e = 0; e < text_.electrodes(); ++e) {
      add_command({.command = {.time = newest_tick_,
                               .heartbeat = heartbeat_,
                               .electrode = e,
                               .stop = StimulationCommand::Stop::kSinkFailure},
                   .sent = now,
                   .valid_until = now});
    }
  }

  void report(const std::string& what) {
    if (control_ != nullptr) control_->notice(uri_ + ": " + what);
  }

  /// `code` and `status` are the fields of BRAND's own nodes.
  void add_state(const char* status, const std::pair<std::string_view, std::string>& further = {}) {
    if (further.first.empty()) {
      streams_.add(node_ + "_state", {{"code", "0"}, {"status", status}});
    } else {
      streams_.add(node_ + "_state", {{"code", "0"}, {"status", status}, further});
    }
  }

  /// Sends the bins that end at or before a time. All earlier spikes are counted.
  void end_bins(nanoseconds time) {
    // A run that was stopped for long sends no bins for that time.
    if (time - bin_start_ > kMaxBins * bin_) {
      const nanoseconds skipped = (time - bin_start_) / bin_ * bin_ - bin_;
      std::fill(counts_.begin(), counts_.end(), std::uint16_t{0});
      bin_start_ += skipped;
    }
    for (; bin_start_ + bin_ <= time; bin_start_ += bin_) {
      std::string counts;
      for (std::uint16_t& count : counts_)
        append_raw(counts, std::exchange(count, std::uint16_t{0}));
      streams_.add(
          node_ + "_counts",
          {{"ts", sending_time()}, {"sync", sync_of(bin_start_ + bin_)}, {"counts", counts}});
    }
  }

  void add_command(const SentCommand& sent) {
    if (sent.command.kind == StimulationCommand::Kind::kPulse) return add_pulse(sent);
    take_update(sent);
  }

  void add_pulse(const SentCommand& sent) {
    const StimulationCommand& command = sent.command;
    streams_.add(node_ + "_pulses", {{"ts", sending_time()},
                                     {"sync", sync_of(command.time)},
                                     {"time_ns", std::to_string(command.time.count())},
                                     {"heartbeat", std::to_string(command.heartbeat)},
                                     {"electrode", text_.name(command)},
                                     {"amplitude_uA", shortest_decimal(command.amplitude_uA)},
                                     {"sent_monotonic_ns", std::to_string(sent.sent.count())},
                                     {"valid_until_ns", std::to_string(sent.valid_until.count())}});
  }

  /// The commands of an update arrive in the order of the electrodes; the last completes the entry.
  void take_update(const SentCommand& sent) {
    const StimulationCommand& command = sent.command;
    const char* const before = command.electrode == 0 ? "[" : ",";
    if (command.electrode == 0) {
      for (std::string* list : {&amplitudes_, &frequencies_, &stops_}) list->clear();
    }
    heartbeat_ = command.heartbeat;
    amplitudes_.append(before).append(shortest_decimal(command.amplitude_uA));
    frequencies_.append(before).append(shortest_decimal(command.frequency_Hz));
    stops_.append(before).append("\"").append(name_of(command.stop)).append("\"");
    if (command.electrode + 1U != text_.electrodes()) return;
    streams_.add(node_, {{"ts", sending_time()},
                         {"sync", sync_of(command.time)},
                         {"time_ns", std::to_string(command.time.count())},
                         {"heartbeat", std::to_string(command.heartbeat)},
                         {"amplitude_uA", amplitudes_ + "]"},
                         {"frequency_Hz", frequencies_ + "]"},
                         {"stop", stops_ + "]"},
                         {"sent_monotonic_ns", std::to_string(sent.sent.count())},
                         {"valid_until_ns", std::to_string(sent.valid_until.count())}});
  }

  static std::string sending_time() {
    return bytes_of(static_cast<std::uint64_t>(read_clock_pair().monotonic.count()));
  }
  /// The label of an entry's data: the time of the newest, in probe time.
  static std::string sync_of(nanoseconds time) {
    return "{\"merkel_time_ns\":" + std::to_string(time.count()) + "}";
  }

  std::string node_;
  StreamWriter streams_;
  StimulationText text_;
  std::string encoding_;    ///< as JSON
  std::string amplitudes_;  ///< of the current update, as JSON arrays
  std::string frequencies_;
  std::string stops_;
  RunControl* control_ = nullptr;
  bool interrupted_ = false;  ///< since the last look at interrupted()
  std::string reason_;
  nanoseconds pause_{0};      ///< before the next attempt to connect
  nanoseconds rejoin_at_{0};  ///< on the host's monotonic clock
  nanoseconds newest_tick_{0};
  std::uint32_t heartbeat_ = 0;  ///< of the last update
  nanoseconds bin_;              ///< 0: no counts
  nanoseconds bin_start_{0};
  std::vector<std::uint16_t> counts_;  ///< of the present bin, by neuron
  std::vector<ProbeInfo> probes_;
};

/// The node's name is part of the names of its streams.
bool is_node_name(std::string_view name) {
  return !name.empty() && name.size() <= 64 &&
         name.find_first_not_of(
             "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-."
             ":") == std::string_view::npos;
}

}  // namespace

OpenedSink open_redis_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const std::string node = options.text("node", "merkel");
  const std::int64_t longest = options.whole("maxlen", 100'000, 1, 100'000'000);
  const double bin_ms = options.number("bin_ms", 10.0, 0.0, 10'000.0);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (!is_node_name(node)) {
    return bad_input("\"" + uri.text +
                     "\": the option node must have 1 to 64 letters, digits, '_', '-', '.' or "
                     "':', because streams are named after it");
  }
  const auto& electrodes = setup.run.encoding.electrodes;
  const milliseconds patience =
      electrodes.empty() ? kReplyPatience
                         : std::max(milliseconds{1}, std::chrono::duration_cast<milliseconds>(
                                                         setup.run.encoding.stimulation.watchdog));
  auto sink = std::make_unique<RedisSink>(
      uri.text, node, StreamWriter(uri, setup.allow_remote, patience, longest), setup,
      std::chrono::duration_cast<nanoseconds>(std::chrono::duration<double, std::milli>(bin_ms)));
  if (auto opened = sink->open(); !opened) return Unexpected<SetupError>(opened.error());
  return sink;
}

}  // namespace merkel
