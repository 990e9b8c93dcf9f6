#include <charconv>
#include <chrono>
#include <utility>

#include "core/units.hpp"
#include "drivers/sinks/host_name.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "drivers/sinks/view/view_frames.hpp"
#include "drivers/sinks/view/view_scene.hpp"
#include "drivers/sinks/view/view_server.hpp"

namespace merkel {
namespace {

using std::chrono::steady_clock;

/// The live page: what happens, some 25 times a second, to every browser that looks.
class ViewSpikeSink final : public SpikeSink {
 public:
  ViewSpikeSink(std::string uri, ViewFrames frames, std::unique_ptr<ViewServer> server,
                std::chrono::nanoseconds period)
      : uri_(std::move(uri)),
        frames_(std::move(frames)),
        server_(std::move(server)),
        period_(period) {}

  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  [[nodiscard]] std::uint32_t wishes() const noexcept override {
    return kTicks | kStatus | kEvents;
  }

  [[nodiscard]] Expected<void, SinkError> write(std::span<const SpikeEvent> spikes) override {
    frames_.add(spikes);
    delivered_ += spikes.size();
    send_if_due();
    return {};
  }
  [[nodiscard]] Expected<void, SinkError> write_ticks(std::span<const TickRecord> ticks) override {
    frames_.add(ticks);
    send_if_due();
    return {};
  }
  [[nodiscard]] Expected<void, SinkError> write_events(std::span<const LoopEvent> events) override {
    frames_.add(events);
    return {};
  }
  [[nodiscard]] Expected<void, SinkError> write_status(const RunStatus& status) override {
    frames_.set(status);
    return {};
  }
  [[nodiscard]] Expected<void, SinkError> flush() override {
    send_if_due();
    return {};
  }
  [[nodiscard]] Expected<void, SinkError> close() override {
    server_->publish(frames_.take(ViewFrames::kOver));
    server_->finish();
    return {};
  }
  /// Given to the page; what a slow browser has missed, the page itself tells.
  [[nodiscard]] std::uint64_t delivered() const noexcept override { return delivered_; }

 private:
  void send_if_due() {
    const auto now = steady_clock::now();
    if (now < next_) return;
    server_->publish(frames_.take(0));
    next_ = std::max(next_ + period_, now);
  }

  std::string uri_;
  ViewFrames frames_;
  std::unique_ptr<ViewServer> server_;
  steady_clock::duration period_;
  steady_clock::time_point next_{};
  std::uint64_t delivered_ = 0;
};

}  // namespace

OpenedSink open_view_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const double rate_hz = options.number("rate_hz", 25.0, 1.0, 60.0);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  const bool port_only = uri.path.find(':') == std::string::npos;
  const auto address = HostAndPort::parse(port_only ? "127.0.0.1:" + uri.path : uri.path);
  if (!address) {
    return bad_input("\"" + uri.text + "\": name a port, as in view:8080, or an address and port");
  }
  if (!setup.allow_remote && !address->loopback()) return remote_refused(uri.text, address->host);
  auto server = ViewServer::start({.host = address->host,
                                   .port = address->port,
                                   .hello = view_scene_json(setup, false),
                                   .steering_hello = {},
                                   .token = {}});
  if (!server) return Unexpected<SetupError>(server.error());
  return std::make_unique<ViewSpikeSink>(uri.text, ViewFrames(setup), std::move(*server),
                                         units::nanoseconds_from_s(1.0 / rate_hz));
}

}  // namespace merkel
