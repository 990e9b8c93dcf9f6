#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "drivers/sink_setup.hpp"
#include "drivers/sinks/recording_switch.hpp"
#include "drivers/sinks/session_position.hpp"
#include "drivers/sinks/view/view_request.hpp"

namespace merkel {

/// Executes the requests of pages and keeps the answers until the next frame. Thread: any.
class ViewRequestHandler {
 public:
  /// \param steers  whether pages may control the run
  ViewRequestHandler(const SinkSetup& setup, bool steers);

  /// Pages may already have chosen neurons to watch; they are passed on.
  /// \param control  must outlive the use of this object
  void attach(RunControl& control);
  /// Sets the time of the newest tick, which marks get.
  void set_time(std::chrono::nanoseconds newest) noexcept {
    newest_ns_.store(newest.count(), std::memory_order_relaxed);
  }
  void carry_out(const ViewRequest& request);

  /// Messages for the users of the pages.
  [[nodiscard]] std::vector<std::string> take_notices();
  [[nodiscard]] bool recording() const noexcept { return recording_ && recording_->recording(); }
  /// Whether stimulation is stopped by hand.
  [[nodiscard]] bool stopped() const noexcept;
  [[nodiscard]] RunControl* control() const noexcept { return control_.load(); }
  [[nodiscard]] SessionPosition* session() const noexcept { return session_.get(); }

 private:
  void watch(const std::vector<std::uint32_t>& neurons);
  void tare(std::uint32_t probe);
  void mark(std::string label);
  void record(bool on);
  /// Null if there is no run yet.
  [[nodiscard]] StimulationSwitch* stimulation() const noexcept;
  void set_stimulation(bool on);
  void notice(std::string sentence);

  std::shared_ptr<RecordingSwitch> recording_;
  std::shared_ptr<SessionPosition> session_;
  std::atomic<RunControl*> control_{nullptr};
  std::atomic<std::int64_t> newest_ns_{0};
  std::mutex mutex_;
  std::vector<std::string> notices_;
  std::vector<std::uint32_t> watched_;
};

}  // namespace merkel
