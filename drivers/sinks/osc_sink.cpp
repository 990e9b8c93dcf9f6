#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lo/lo.h>
#include <netdb.h>
#include <sys/socket.h>

#include "core/units.hpp"
#include "drivers/clock/clock_pair.hpp"
#include "drivers/files/owned_descriptor.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "drivers/transports/host_name.hpp"

namespace merkel {
namespace {

constexpr std::size_t kSpikesPerBundle = 16;  ///< well below the smallest packet size of networks
constexpr std::int64_t kNtpEpoch_s = 2'208'988'800;  ///< seconds from 1900 to 1970

struct FreeBundle {
  void operator()(lo_bundle bundle) const { lo_bundle_free_recursive(bundle); }
};
using Bundle = std::unique_ptr<std::remove_pointer_t<lo_bundle>, FreeBundle>;

lo_timetag time_tag(std::chrono::nanoseconds utc) {
  const auto whole = std::chrono::floor<std::chrono::seconds>(utc);
  const auto rest = static_cast<std::uint64_t>((utc - whole).count());
  return {.sec = static_cast<std::uint32_t>(whole.count() + kNtpEpoch_s),
          .frac = static_cast<std::uint32_t>((rest << 32U) / 1'000'000'000U)};
}

/// The types of a message. Every OSC program reads `i`; `h` and `d` are optional in OSC 1.0, and
/// Pure Data and SuperCollider read them wrongly.
enum class OscTypes : std::uint8_t {
  kWhole,  ///< `,iiiiii`: neuron, sequence number, seconds and nanoseconds, patch, flags
  kExact   ///< `,ihdii`: neuron, sequence number, seconds, patch, flags
};
constexpr std::string_view kWholeTypes = "iiiiii";
constexpr std::string_view kExactTypes = "ihdii";

/// One message per spike. Messages are sent in bundles with the time of sending as time tag.
class OscSink final : public Sink {
 public:
  OscSink(std::string uri, OwnedDescriptor socket, std::string path, OscTypes types)
      : Sink(std::move(uri)), socket_(std::move(socket)), path_(std::move(path)), types_(types) {}

  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    const lo_timetag now = time_tag(read_clock_pair().utc);
    std::span<const SpikeEvent> spikes = batch.spikes;
    while (!spikes.empty()) {
      const auto some = spikes.first(std::min(spikes.size(), kSpikesPerBundle));
      spikes = spikes.subspan(some.size());
      const Bundle bundle(lo_bundle_new(now));
      for (const SpikeEvent& spike : some) {
        lo_bundle_add_message(bundle.get(), path_.c_str(), message_of(spike));
      }
      std::size_t size = lo_bundle_length(bundle.get());
      packet_.resize(size);
      lo_bundle_serialise(bundle.get(), packet_.data(), &size);
      // A missing receiver is no error: a late one sees the loss by the sequence numbers. Its
      // refusal of the packet before keeps this one from being sent.
      bool sent = send(size);
      if (!sent && errno == ECONNREFUSED) {
        sent_ -= std::exchange(newest_, 0);
        sent = send(size);
      }
      if (sent) {
        newest_ = some.size();
        sent_ += newest_;
      } else if (errno != ECONNREFUSED && errno != EAGAIN && errno != ENOBUFS) {
        return Unexpected<SinkError>({.sentence = uri_ + " failed: " + std::strerror(errno) +
                                                  "; check the network, then run again"});
      }
    }
    return {};
  }

  [[nodiscard]] Expected<void, SinkError> close() override {
    int error_number = 0;
    socklen_t size = sizeof error_number;
    ::getsockopt(socket_.get(), SOL_SOCKET, SO_ERROR, &error_number, &size);
    if (error_number == ECONNREFUSED) sent_ -= std::exchange(newest_, 0);
    return {};
  }
  [[nodiscard]] std::uint64_t delivered() const noexcept override { return sent_; }

 private:
  [[nodiscard]] bool send(std::size_t size) const {
    return ::send(socket_.get(), packet_.data(), size, MSG_NOSIGNAL | MSG_DONTWAIT) >= 0;
  }
  lo_message message_of(const SpikeEvent& spike) {
    const lo_message message = lo_message_new();
    ++sequence_;
    lo_message_add_int32(message, static_cast<std::int32_t>(spike.neuron));
    if (types_ == OscTypes::kExact) {
      lo_message_add_int64(message, sequence_);
      lo_message_add_double(message, units::s_from(spike.time));
    } else {
      const auto second = std::chrono::floor<std::chrono::seconds>(spike.time);
      lo_message_add_int32(message, static_cast<std::int32_t>(sequence_ & 0x7FFFFFFF));
      lo_message_add_int32(message, static_cast<std::int32_t>(second.count()));
      lo_message_add_int32(message, static_cast<std::int32_t>((spike.time - second).count()));
    }
    lo_message_add_int32(message, spike.patch);
    lo_message_add_int32(message, spike.flags);
    return message;
  }

  OwnedDescriptor socket_;
  std::string path_;
  OscTypes types_;
  std::vector<char> packet_;
  std::int64_t sequence_ = 0;
  std::uint64_t sent_ = 0;
  std::uint64_t newest_ = 0;  ///< spikes of the newest packet, which may yet be refused
};

/// A UDP socket to one address, IPv4 or IPv6. (liblo builds the packets, but its own addresses are
/// IPv4 only.)
Expected<OwnedDescriptor, std::string> connected_socket(const HostAndPort& to) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  const std::string port = std::to_string(to.port);
  if (const int error = ::getaddrinfo(to.host.c_str(), port.c_str(), &hints, &found); error != 0) {
    return Unexpected<std::string>(::gai_strerror(error));
  }
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> all(found, ::freeaddrinfo);
  int error_number = 0;
  for (const addrinfo* each = found; each != nullptr; each = each->ai_next) {
    OwnedDescriptor socket(::socket(each->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    if (socket.get() >= 0 && ::connect(socket.get(), each->ai_addr, each->ai_addrlen) == 0) {
      return socket;
    }
    error_number = errno;
  }
  return Unexpected<std::string>(std::strerror(error_number));
}

}  // namespace

OpenedSink open_osc_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const std::string path = options.text("path", "/merkel/spike");
  const std::string types = options.word("types", kWholeTypes, "iiiiii|ihdii");
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  const auto address = HostAndPort::parse(uri.path);
  if (!address) {
    return bad_input("\"" + uri.text +
                     "\": the address must be HOST:PORT, for example osc:127.0.0.1:9000");
  }
  if (path.empty() || path.front() != '/' || path.find_first_of(" #*,?[]{}") != std::string::npos) {
    return bad_input("\"" + uri.text + "\": the option path must be an OSC address such as " +
                     "/merkel/spike, but is \"" + path + "\"");
  }
  if (!setup.allow_remote && !address->loopback()) return remote_refused(uri.text, address->host);
  if (!address->known()) {
    return bad_input("\"" + uri.text + "\": cannot find the host \"" + address->host +
                     "\": check its name, or use its address");
  }
  auto socket = connected_socket(*address);
  if (!socket) {
    return bad_input("\"" + uri.text + "\": cannot send to this address: " + socket.error());
  }
  return std::make_unique<OscSink>(uri.text, std::move(*socket), path,
                                   types == kExactTypes ? OscTypes::kExact : OscTypes::kWhole);
}

}  // namespace merkel
