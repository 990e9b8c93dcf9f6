#include "drivers/sinks/recording_switch.hpp"

#include <array>
#include <ctime>
#include <optional>

#include "drivers/sessions/session_records.hpp"
#include "drivers/sinks/sink_openers.hpp"

namespace merkel {
namespace {

/// "session-20260131-154500.xdf", in local time.
std::string dated_name() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  ::localtime_r(&now, &local);
  std::array<char, 64> text{};
  std::strftime(text.data(), text.size(), "session-%Y%m%d-%H%M%S.xdf", &local);
  return text.data();
}

class SessionOnRequest final : public Sink {
 public:
  SessionOnRequest(std::shared_ptr<RecordingSwitch> recording, SinkSetup setup)
      : Sink("xdf:on-request"), recording_(std::move(recording)), setup_(std::move(setup)) {
    setup_.overwrite = false;
    setup_.session_journal = nullptr;
  }

  [[nodiscard]] std::uint32_t subscriptions() const noexcept override { return kSessionKinds; }
  [[nodiscard]] Expected<void, SinkError> begin(const RunOrigin& origin) override {
    origin_ = origin;
    return {};
  }
  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    if (!session_) unasked_ += batch.spikes.size();
    auto result = pass([&](Sink& session) { return session.write(batch); });
    if (!batch.ticks.empty()) follow_switch();
    return result;
  }
  [[nodiscard]] Expected<void, SinkError> flush() override {
    follow_switch();
    return pass([](Sink& session) { return session.flush(); });
  }
  [[nodiscard]] Expected<void, SinkError> close() override {
    stop();
    return {};
  }
  /// Spikes outside a recording count as delivered.
  [[nodiscard]] std::uint64_t delivered() const noexcept override {
    return unasked_ + recorded_ + (session_ ? session_->delivered() : 0);
  }

 private:
  /// Called between ticks, so that a recording holds only complete ticks.
  void follow_switch() {
    if (recording_->requested() == static_cast<bool>(session_)) return;
    if (session_) return stop();
    path_ = dated_name();
    const auto uri = Uri::parse("xdf:" + path_);
    auto opened =
        uri ? open_xdf_sink(*uri, setup_) : OpenedSink(Unexpected<SetupError>(uri.error()));
    if (!opened) {
      recording_->request(false);
      return recording_->report(false, opened.error().sentence);
    }
    session_ = std::move(*opened);
    recording_->report(true, "recording " + path_);
    static_cast<void>(pass([this](Sink& session) { return session.begin(origin_); }));
  }

  void stop() {
    if (!session_) return;
    const auto closed = session_->close();
    recorded_ += session_->delivered();
    session_.reset();
    recording_->report(false, closed ? "recorded " + path_ : closed.error().sentence);
  }

  /// Writes to the session. An error ends the recording but not the run.
  template <class Write>
  Expected<void, SinkError> pass(const Write& write) {
    if (!session_) return {};
    if (const auto written = write(*session_); !written) {
      recorded_ += session_->delivered();
      session_.reset();
      recording_->request(false);
      recording_->report(false, "the recording ended: " + written.error().sentence);
    }
    return {};
  }

  std::shared_ptr<RecordingSwitch> recording_;
  SinkSetup setup_;
  std::unique_ptr<Sink> session_;  ///< null without a recording
  std::string path_;
  RunOrigin origin_;
  std::uint64_t unasked_ = 0;
  std::uint64_t recorded_ = 0;
};

}  // namespace

std::unique_ptr<Sink> session_on_request(std::shared_ptr<RecordingSwitch> recording,
                                         SinkSetup setup) {
  return std::make_unique<SessionOnRequest>(std::move(recording), std::move(setup));
}

}  // namespace merkel
