#include "drivers/transports/lsl_port.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <span>
#include <utility>
#include <vector>

#include <lsl_cpp.h>
#include <unistd.h>

#include "core/parameters/parameter_error.hpp"
#include "core/printed.hpp"
#include "core/units.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/transports/line_buffer.hpp"

namespace merkel {
namespace {

constexpr double kPatience_s = 2.0;
constexpr int kInletBuffer_s = 10;  ///< of samples that are not read yet
constexpr std::size_t kMaxChannels = 64;
constexpr double kOwnClock_s = 0.01;  ///< largest offset that liblsl measures to a clock itself
constexpr double kSilent_s = 1.0;     ///< without samples: is the stream still announced?
constexpr double kForgets_s = 2.0;    ///< a stream that does not answer for that long is gone
constexpr double kWatched_s = 3.0;    ///< of the network, before that is decided

std::vector<LslStream::Channel> channels_of(lsl::stream_info& info) {  // desc() is not const
  std::vector<LslStream::Channel> channels;
  lsl::xml_element channel = info.desc().child("channels").child("channel");
  for (int i = 0; i < info.channel_count(); ++i) {
    channels.push_back({channel.child_value("label"), channel.child_value("unit")});
    channel = channel.next_sibling("channel");
  }
  return channels;
}

std::string own_host() {
  std::array<char, 256> name{};
  static_cast<void>(::gethostname(name.data(), name.size() - 1));
  return name.data();
}

class LslPort final : public Transport {
 public:
  LslPort(std::string name, std::string host)
      : name_(std::move(name)), host_(host.empty() ? own_host() : std::move(host)) {
    info_.name = "lsl:" + name_;
    info_.note = "a Lab Streaming Layer inlet";
  }

  [[nodiscard]] const std::vector<LslStream::Channel>& channels() const noexcept {
    return channels_;
  }
  [[nodiscard]] double rate_Hz() const noexcept { return rate_Hz_; }

  [[nodiscard]] Expected<std::size_t, Disconnected> read(
      std::span<std::uint8_t> bytes, std::chrono::nanoseconds patience) override {
    if (!inlet_) return Unexpected<Disconnected>(Disconnected{});
    try {
      double wait_s = waiting_.empty() ? std::max(units::s_from(patience), 0.0) : 0.0;
      while (waiting_.size() < bytes.size()) {
        const double time_s = inlet_->pull_sample(values_, wait_s);
        if (time_s == 0.0) break;
        heard_s_ = lsl::local_clock();
        watch_.reset();
        waiting_.add(printed("%.9f", time_s), values_);
        wait_s = 0.0;
      }
      if (waiting_.empty() && is_gone()) throw lsl::lost_error("no longer announced");
    } catch (const std::exception&) {  // the outlet is gone
      inlet_.reset();
      watch_.reset();
      return Unexpected<Disconnected>(Disconnected{});
    }
    return waiting_.take(bytes);
  }

  /// An inlet only receives.
  [[nodiscard]] Expected<void, Disconnected> write(
      std::span<const std::uint8_t> /*bytes*/) override {
    if (!inlet_) return Unexpected<Disconnected>(Disconnected{});
    return {};
  }

  [[nodiscard]] Expected<void, SetupError> reopen() override {
    inlet_.reset();
    waiting_.clear();
    try {
      const auto info = find();
      if (!info) return Unexpected<SetupError>(info.error());
      // Without liblsl's own recovery, so that an outage is noticed and the press released.
      inlet_ = std::make_unique<lsl::stream_inlet>(*info, kInletBuffer_s, 0, false);
      if (!has_own_clock()) inlet_->set_postprocessing(lsl::post_clocksync);
      inlet_->open_stream(kPatience_s);
      lsl::stream_info whole = inlet_->info(kPatience_s);
      opened_ = true;
      uid_ = whole.uid();
      heard_s_ = lsl::local_clock();
      source_id_ = whole.source_id();
      channel_count_ = whole.channel_count();
      info_.serial_number = printable_text(source_id_);
      rate_Hz_ = whole.nominal_srate();
      channels_ = channels_of(whole);
    } catch (const std::exception& error) {
      inlet_.reset();
      return unavailable("the LSL stream \"" + name_ + "\" cannot be opened: " + error.what());
    }
    return {};
  }

 private:
  /// Whether the stamps are in this machine's clock. liblsl measures an offset of some microseconds
  /// even to an outlet of this machine, by which its correction would falsify them; a large one is
  /// that of a container with a clock of its own.
  [[nodiscard]] bool has_own_clock() {
    if (host_ != own_host()) return false;
    try {
      return std::fabs(inlet_->time_correction(kPatience_s)) < kOwnClock_s;
    } catch (const lsl::timeout_error&) {
      return true;  // stamps of another clock are noticed by their arrival
    }
  }

  /// Whether the outlet has left. liblsl itself notices only a connection that is closed, which
  /// neither a lost network nor every outlet that ends does.
  [[nodiscard]] bool is_gone() {
    const double now_s = lsl::local_clock();
    if (now_s - heard_s_ < kSilent_s) return false;
    if (!watch_) {
      watch_ = std::make_unique<lsl::continuous_resolver>("name", name_, kForgets_s);
      watched_since_s_ = now_s;
    }
    if (now_s - watched_since_s_ < kWatched_s) return false;
    const auto announced = watch_->results();
    return std::none_of(announced.begin(), announced.end(),
                        [this](const lsl::stream_info& info) { return info.uid() == uid_; });
  }

  /// Whether an announced stream is the one that was opened first; true before the first opening.
  [[nodiscard]] bool is_same(const lsl::stream_info& info) const {
    return !opened_ || (info.source_id() == source_id_ && info.channel_count() == channel_count_);
  }

  /// Finds the stream by name, machine and, after an outage, source and number of channels.
  [[nodiscard]] Expected<lsl::stream_info, SetupError> find() const {
    const std::string what = "the LSL stream \"" + name_ + "\"";
    const auto is_right = [this](const auto& info) {
      return info.hostname() == host_ && is_same(info);
    };
    const double deadline_s = lsl::local_clock() + kPatience_s;
    std::vector<lsl::stream_info> found;
    auto right = found.end();
    std::size_t answers = 0;
    do {  // another machine's stream of that name may be the first to answer
      answers = found.size();
      found = lsl::resolve_stream("name", name_, static_cast<int>(answers) + 1,
                                  std::max(deadline_s - lsl::local_clock(), 0.0));
      right = std::find_if(found.begin(), found.end(), is_right);
    } while (right == found.end() && found.size() > answers);
    if (found.empty()) {
      return unavailable("there is no LSL stream \"" + name_ +
                         "\": start its outlet, and check that no firewall blocks it");
    }
    if (right == found.end() && opened_) {
      return unavailable(what + " has returned with another source or number of channels");
    }
    if (right == found.end()) {
      const std::string other = printable_text(found.front().hostname(), 64);
      return unavailable(what + " comes from the machine " + other + ", not from " + host_ +
                         ": add the option host=" + other + " to read that stream");
    }
    if (right->channel_format() == lsl::cf_string) {
      return unavailable(what + " contains text: choose a numeric stream");
    }
    if (static_cast<std::size_t>(right->channel_count()) > kMaxChannels) {
      return unavailable(what + " has " + std::to_string(right->channel_count()) +
                         " channels: at most " + std::to_string(kMaxChannels) + " are read");
    }
    return *right;
  }

  std::string name_;
  std::string host_;
  std::unique_ptr<lsl::stream_inlet> inlet_;
  std::vector<LslStream::Channel> channels_;
  double rate_Hz_ = 0.0;
  bool opened_ = false;    ///< at least once
  std::string source_id_;  ///< of the stream that was opened
  int channel_count_ = 0;
  std::string uid_;                                  ///< of the outlet that is read
  double heard_s_ = 0.0;                             ///< LSL's time of the last sample
  std::unique_ptr<lsl::continuous_resolver> watch_;  ///< while the stream is silent
  double watched_since_s_ = 0.0;
  LineBuffer waiting_;
  std::vector<double> values_;
};

}  // namespace

Expected<LslStream, SetupError> open_lsl_stream(const std::string& name, const std::string& host) {
  auto port = std::make_unique<LslPort>(name, host);
  if (auto done = port->reopen(); !done) return Unexpected<SetupError>(done.error());
  LslStream stream{.port = nullptr, .channels = port->channels(), .rate_Hz = port->rate_Hz()};
  stream.port = std::move(port);
  return stream;
}

}  // namespace merkel
