#include <chrono>
#include <random>
#include <utility>

#include "core/printed.hpp"
#include "core/units.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "drivers/sinks/view/view_frames.hpp"
#include "drivers/sinks/view/view_request_handler.hpp"
#include "drivers/sinks/view/view_scene.hpp"
#include "drivers/sinks/view/view_server.hpp"
#include "drivers/transports/host_name.hpp"

namespace merkel {
namespace {

using std::chrono::steady_clock;

/// The live page: sends the run's state to every open browser about 25 times a second.
class ViewSink final : public Sink {
 public:
  ViewSink(std::string uri, std::string address, ViewFrames frames,
           std::shared_ptr<ViewRequestHandler> requests, std::unique_ptr<ViewServer> server,
           std::chrono::nanoseconds period)
      : Sink(std::move(uri)),
        address_(std::move(address)),
        frames_(std::move(frames)),
        requests_(std::move(requests)),
        server_(std::move(server)),
        period_(period) {}

  [[nodiscard]] std::string address() const override { return address_; }
  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kKinds<SpikeEvent, SentCommand, TaxelBlock, TickRecord, LoopEvent, NeuronSample, Mark,
                  SyncEdge, RunStatus>;
  }
  void attach(RunControl& control) override { requests_->attach(control); }

  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    follow_jumps();
    frames_.add(batch);
    // To the page's server; the page reports the frames that it missed.
    delivered_ += batch.spikes.size();
    if (!batch.ticks.empty()) requests_->set_time(batch.ticks.back().time);
    send_if_due();
    return {};
  }
  [[nodiscard]] Expected<void, SinkError> flush() override {
    send_if_due();
    return {};
  }
  [[nodiscard]] Expected<void, SinkError> close() override {
    send(ViewFrames::kOver);
    server_->finish();
    return {};
  }

 private:
  /// After a seek in a played session, pages discard earlier data.
  void follow_jumps() {
    const SessionPosition* const session = requests_->session();
    if (session == nullptr || session->jumps.load() == jumps_) return;
    jumps_ = session->jumps.load();
    frames_.forget();
    forget_ = true;
  }

  void send_if_due() {
    const auto now = steady_clock::now();
    if (now < next_) return;
    send(0);
    next_ = std::max(next_ + period_, now);
  }

  void send(std::uint32_t flags) {
    for (const std::string& sentence : requests_->take_notices()) frames_.add_notice(sentence);
    if (requests_->recording()) flags |= ViewFrames::kRecording;
    if (requests_->session() != nullptr && requests_->session()->paused)
      flags |= ViewFrames::kStill;
    if (requests_->stopped()) flags |= ViewFrames::kStopped;
    const bool first = std::exchange(forget_, false);
    if (first) flags |= ViewFrames::kDiscard;
    if (const RunControl* const control = requests_->control()) frames_.set_links(*control);
    server_->publish(frames_.take(flags), first);
  }

  std::string address_;
  ViewFrames frames_;
  std::shared_ptr<ViewRequestHandler> requests_;
  std::unique_ptr<ViewServer> server_;  ///< destroyed before the requests that it uses
  steady_clock::duration period_;
  steady_clock::time_point next_{};
  std::uint32_t jumps_ = 0;
  bool forget_ = false;
};

/// 128 random bits in hexadecimal.
std::string random_token() {
  std::random_device random;
  std::string token;
  for (int i = 0; i < 4; ++i) token += printed("%08x", random());
  return token;
}

}  // namespace

OpenedSink open_view_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const double rate_hz = options.number("rate_hz", 25.0, 1.0, 60.0);
  const bool steers = options.whole("control", 0, 0, 1) == 1;
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  const bool port_only = uri.path.find(':') == std::string::npos;
  const auto address = HostAndPort::parse(port_only ? "127.0.0.1:" + uri.path : uri.path);
  if (!address) {
    return bad_input("\"" + uri.text + "\": give a port, as in view:8080, or an address and port");
  }
  if (!setup.allow_remote && !address->loopback()) return remote_refused(uri.text, address->host);
  const std::string token = steers ? random_token() : "";
  auto requests = std::make_shared<ViewRequestHandler>(setup, steers);
  ViewScene scene(setup, steers);
  auto server = ViewServer::start(
      {.host = address->host,
       .port = address->port,
       .hello = std::move(scene.viewing),
       .steering_hello = std::move(scene.steering),
       .token = token,
       .on_request = [requests](const ViewRequest& request) { requests->carry_out(request); }});
  if (!server) return Unexpected<SetupError>(server.error());
  const std::string page = "http://" + (port_only ? "127.0.0.1:" : std::string()) + uri.path + "/" +
                           (steers ? "?token=" + token : "");
  return std::make_unique<ViewSink>(uri.text, page, ViewFrames(setup), std::move(requests),
                                    std::move(*server), units::nanoseconds_from_s(1.0 / rate_hz));
}

}  // namespace merkel
