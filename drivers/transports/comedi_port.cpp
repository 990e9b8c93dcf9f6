#include "drivers/transports/comedi_port.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include <comedilib.h>
#include <fcntl.h>
#include <unistd.h>

#include "core/parameters/parameter_error.hpp"
#include "core/printed.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/transports/descriptor.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr double kBuffered_s = 5.0;      ///< of scans that are not read yet
constexpr double kRateTolerance = 0.01;  ///< share of the rate by which a card may differ
/// How often a card is asked to pass on what it has converted. Many interrupt only once thousands
/// of samples are converted, or else for every one.
constexpr milliseconds kFlush{1};
constexpr int kMaxRestarts = 8;  ///< without a scan in between; then the card counts as gone

struct CloseCard {
  void operator()(comedi_t* card) const noexcept { comedi_close(card); }
};
using OpenCard = std::unique_ptr<comedi_t, CloseCard>;

std::string comedi_reason() { return comedi_strerror(comedi_errno()); }

std::string comedi_number(double value) { return printed("%.6g", value); }

std::string range_text(const comedi_range& range) {
  return printed("%.6g:%.6g", range.min, range.max);
}

class ComediPort final : public Transport {
 public:
  explicit ComediPort(ComediSettings settings) : settings_(std::move(settings)) {
    info_.name = "comedi:" + settings_.node;
  }
  ~ComediPort() override {
    if (card_) static_cast<void>(comedi_cancel(card_.get(), subdevice_));
  }

  [[nodiscard]] const AnalogFormat& format() const noexcept { return format_; }

  [[nodiscard]] Expected<std::size_t, Disconnected> read(std::span<std::uint8_t> bytes,
                                                         nanoseconds patience) override {
    for (nanoseconds waited{0};;) {
      if (!card_) return Unexpected<Disconnected>(Disconnected{});
      const auto count = ::read(comedi_fileno(card_.get()), bytes.data(), bytes.size());
      if (count > 0) {
        restarts_in_a_row_ = 0;
        return static_cast<std::size_t>(count);
      }
      // The end of the scans, or an overflow of their buffer.
      if (count == 0 || errno == EPIPE) return restarted();
      if (errno != EAGAIN && errno != EINTR) return gone();
      if (waited >= patience) return std::size_t{0};
      // An unplugged card looks as if it had nothing to read; the next read() tells.
      const nanoseconds wait = std::min<nanoseconds>(patience - waited, kFlush);
      static_cast<void>(wait_readable(comedi_fileno(card_.get()), wait));
      static_cast<void>(comedi_poll(card_.get(), subdevice_));  // some drivers need none
      waited += wait;
    }
  }

  /// An analog input only sends.
  [[nodiscard]] Expected<void, Disconnected> write(
      std::span<const std::uint8_t> /*bytes*/) override {
    if (!card_) return Unexpected<Disconnected>(Disconnected{});
    return {};
  }

  [[nodiscard]] Expected<void, SetupError> reopen() override {
    card_.reset();
    comedi_loglevel(0);  // errors are returned, not printed
    OpenCard card(comedi_open(settings_.node.c_str()));
    if (!card) {
      const int number = comedi_errno();
      return Unexpected<SetupError>(port_error(settings_.node, number));
    }
    card_ = std::move(card);
    auto started = set_up();
    if (!started) card_.reset();
    return started;
  }

 private:
  [[nodiscard]] Unexpected<Disconnected> gone() {
    card_.reset();
    return Unexpected<Disconnected>(Disconnected{});
  }

  /// Starts the scans anew. \return 0 bytes
  [[nodiscard]] Expected<std::size_t, Disconnected> restarted() {
    static_cast<void>(comedi_cancel(card_.get(), subdevice_));
    if (++restarts_in_a_row_ > kMaxRestarts || comedi_command(card_.get(), &command_) < 0) {
      return gone();
    }
    ++info_.restarts;
    return std::size_t{0};
  }

  [[nodiscard]] Expected<void, SetupError> set_up() {
    comedi_t* const card = card_.get();
    const int found = comedi_find_subdevice_by_type(card, COMEDI_SUBD_AI, 0);
    const int flags = found < 0 ? 0 : comedi_get_subdevice_flags(card, as_subdevice(found));
    if (found < 0 || (flags & SDF_CMD_READ) == 0) {
      return bad_input(settings_.node + " (" + board() +
                       ") has no analog inputs that it scans by its own clock");
    }
    subdevice_ = as_subdevice(found);
    format_.sample_bytes = (flags & SDF_LSAMPL) != 0 ? sizeof(lsampl_t) : sizeof(sampl_t);
    if (auto chosen = choose_channels(flags); !chosen) return chosen;
    if (auto timed = set_rate(); !timed) return timed;
    enlarge_buffer();
    const int descriptor = comedi_fileno(card);
    static_cast<void>(::fcntl(descriptor, F_SETFL, ::fcntl(descriptor, F_GETFL) | O_NONBLOCK));
    if (comedi_command(card, &command_) < 0) {
      if (comedi_errno() == EBUSY) return Unexpected<SetupError>(port_busy(settings_.node));
      return unavailable(settings_.node + " (" + board() +
                         ") does not start its scans: " + comedi_reason());
    }
    restarts_in_a_row_ = 0;
    info_.note = board() + ", " + std::to_string(format_.conversions.size()) + " channels at " +
                 comedi_number(1e9 / static_cast<double>(format_.period.count())) + " scans/s, " +
                 range_note_;
    return {};
  }

  static unsigned as_subdevice(int found) noexcept { return static_cast<unsigned>(found); }

  [[nodiscard]] std::string board() const {
    const char* const name = comedi_get_board_name(card_.get());
    return name == nullptr ? "a card" : printable_text(name, 64);
  }

  [[nodiscard]] Expected<unsigned, SetupError> reference(int flags) const {
    struct Reference {
      std::string_view name;
      unsigned value;
      int flag;
    };
    constexpr std::array<Reference, 4> kReferences = {{{"ground", AREF_GROUND, SDF_GROUND},
                                                       {"common", AREF_COMMON, SDF_COMMON},
                                                       {"differential", AREF_DIFF, SDF_DIFF},
                                                       {"other", AREF_OTHER, SDF_OTHER}}};
    std::string known;
    for (const Reference& each : kReferences) {
      if ((flags & each.flag) == 0) continue;
      if (each.name == settings_.reference) return each.value;
      known += (known.empty() ? "" : "|") + std::string(each.name);
    }
    return bad_input(settings_.node + " (" + board() + ") has no inputs against reference=" +
                     settings_.reference + (known.empty() ? "" : ": set reference=" + known));
  }

  /// The range of a channel: the widest, or the narrowest that includes the wanted one.
  [[nodiscard]] Expected<unsigned, SetupError> range_of(std::size_t place) const {
    const unsigned channel = settings_.channels[place];
    const auto& all = settings_.ranges_V;
    const auto wanted = all.empty() ? std::pair{0.0, 0.0} : all[all.size() == 1 ? 0 : place];
    const int count = comedi_get_n_ranges(card_.get(), subdevice_, channel);
    int best = -1;
    double best_span_V = 0.0;
    std::string known;
    for (int i = 0; i < count; ++i) {
      const comedi_range* const range =
          comedi_get_range(card_.get(), subdevice_, channel, static_cast<unsigned>(i));
      if (range == nullptr || range->unit != UNIT_volt) continue;
      known += (known.empty() ? "" : ", ") + range_text(*range);
      const double span_V = range->max - range->min;
      if (!all.empty() && (range->min > wanted.first || range->max < wanted.second)) continue;
      if (best >= 0 && (all.empty() ? span_V <= best_span_V : span_V >= best_span_V)) continue;
      best = i;
      best_span_V = span_V;
    }
    if (best >= 0) return static_cast<unsigned>(best);
    const std::string what = settings_.node + " (" + board() + ") ";
    if (known.empty()) {
      return bad_input(what + "does not measure volts on channel " + std::to_string(channel));
    }
    return bad_input(what + "has no range that includes " + comedi_number(wanted.first) + " to " +
                     comedi_number(wanted.second) + " V on channel " + std::to_string(channel) +
                     ": set range= to one of " + known);
  }

  [[nodiscard]] Expected<void, SetupError> choose_channels(int flags) {
    const auto against = reference(flags);
    if (!against) return Unexpected<SetupError>(against.error());
    const int count = comedi_get_n_channels(card_.get(), subdevice_);
    format_.conversions.clear();
    list_.clear();
    range_note_.clear();
    for (std::size_t i = 0; i < settings_.channels.size(); ++i) {
      const unsigned channel = settings_.channels[i];
      if (count < 0 || channel >= static_cast<unsigned>(count)) {
        return bad_input(settings_.node + " (" + board() + ") has no channel " +
                         std::to_string(channel) + ": its channels are 0 to " +
                         std::to_string(count - 1));
      }
      const auto range = range_of(i);
      if (!range) return Unexpected<SetupError>(range.error());
      list_.push_back(CR_PACK(channel, *range, *against));
      auto converted = conversion(channel, *range, flags);
      if (!converted) return Unexpected<SetupError>(converted.error());
      format_.conversions.push_back(*converted);
      const std::string text =
          range_text(*comedi_get_range(card_.get(), subdevice_, channel, *range)) + " V";
      if (range_note_.find(text) == std::string::npos) {
        range_note_ += (range_note_.empty() ? "" : ", ") + text;
      }
    }
    return {};
  }

  /// The card's conversion to V: by its calibration, from a file where the card has none itself.
  [[nodiscard]] Expected<AnalogConversion, SetupError> conversion(unsigned channel, unsigned range,
                                                                  int flags) const {
    comedi_polynomial_t polynomial{};
    int made = -1;
    if ((flags & SDF_SOFT_CALIBRATED) != 0) {
      const std::unique_ptr<char, void (*)(void*)> path(
          comedi_get_default_calibration_path(card_.get()), std::free);
      const std::unique_ptr<comedi_calibration_t, void (*)(comedi_calibration_t*)> calibration(
          path ? comedi_parse_calibration_file(path.get()) : nullptr, [](comedi_calibration_t* it) {
            if (it != nullptr) comedi_cleanup_calibration(it);
          });
      if (!calibration) {
        return unavailable(settings_.node + " (" + board() + ") has no calibration at " +
                           (path ? path.get() : "any place") +
                           ": make it with sudo comedi_soft_calibrate -f " + settings_.node);
      }
      made = comedi_get_softcal_converter(subdevice_, channel, range, COMEDI_TO_PHYSICAL,
                                          calibration.get(), &polynomial);
    } else {
      made = comedi_get_hardcal_converter(card_.get(), subdevice_, channel, range,
                                          COMEDI_TO_PHYSICAL, &polynomial);
    }
    if (made < 0 || polynomial.order >= COMEDI_MAX_NUM_POLYNOMIAL_COEFFICIENTS) {
      return unavailable(settings_.node + " (" + board() +
                         ") gives no conversion to V of channel " + std::to_string(channel) + ": " +
                         comedi_reason());
    }
    AnalogConversion converted{.origin = polynomial.expansion_origin,
                               .largest = comedi_get_maxdata(card_.get(), subdevice_, channel)};
    std::copy_n(std::begin(polynomial.coefficients), polynomial.order + 1,
                converted.coefficients.begin());
    return converted;
  }

  /// Prepares the command for scans at the rate.
  [[nodiscard]] Expected<void, SetupError> set_rate() {
    comedi_t* const card = card_.get();
    const auto count = static_cast<unsigned>(list_.size());
    const auto wanted = static_cast<unsigned>(std::llround(1e9 / settings_.rate_Hz));
    const auto refuse = [&](const std::string& why) {
      return bad_input(settings_.node + " (" + board() + ") cannot scan " + std::to_string(count) +
                       " channels at rate_hz=" + comedi_number(settings_.rate_Hz) + why);
    };
    command_ = {};
    if (comedi_get_cmd_generic_timed(card, subdevice_, &command_, count, wanted) < 0) {
      return refuse(": " + comedi_reason());
    }
    command_.chanlist = list_.data();
    command_.chanlist_len = count;
    command_.scan_end_arg = count;
    command_.stop_src = TRIG_NONE;
    command_.stop_arg = 0;
    // The first test corrects what the card cannot do as wanted.
    static_cast<void>(comedi_command_test(card, &command_));
    if (const int wrong = comedi_command_test(card, &command_); wrong != 0) {
      return refuse(": comedi_command_test refuses the command at step " + std::to_string(wrong) +
                    "; comedi_board_info -v " + settings_.node + " shows what it can do");
    }
    const bool timed = command_.scan_begin_src == TRIG_TIMER;
    format_.period = nanoseconds{timed ? std::int64_t{command_.scan_begin_arg}
                                       : std::int64_t{command_.convert_arg} * count};
    if (format_.period.count() <= 0) return refuse(": it reports no period of its scans");
    const double rate_Hz = 1e9 / static_cast<double>(format_.period.count());
    if (std::fabs(rate_Hz / settings_.rate_Hz - 1.0) > kRateTolerance) {
      return refuse(": the nearest is rate_hz=" + comedi_number(rate_Hz));
    }
    return {};
  }

  /// As much as a stall of the host may need; a card without so much keeps what it has.
  void enlarge_buffer() const {
    const int most = comedi_get_max_buffer_size(card_.get(), subdevice_);
    const double wanted =
        kBuffered_s * settings_.rate_Hz * static_cast<double>(list_.size() * format_.sample_bytes);
    const int size = static_cast<int>(std::min(wanted, static_cast<double>(std::max(most, 0))));
    if (size > comedi_get_buffer_size(card_.get(), subdevice_)) {
      static_cast<void>(
          comedi_set_buffer_size(card_.get(), subdevice_, static_cast<unsigned>(size)));
    }
  }

  ComediSettings settings_;
  OpenCard card_;
  unsigned subdevice_ = 0;
  std::vector<unsigned> list_;  ///< channel, range and reference of each; the command refers to it
  std::string range_note_;
  AnalogFormat format_;  ///< without columns
  comedi_cmd command_{};
  int restarts_in_a_row_ = 0;
};

}  // namespace

Expected<ComediCard, SetupError> open_comedi_card(const ComediSettings& settings) {
  auto port = std::make_unique<ComediPort>(settings);
  if (auto done = port->reopen(); !done) return Unexpected<SetupError>(done.error());
  AnalogFormat format = port->format();
  return ComediCard{.port = std::move(port), .format = std::move(format)};
}

}  // namespace merkel
