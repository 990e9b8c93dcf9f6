#include <array>
#include <chrono>
#include <limits>
#include <memory>
#include <utility>

#include <lo/lo.h>

#include "core/units.hpp"
#include "drivers/clock/clock_pair.hpp"
#include "drivers/sinks/host_name.hpp"
#include "drivers/sinks/sink_openers.hpp"

namespace merkel {
namespace {

constexpr std::size_t kSpikesPerBundle = 16;         ///< well below a network's smallest packets
constexpr std::int64_t kNtpEpoch_s = 2'208'988'800;  ///< 1970 in seconds since 1900

struct FreeAddress {
  void operator()(lo_address address) const { lo_address_free(address); }
};
struct FreeBundle {
  void operator()(lo_bundle bundle) const { lo_bundle_free_recursive(bundle); }
};
using Address = std::unique_ptr<std::remove_pointer_t<lo_address>, FreeAddress>;
using Bundle = std::unique_ptr<std::remove_pointer_t<lo_bundle>, FreeBundle>;

lo_timetag time_tag(std::chrono::nanoseconds utc) {
  const auto whole = std::chrono::floor<std::chrono::seconds>(utc);
  const auto rest = static_cast<std::uint64_t>((utc - whole).count());
  return {.sec = static_cast<std::uint32_t>(whole.count() + kNtpEpoch_s),
          .frac = static_cast<std::uint32_t>((rest << 32U) / 1'000'000'000U)};
}

/// A message a spike, `,ihdii`: neuron, sequence number, probe time in seconds, patch, flags; in
/// bundles whose time tag is the time of sending.
class OscSpikeSink final : public SpikeSink {
 public:
  OscSpikeSink(std::string uri, Address address, std::string path)
      : uri_(std::move(uri)), address_(std::move(address)), path_(std::move(path)) {}

  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }

  [[nodiscard]] Expected<void, SinkError> write(std::span<const SpikeEvent> spikes) override {
    const lo_timetag now = time_tag(read_clock_pair().utc);
    while (!spikes.empty()) {
      const auto some = spikes.first(std::min(spikes.size(), kSpikesPerBundle));
      spikes = spikes.subspan(some.size());
      const Bundle bundle(lo_bundle_new(now));
      for (const SpikeEvent& spike : some) {
        const lo_message message = lo_message_new();
        lo_message_add_int32(message, static_cast<std::int32_t>(spike.neuron));
        lo_message_add_int64(message, ++sequence_);
        lo_message_add_double(message, units::s_from(spike.time));
        lo_message_add_int32(message, spike.patch);
        lo_message_add_int32(message, spike.flags);
        lo_bundle_add_message(bundle.get(), path_.c_str(), message);
      }
      // Nobody listening is no failure: who comes later sees by the numbers what was missed.
      if (lo_send_bundle(address_.get(), bundle.get()) >= 0) sent_ += some.size();
    }
    return {};
  }

  [[nodiscard]] Expected<void, SinkError> close() override { return {}; }
  [[nodiscard]] std::uint64_t delivered() const noexcept override { return sent_; }

 private:
  std::string uri_;
  Address address_;
  std::string path_;
  std::int64_t sequence_ = 0;
  std::uint64_t sent_ = 0;
};

}  // namespace

OpenedSink open_osc_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const std::string path = options.text("path", "/merkel/spike");
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
    return bad_input("\"" + uri.text + "\": there is no host \"" + address->host +
                     "\": check its name, or write its address");
  }
  Address target(lo_address_new(address->host.c_str(), std::to_string(address->port).c_str()));
  if (!target) return bad_input("\"" + uri.text + "\": this is not an address to send to");
  return std::make_unique<OscSpikeSink>(uri.text, std::move(target), path);
}

}  // namespace merkel
