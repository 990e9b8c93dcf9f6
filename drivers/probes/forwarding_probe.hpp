#pragma once

#include <iterator>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/probe.hpp"

namespace merkel {

/// A probe in front of another one, which it owns. Passes every call on: a probe that changes some
/// of them derives from it, and cannot forget the others. It may add notices of its own.
class ForwardingProbe : public Probe {
 public:
  explicit ForwardingProbe(std::unique_ptr<Probe> probe) : probe_(std::move(probe)) {}

  using Probe::read;
  [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override {
    return probe_->outputs();
  }
  [[nodiscard]] Expected<std::size_t, ProbeError> read(
      Readings& readings, std::chrono::milliseconds patience) override {
    return probe_->read(readings, patience);
  }
  [[nodiscard]] std::string error_message() const override { return probe_->error_message(); }
  [[nodiscard]] ProbeStatus status() const override { return probe_->status(); }
  [[nodiscard]] std::vector<std::string> take_notices() override {
    std::vector<std::string> notices = probe_->take_notices();
    const std::scoped_lock lock(notices_mutex_);
    notices.insert(notices.end(), std::make_move_iterator(notices_.begin()),
                   std::make_move_iterator(notices_.end()));
    notices_.clear();
    return notices;
  }
  [[nodiscard]] bool request_tare(std::size_t output) noexcept override {
    return probe_->request_tare(output);
  }
  [[nodiscard]] std::size_t ports() const noexcept override { return probe_->ports(); }
  void add_listener(std::size_t port, PortListener& listener) override {
    probe_->add_listener(port, listener);
  }
  void remove_listener(std::size_t port, PortListener& listener) override {
    probe_->remove_listener(port, listener);
  }

 protected:
  /// Thread: any.
  void add_notice(std::string sentence) {
    const std::scoped_lock lock(notices_mutex_);
    notices_.push_back(std::move(sentence));
  }

 private:
  std::unique_ptr<Probe> probe_;
  std::mutex notices_mutex_;
  std::vector<std::string> notices_;  ///< guarded by notices_mutex_
};

}  // namespace merkel
