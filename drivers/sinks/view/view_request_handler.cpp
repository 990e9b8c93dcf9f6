#include "drivers/sinks/view/view_request_handler.hpp"

#include <iterator>
#include <utility>

namespace merkel {
namespace {

constexpr std::size_t kMaxNotices = 64;
constexpr std::size_t kMaxTared = 64;  ///< probes of a scene

}  // namespace

ViewRequestHandler::ViewRequestHandler(const SinkSetup& setup, bool steers)
    : recording_(setup.recording), session_(setup.session) {
  if (steers && recording_) recording_->offer();
}

void ViewRequestHandler::attach(RunControl& control) {
  const std::lock_guard lock(mutex_);
  control_.store(&control);
  if (!watched_.empty()) control.watch(watched_);
}

void ViewRequestHandler::notice(std::string sentence) {
  const std::lock_guard lock(mutex_);
  if (notices_.size() < kMaxNotices) notices_.push_back(std::move(sentence));
}

std::vector<std::string> ViewRequestHandler::take_notices() {
  std::vector<std::string> all;
  {
    const std::lock_guard lock(mutex_);
    all = std::exchange(notices_, {});
  }
  if (!recording_) return all;
  std::vector<std::string> recorded = recording_->take_notices();
  std::move(recorded.begin(), recorded.end(), std::back_inserter(all));
  return all;
}

void ViewRequestHandler::watch(const std::vector<std::uint32_t>& neurons) {
  const std::lock_guard lock(mutex_);
  watched_ = neurons;
  if (RunControl* const control = control_.load()) control->watch(watched_);
}

void ViewRequestHandler::tare(std::uint32_t probe) {
  RunControl* const control = control_.load();
  if (probe == ViewRequest::kAllProbes) {
    bool any = false;
    for (std::size_t i = 0; control != nullptr && i < kMaxTared; ++i) {
      any = control->tare(i) || any;
    }
    if (!any) return notice("no probe can be tared: all are recordings or simulations");
    return mark("tare all");
  }
  const std::string name = "probe " + std::to_string(probe + 1);
  if (control == nullptr || !control->tare(probe)) {
    return notice(name + " cannot be tared: it is a recording or simulation, or does not exist");
  }
  mark("tare " + name);
}

void ViewRequestHandler::mark(std::string label) {
  RunControl* const control = control_.load();
  if (control == nullptr) return notice("cannot set a mark: no run is active");
  control->mark({.time = std::chrono::nanoseconds{newest_ns_.load(std::memory_order_relaxed)},
                 .label = std::move(label)});
}

void ViewRequestHandler::record(bool on) {
  if (!recording_) return notice("cannot record: this is not a live run");
  recording_->request(on);
}

StimulationSwitch* ViewRequestHandler::stimulation() const noexcept {
  if (session_) return &session_->stimulation;
  RunControl* const control = control_.load();
  return control != nullptr ? &control->stimulation() : nullptr;
}

bool ViewRequestHandler::stopped() const noexcept {
  const StimulationSwitch* const of_run = stimulation();
  return of_run != nullptr && of_run->stopped() != StimulationSwitch::By::kNone;
}

void ViewRequestHandler::set_stimulation(bool on) {
  StimulationSwitch* const of_run = stimulation();
  if (of_run == nullptr) return notice("stimulation has not begun: no run is active");
  if (on) {
    of_run->start();
  } else {
    of_run->stop(StimulationSwitch::By::kPage);
  }
}

void ViewRequestHandler::carry_out(const ViewRequest& request) {
  using Kind = ViewRequest::Kind;
  switch (request.kind) {
    case Kind::kWatch:
      return watch(request.neurons);
    case Kind::kTare:
      return tare(request.probe);
    case Kind::kMark:
      return mark(request.label);
    case Kind::kRecordStart:
    case Kind::kRecordStop:
      return record(request.kind == Kind::kRecordStart);
    case Kind::kStop:
    case Kind::kStart:
      return set_stimulation(request.kind == Kind::kStart);
    case Kind::kSeek:
      if (session_) session_->seek_s.store(request.time_s);
      return;
    case Kind::kPause:
    case Kind::kPlay:
      if (session_) session_->paused.store(request.kind == Kind::kPause);
      return;
  }
}

}  // namespace merkel
