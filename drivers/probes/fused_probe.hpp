#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "core/expected.hpp"
#include "drivers/probe.hpp"

namespace merkel {

/// Several devices as one probe, such as a force gauge on a stage: `fused:URI|URI|…`. The samples
/// are those of the first member. The other members' readings are interpolated to their times, on
/// the host's clock, and fill the channels that the first member lacks. A sample waits for the
/// others for up to `kPatience` after its arrival. Then their last values are held if they are no
/// older than that; otherwise the sample is dropped, so that the press is released. A doubt of any
/// member is one of the sample, and a tare of any member is marked. Each member is read in its own
/// thread.
class FusedProbe final : public Probe {
 public:
  static constexpr std::chrono::milliseconds kPatience{100};

  /// \param text  the URI, "fused:" and its members
  /// \param allow_remote  as in open_probe()
  [[nodiscard]] static Expected<std::unique_ptr<Probe>, SetupError> open(std::string_view text,
                                                                         bool allow_remote);
  /// The URIs of the members of such a probe; of another one, its own.
  [[nodiscard]] static std::vector<std::string_view> members_of(std::string_view uri);
  /// Fuses probes that are already open; the first one gives the times.
  [[nodiscard]] static Expected<std::unique_ptr<Probe>, SetupError> fuse(
      std::string_view uri, std::vector<std::unique_ptr<Probe>> members);
  ~FusedProbe() override;

  [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override { return {&info_, 1}; }
  using Probe::read;
  [[nodiscard]] Expected<std::size_t, ProbeError> read(Readings& readings,
                                                       std::chrono::milliseconds patience) override;
  [[nodiscard]] std::string error_message() const override;
  /// The sums of the members' counters; of times, the worst. Connected if all are.
  [[nodiscard]] ProbeStatus status() const override;
  [[nodiscard]] std::vector<std::string> take_notices() override;
  /// Tares the members that measure force or, if none does, all.
  [[nodiscard]] bool request_tare(std::size_t output) noexcept override;
  /// One per member, in their order.
  [[nodiscard]] std::size_t ports() const noexcept override { return members_.size(); }
  void add_listener(std::size_t port, PortListener& listener) override {
    members_[port].probe->add_listener(0, listener);
  }
  void remove_listener(std::size_t port, PortListener& listener) override {
    members_[port].probe->remove_listener(0, listener);
  }

 private:
  struct Member {
    std::unique_ptr<Probe> probe;
    std::uint32_t fills = 0;  ///< channels that it provides
    std::deque<ProbeSample> samples;
    std::vector<SyncEdge> edges = {};
    bool ended = false;
    std::string error_message;
  };
  FusedProbe(ProbeInfo info, std::vector<Member> members);
  void read_member(Member& member, const std::stop_token& stop);
  void drop_oldest(Member& member);
  enum class Fill { kFilled, kWait, kNever };
  Fill fill(ProbeSample& sample);

  ProbeInfo info_;
  std::vector<Member> members_;
  /// Guards samples, edges, ended and error_message of the members, and tared_.
  mutable std::mutex mutex_;
  bool tared_ = false;  ///< a member was, since the last sample that was delivered
  std::condition_variable more_;
  std::vector<std::jthread> threads_;
};

}  // namespace merkel
