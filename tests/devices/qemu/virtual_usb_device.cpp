// A USB device (1209:0001) for the kernel's vhci_hcd, which treats it like one on a bus: USB/IP
// over a pair of sockets, without a network. Interface 0 is HID and reports force and time;
// interface 1 sends HBF1 over bulk endpoints. Reads the commands stall, unplug, replug and quit,
// one per line.
//
// Linux, Documentation/usb/usbip_protocol.rst; linux/usb/ch9.h

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <deque>
#include <memory>
#include <numbers>
#include <string>
#include <string_view>

#include <arpa/inet.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/units.hpp"
#include "drivers/protocols/protocol_table.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr const char* kHub = "/sys/devices/platform/vhci_hcd.0/";
constexpr unsigned kDeviceNumber = 1U << 16U | 2U;
constexpr unsigned kHighSpeed = 3;
constexpr std::uint32_t kHidEndpoint = 1;
constexpr std::uint32_t kBulkEndpoint = 2;
constexpr std::size_t kMaxPending = 1 << 16;
constexpr unsigned kMeasuresAReport = 4;
constexpr std::size_t kMaxReports = 8;

enum Command : std::uint32_t { kSubmit = 1, kUnlink = 2, kSubmitted = 3, kUnlinked = 4 };

/// The header of every message, in network byte order. In a submission, `status` holds its flags
/// and `length` the size to send or receive; in an unlinking, `status` is the number of the
/// submission.
struct Header {
  std::uint32_t command, number, device, in, endpoint;
  std::uint32_t status, length, start, packets, interval;
  std::array<std::uint8_t, 8> setup;

  void swap() noexcept {
    for (std::uint32_t* word : {&command, &number, &device, &in, &endpoint, &status, &length,
                                &start, &packets, &interval}) {
      *word = ntohl(*word);
    }
  }
};
static_assert(sizeof(Header) == 48);

/// u16 number, i16 force in mN, u32 time in µs; the physical units are in the descriptor.
const Bytes kReports = {
    0x06, 0x00, 0xff, 0x09, 0x01, 0xa1, 0x01,              // vendor's application
    0x09, 0x02, 0x15, 0x00, 0x27, 0xff, 0xff, 0x00, 0x00,  // number: 0 to 65535,
    0x75, 0x10, 0x95, 0x01, 0x81, 0x02,                    // 16 bits
    0x05, 0x20, 0x0a, 0x94, 0x04,                          // sensor page, force
    0x16, 0x00, 0x80, 0x26, 0xff, 0x7f, 0x36, 0x00, 0x80, 0x46, 0xff,
    0x7f, 0x55, 0x02, 0x66, 0x11, 0xe1, 0x81, 0x02,  // 100 dyn a count
    0x0a, 0x29, 0x05, 0x15, 0x00, 0x27, 0xff, 0xff, 0xff, 0xff, 0x35,
    0x00, 0x47, 0xff, 0xff, 0xff, 0xff, 0x55, 0x0a, 0x66, 0x01, 0x10,  // time, µs
    0x75, 0x20, 0x81, 0x02, 0xc0};                                     // 32 bits

const Bytes kDevice = {18, 1, 0, 2, 0, 0, 0, 64, 0x09, 0x12, 0x01, 0, 0, 1, 1, 2, 3, 1};

Bytes configuration() {
  return {9,  2,    57,   0,    2, 1,    0,    0x80,
          50,  //
          9,  4,    0,    0,    1, 3,    0,    0,
          0,  // HID
          9,  0x21, 0x11, 0x01, 0, 1,    0x22, static_cast<std::uint8_t>(kReports.size()),
          0,  7,    5,    0x81, 3, 64,   0,    4,  //
          9,  4,    1,    0,    2, 0xff, 0,    0,
          0,                                 // vendor's
          7,  5,    0x82, 2,    0, 2,    0,  //
          7,  5,    0x02, 2,    0, 2,    0};
}

Bytes string_descriptor(std::size_t index) {
  constexpr std::array<std::string_view, 4> kTexts = {"", "Haptics Lab", "Virtual Probe", "VUSB7"};
  if (index == 0) return {4, 3, 9, 4};
  Bytes bytes = {static_cast<std::uint8_t>(2 + 2 * kTexts.at(index & 3U).size()), 3};
  for (const char character : kTexts.at(index & 3U)) {
    bytes.push_back(static_cast<std::uint8_t>(character));
    bytes.push_back(0);
  }
  return bytes;
}

nanoseconds now() { return std::chrono::steady_clock::now().time_since_epoch(); }

class VirtualDevice {
 public:
  VirtualDevice()
      : probe_((*find_protocol("hbf1"))->simulate(ProbeSample::kDepth | ProbeSample::kForce)) {}

  int run() {
    if (!plug_in()) return EXIT_FAILURE;
    next_ = now();
    while (!quit_) {
      if (now() >= next_) {
        measure();
        next_ += milliseconds{1};
      }
      wait(std::max(next_ - now(), nanoseconds{0}));
    }
    unplug();
    return EXIT_SUCCESS;
  }

 private:
  bool plug_in() {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()) != 0) return false;
    socket_ = ends[0];
    const bool done =
        tell("attach", "0 " + std::to_string(ends[1]) + " " + std::to_string(kDeviceNumber) + " " +
                           std::to_string(kHighSpeed));
    ::close(ends[1]);
    pending_.clear();
    outgoing_.clear();
    reports_.clear();
    stalled_ = false;
    probe_->boot(now() - booted_, outgoing_);
    return done;
  }

  void unplug() {
    if (socket_ < 0) return;
    static_cast<void>(tell("detach", "0"));
    ::close(socket_);
    socket_ = -1;
  }

  static bool tell(const char* file, const std::string& words) {
    const int descriptor = ::open((kHub + std::string(file)).c_str(), O_WRONLY | O_CLOEXEC);
    const bool done =
        ::write(descriptor, words.data(), words.size()) == static_cast<ssize_t>(words.size());
    if (!done) std::perror(file);
    if (descriptor >= 0) ::close(descriptor);
    return done;
  }

  void wait(nanoseconds patience) {
    std::array<pollfd, 2> watched = {{{STDIN_FILENO, POLLIN, 0}, {socket_, POLLIN, 0}}};
    timespec timeout{.tv_sec = 0, .tv_nsec = static_cast<long>(patience.count())};
    if (::ppoll(watched.data(), watched.size(), &timeout, nullptr) <= 0) return;
    if (watched[0].revents != 0) take_commands();
    if (socket_ >= 0 && watched[1].revents != 0 && !take_message()) unplug();
  }

  void take_commands() {
    std::array<char, 256> text{};
    const auto count = ::read(STDIN_FILENO, text.data(), text.size());
    if (count <= 0) quit_ = true;
    for (ssize_t i = 0; i < count; ++i) {
      if (text[static_cast<std::size_t>(i)] != '\n') {
        line_ += text[static_cast<std::size_t>(i)];
        continue;
      }
      if (line_ == "stall") stalled_ = true;
      if (line_ == "unplug") unplug();
      if (line_ == "replug" && !plug_in()) quit_ = true;
      if (line_ == "quit") quit_ = true;
      line_.clear();
    }
  }

  bool receive(void* bytes, std::size_t count) const {
    return ::recv(socket_, bytes, count, MSG_WAITALL) == static_cast<ssize_t>(count);
  }

  bool take_message() {
    Header header{};
    if (!receive(&header, sizeof header)) return false;
    header.swap();
    if (header.command == kUnlink) {
      const auto found = std::find_if(pending_.begin(), pending_.end(), [&](const Header& request) {
        return request.number == header.status;
      });
      const bool pending = found != pending_.end();
      if (pending) pending_.erase(found);
      header.command = kUnlinked;
      header.status = pending ? static_cast<std::uint32_t>(-ECONNRESET) : 0U;
      return send(header, {});
    }
    Bytes data(header.in == 0 ? header.length : 0U);
    if (!data.empty() && !receive(data.data(), data.size())) return false;
    if (header.endpoint == 0) return control(header);
    if (header.in != 0) {
      pending_.push_back(header);
      return flush() && report_if_asked();
    }
    probe_->take(data, now() - booted_, outgoing_);
    return finish(header, 0, {}, data.size()) && flush();
  }

  bool control(const Header& header) {
    const auto& setup = header.setup;
    const std::size_t wanted = setup[6] | static_cast<std::size_t>(setup[7]) << 8U;
    Bytes answer;
    bool known = true;
    if (setup[0] == 0x80 && setup[1] == 6 && setup[3] == 1) {
      answer = kDevice;
    } else if (setup[0] == 0x80 && setup[1] == 6 && setup[3] == 2) {
      answer = configuration();
    } else if (setup[0] == 0x80 && setup[1] == 6 && setup[3] == 3) {
      answer = string_descriptor(setup[2]);
    } else if (setup[0] == 0x81 && setup[1] == 6 && setup[3] == 0x22) {
      answer = kReports;
    } else if ((setup[0] & 0xe0U) == 0x80U && setup[1] == 0) {
      answer = {0, 0};  // status
    } else if (setup[0] == 0x02 && setup[1] == 1) {
      stalled_ = false;  // CLEAR_FEATURE, ENDPOINT_HALT
      std::fprintf(stderr, "halt cleared\n");
    } else {
      known = (setup[0] & 0x80U) == 0U;  // requests that set something succeed
    }
    if (!known) return finish(header, -EPIPE, {}, 0);
    answer.resize(std::min(answer.size(), wanted));
    return finish(header, 0, answer, header.in != 0 ? answer.size() : wanted);
  }

  /// Sends the probe's data to the transfers that wait for it.
  bool flush() {
    for (auto request = pending_.begin(); request != pending_.end();) {
      if (request->endpoint != kBulkEndpoint || (outgoing_.empty() && !stalled_)) {
        ++request;
        continue;
      }
      const std::size_t count =
          stalled_ ? 0 : std::min<std::size_t>(outgoing_.size(), request->length);
      const auto end = outgoing_.begin() + static_cast<std::ptrdiff_t>(count);
      if (!finish(*request, stalled_ ? -EPIPE : 0, Bytes(outgoing_.begin(), end), count)) {
        return false;
      }
      outgoing_.erase(outgoing_.begin(), end);
      request = pending_.erase(request);
    }
    if (outgoing_.size() > kMaxPending) outgoing_.clear();
    return true;
  }

  void measure() {
    const nanoseconds time = now() - booted_;
    ProbeSample sample{.channels = ProbeSample::kDepth | ProbeSample::kForce};
    sample.depth_mm = 0.75 - 0.75 * std::cos(2.0 * std::numbers::pi * units::s_from(time));
    sample.force_mN = std::round(1000.0 * sample.depth_mm);
    if (probe_->started()) probe_->measure(sample, {}, time, outgoing_);
    if (socket_ < 0) return;
    if (!flush()) return unplug();
    if (++measured_ % kMeasuresAReport == 0) queue_report(sample, time);
    if (!report_if_asked()) unplug();
  }

  void queue_report(const ProbeSample& sample, nanoseconds time) {
    const auto number = static_cast<std::uint32_t>(measured_ / kMeasuresAReport) & 0xffffU;
    const auto force = static_cast<std::uint32_t>(sample.force_mN);
    const auto us = static_cast<std::uint32_t>(time / microseconds{1});
    Bytes report;
    for (const std::uint32_t word : {number | force << 16U, us}) {
      for (unsigned shift = 0; shift < 32; shift += 8) {
        report.push_back(static_cast<std::uint8_t>(word >> shift));
      }
    }
    if (reports_.size() == kMaxReports) reports_.pop_front();
    reports_.push_back(report);
  }

  bool report_if_asked() {
    const auto request = std::find_if(pending_.begin(), pending_.end(), [](const Header& header) {
      return header.endpoint == kHidEndpoint;
    });
    if (request == pending_.end() || reports_.empty()) return true;
    const Header header = *request;
    pending_.erase(request);
    const Bytes report = reports_.front();
    reports_.pop_front();
    return finish(header, 0, report, report.size());
  }

  bool finish(Header header, int status, const Bytes& data, std::size_t length) {
    header.command = kSubmitted;
    header.status = static_cast<std::uint32_t>(status);
    header.length = static_cast<std::uint32_t>(length);
    header.start = header.packets = header.interval = 0;
    header.setup.fill(0);
    return send(header, header.in != 0 ? data : Bytes{});
  }

  bool send(Header header, const Bytes& data) {
    header.swap();
    Bytes message(sizeof header);
    std::memcpy(message.data(), &header, sizeof header);
    message.insert(message.end(), data.begin(), data.end());
    return ::send(socket_, message.data(), message.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(message.size());
  }

  std::unique_ptr<SimulatedDevice> probe_;
  nanoseconds booted_ = now() - std::chrono::seconds{1};
  nanoseconds next_{0};
  int socket_ = -1;
  std::deque<Header> pending_;  ///< IN transfers that wait for bytes
  Bytes outgoing_;
  std::string line_;
  std::deque<Bytes> reports_;
  unsigned measured_ = 0;
  bool stalled_ = false;
  bool quit_ = false;
};

}  // namespace
}  // namespace merkel

int main() { return merkel::VirtualDevice().run(); }
