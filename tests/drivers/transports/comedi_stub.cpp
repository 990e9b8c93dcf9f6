#include "tests/drivers/transports/comedi_stub.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <deque>

#include <comedilib.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/syscall.h>
#include <unistd.h>

merkel::FakeComediCard* merkel::fake_comedi_card = nullptr;

namespace {

using merkel::fake_comedi_card;
using std::chrono::nanoseconds;

constexpr std::size_t kKernelSignalSet_bytes = 8;

int card_error = 0;
comedi_range range_of_card{};

/// The open card and its command.
struct Running {
  int descriptor = -1;
  bool running = false;
  bool failed = false;
  nanoseconds started{0};
  std::uint64_t scans = 0;  ///< of this command
  std::deque<std::uint8_t> buffer;
};
Running open_card;

int fail_with(int number) {
  card_error = number;
  return -1;
}

std::size_t sample_bytes() { return fake_comedi_card->long_samples ? 4 : 2; }

/// Scans up to now.
void scan() {
  const auto& card = *fake_comedi_card;
  if (!open_card.running) return;
  const double elapsed_ns =
      static_cast<double>((card.clock.time - open_card.started).count()) * (1.0 + card.drift);
  const auto due = static_cast<std::uint64_t>(elapsed_ns / static_cast<double>(card.period_ns));
  const std::size_t bytes = card.list.size() * sample_bytes();
  for (; open_card.scans < due; ++open_card.scans, ++fake_comedi_card->scanned) {
    if (open_card.failed) continue;
    if (open_card.buffer.size() + bytes > static_cast<std::size_t>(card.buffer)) {
      open_card.failed = true;
      continue;
    }
    for (const unsigned packed : card.list) {
      const std::uint32_t raw = card.value(card.scanned, CR_CHAN(packed));
      std::array<std::uint8_t, 4> text{};
      const auto narrow = static_cast<std::uint16_t>(raw);
      if (sample_bytes() == 4) std::memcpy(text.data(), &raw, 4);
      if (sample_bytes() == 2) std::memcpy(text.data(), &narrow, 2);
      open_card.buffer.insert(open_card.buffer.end(), text.begin(),
                              text.begin() + static_cast<std::ptrdiff_t>(sample_bytes()));
    }
  }
}

ssize_t read_card(std::uint8_t* bytes, std::size_t size) {
  const auto refuse = [](int number) {
    errno = number;
    return ssize_t{-1};
  };
  if (fake_comedi_card->unplugged) return refuse(ENODEV);
  if (fake_comedi_card->ends_at_once) return 0;
  scan();
  fake_comedi_card->clock.time += fake_comedi_card->read_time;
  if (open_card.buffer.empty()) return refuse(open_card.failed ? EPIPE : EAGAIN);
  // A node may return any part of what there is.
  const std::size_t count = std::min(size, open_card.buffer.size());
  const auto end = open_card.buffer.begin() + static_cast<std::ptrdiff_t>(count);
  std::copy(open_card.buffer.begin(), end, bytes);
  open_card.buffer.erase(open_card.buffer.begin(), end);
  return static_cast<ssize_t>(count);
}

}  // namespace

extern "C" {

ssize_t read(int descriptor, void* bytes, size_t size) {
  if (descriptor >= 0 && descriptor == open_card.descriptor) {
    return read_card(static_cast<std::uint8_t*>(bytes), size);
  }
  return ::syscall(SYS_read, descriptor, bytes, size);
}

#pragma GCC diagnostic push
#ifndef __clang__
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"  // glibc declares that it only writes
#endif
int ppoll(pollfd* watched, nfds_t count, const timespec* timeout, const sigset_t* mask) {
  if (count == 1 && watched->fd >= 0 && watched->fd == open_card.descriptor) {
    fake_comedi_card->clock.time +=
        std::chrono::seconds{timeout->tv_sec} + nanoseconds{timeout->tv_nsec};
    scan();
    watched->revents = open_card.buffer.empty() ? short{0} : short{POLLIN};
    return open_card.buffer.empty() ? 0 : 1;
  }
  timespec copy = timeout == nullptr ? timespec{} : *timeout;
  return static_cast<int>(::syscall(SYS_ppoll, watched, count, timeout == nullptr ? nullptr : &copy,
                                    mask, kKernelSignalSet_bytes));
}

#pragma GCC diagnostic pop

comedi_t* comedi_open(const char* /*name*/) {
  if (fake_comedi_card == nullptr || fake_comedi_card->unplugged) {
    card_error = ENOENT;
    return nullptr;
  }
  if (fake_comedi_card->open_error != 0) {
    card_error = fake_comedi_card->open_error;
    return nullptr;
  }
  ++fake_comedi_card->opened;
  open_card = {.descriptor = ::open("/dev/null", O_RDWR)};
  return reinterpret_cast<comedi_t*>(&open_card);
}
int comedi_close(comedi_t* /*card*/) {
  ::close(open_card.descriptor);
  open_card = {};
  return 0;
}
int comedi_loglevel(int level) { return level; }
int comedi_errno() { return card_error; }
const char* comedi_strerror(int number) { return std::strerror(number); }
int comedi_fileno(comedi_t* /*card*/) { return open_card.descriptor; }
const char* comedi_get_board_name(comedi_t* /*card*/) { return "fake-16"; }
int comedi_find_subdevice_by_type(comedi_t* /*card*/, int type, unsigned /*from*/) {
  return type == COMEDI_SUBD_AI ? 3 : -1;
}
int comedi_get_subdevice_flags(comedi_t* /*card*/, unsigned subdevice) {
  const auto& card = *fake_comedi_card;
  int flags = subdevice == 3 ? SDF_READABLE | SDF_GROUND : 0;
  if (card.scans) flags |= SDF_CMD_READ | SDF_CMD;
  if (card.long_samples) flags |= SDF_LSAMPL;
  if (card.differential) flags |= SDF_DIFF;
  if (card.soft_calibrated) flags |= SDF_SOFT_CALIBRATED;
  return flags;
}
int comedi_get_n_channels(comedi_t* /*card*/, unsigned /*subdevice*/) {
  return static_cast<int>(fake_comedi_card->channels);
}
int comedi_get_n_ranges(comedi_t* /*card*/, unsigned /*subdevice*/, unsigned /*channel*/) {
  return static_cast<int>(fake_comedi_card->ranges.size());
}
comedi_range* comedi_get_range(comedi_t* /*card*/, unsigned /*subdevice*/, unsigned /*channel*/,
                               unsigned number) {
  const auto& range = fake_comedi_card->ranges.at(number);
  range_of_card = {.min = range.low, .max = range.high, .unit = range.unit};
  return &range_of_card;
}
lsampl_t comedi_get_maxdata(comedi_t* /*card*/, unsigned /*subdevice*/, unsigned /*channel*/) {
  return fake_comedi_card->largest;
}
char* comedi_get_default_calibration_path(comedi_t* /*card*/) {
  const auto& path = fake_comedi_card->calibration_file;
  return path.empty() ? nullptr : ::strdup(path.c_str());
}
int comedi_get_hardcal_converter(comedi_t* /*card*/, unsigned /*subdevice*/, unsigned /*channel*/,
                                 unsigned number, comedi_conversion_direction /*direction*/,
                                 comedi_polynomial_t* polynomial) {
  const auto& range = fake_comedi_card->ranges.at(number);
  *polynomial = {};
  polynomial->order = 1;
  polynomial->coefficients[0] = range.low;
  polynomial->coefficients[1] = (range.high - range.low) / fake_comedi_card->largest;
  return 0;
}
int comedi_get_cmd_generic_timed(comedi_t* /*card*/, unsigned subdevice, comedi_cmd* command,
                                 unsigned count, unsigned period_ns) {
  *command = {};
  command->subdev = subdevice;
  command->start_src = TRIG_NOW;
  command->scan_begin_src = TRIG_TIMER;
  command->scan_begin_arg = period_ns;
  command->convert_src = TRIG_TIMER;
  command->convert_arg = period_ns / std::max(count, 1U);
  command->scan_end_src = TRIG_COUNT;
  command->scan_end_arg = count;
  return 0;
}
int comedi_command_test(comedi_t* /*card*/, comedi_cmd* command) {
  const auto& card = *fake_comedi_card;
  if (card.refused_at != 0) return card.refused_at;
  const auto step = static_cast<double>(card.period_step_ns);
  const auto rounded =
      std::max<std::int64_t>(std::llround(command->scan_begin_arg / step) * card.period_step_ns,
                             card.shortest_period_ns * command->chanlist_len);
  const bool changed = command->scan_begin_arg != rounded;
  command->scan_begin_arg = static_cast<unsigned>(rounded);
  return changed ? 4 : 0;
}
int comedi_command(comedi_t* /*card*/, comedi_cmd* command) {
  auto& card = *fake_comedi_card;
  if (card.command_error != 0) return fail_with(card.command_error);
  if (command->stop_src != TRIG_NONE) return fail_with(EINVAL);
  ++card.commands;
  card.list.assign(command->chanlist, command->chanlist + command->chanlist_len);
  card.period_ns = command->scan_begin_arg;
  open_card.running = true;
  open_card.failed = false;
  open_card.started = card.clock.time;
  open_card.scans = 0;
  open_card.buffer.clear();
  return 0;
}
int comedi_cancel(comedi_t* /*card*/, unsigned /*subdevice*/) {
  scan();
  open_card.running = false;
  return 0;
}
int comedi_poll(comedi_t* /*card*/, unsigned /*subdevice*/) { return fail_with(EINVAL); }
int comedi_get_max_buffer_size(comedi_t* /*card*/, unsigned /*subdevice*/) {
  return fake_comedi_card->largest_buffer;
}
int comedi_get_buffer_size(comedi_t* /*card*/, unsigned /*subdevice*/) {
  return fake_comedi_card->buffer;
}
int comedi_set_buffer_size(comedi_t* /*card*/, unsigned /*subdevice*/, unsigned size) {
  return fake_comedi_card->buffer = static_cast<int>(size);
}
}
