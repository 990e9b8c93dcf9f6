#include "tools/doctor/udp_loopback.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include "realtime/threads/thread_setup.hpp"

namespace merkel {
namespace {

constexpr std::size_t kSpikesADatagram = 150;  // fits into Ethernet's 1500 bytes

SetupError no_loopback() {
  return {.kind = SetupError::Kind::kUnavailable,
          .sentence = std::string("cannot send to this host by UDP: ") + std::strerror(errno) +
                      "; bring up the loopback interface (ip link set lo up)"};
}

}  // namespace

class UdpLoopback::CountingSink final : public Sink {
 public:
  explicit CountingSink(UdpLoopback& loopback) : loopback_(loopback) {}
  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  Expected<void, SinkError> write(const RecordBatch& batch) override {
    const std::span<const SpikeEvent> spikes = batch.spikes;
    for (std::size_t first = 0; first < spikes.size(); first += kSpikesADatagram) {
      const std::size_t count = std::min(kSpikesADatagram, spikes.size() - first);
      std::array<std::int64_t, kSpikesADatagram> times{};
      for (std::size_t i = 0; i < count; ++i) times[i] = spikes[first + i].time.count();
      if (::send(loopback_.sender_, times.data(), count * sizeof times[0], 0) < 0) {
        return Unexpected<SinkError>({.sentence = no_loopback().sentence});
      }
      loopback_.sent_ += count;
      delivered_ += count;
    }
    return {};
  }
  Expected<void, SinkError> close() override { return {}; }
  [[nodiscard]] std::uint64_t delivered() const noexcept override { return delivered_; }

 private:
  UdpLoopback& loopback_;
  std::uint64_t delivered_ = 0;
  std::string uri_ = "udp:127.0.0.1";
};

Expected<std::unique_ptr<UdpLoopback>, SetupError> UdpLoopback::open(Receive receive) {
  const int receiver = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const int sender = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof address;
  const timeval patience{.tv_sec = 0, .tv_usec = 50'000};
  auto* const generic = reinterpret_cast<sockaddr*>(&address);
  if (receiver < 0 || sender < 0 || ::bind(receiver, generic, length) != 0 ||
      ::getsockname(receiver, generic, &length) != 0 || ::connect(sender, generic, length) != 0 ||
      ::setsockopt(receiver, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience) != 0) {
    const SetupError error = no_loopback();
    ::close(receiver);
    ::close(sender);
    return Unexpected<SetupError>(error);
  }
  return std::unique_ptr<UdpLoopback>(new UdpLoopback(sender, receiver, std::move(receive)));
}

UdpLoopback::UdpLoopback(int sender, int receiver, Receive receive)
    : sender_(sender),
      receiver_(receiver),
      receive_(std::move(receive)),
      thread_([this](const std::stop_token& stop) { receive_all(stop); }) {}

UdpLoopback::~UdpLoopback() {
  thread_.request_stop();
  thread_.join();
  ::close(sender_);
  ::close(receiver_);
}

std::unique_ptr<Sink> UdpLoopback::sink() { return std::make_unique<CountingSink>(*this); }

void UdpLoopback::settle() const {
  for (int i = 0; i < 200 && received() < sent(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  }
}

void UdpLoopback::receive_all(const std::stop_token& stop) {
  set_up_helper_thread("merkel-udp");
  std::array<std::int64_t, kSpikesADatagram> times{};
  while (!stop.stop_requested()) {
    const ssize_t bytes = ::recv(receiver_, times.data(), sizeof times, 0);
    if (bytes <= 0) continue;
    const std::size_t count = static_cast<std::size_t>(bytes) / sizeof times[0];
    for (std::size_t i = 0; i < count; ++i) receive_(std::chrono::nanoseconds{times[i]});
    received_ += count;
  }
}

}  // namespace merkel
