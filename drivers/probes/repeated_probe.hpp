#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "drivers/probe.hpp"

namespace merkel {

/// Plays a recording or a simulated press again and again. The times of each round follow those of
/// the round before, one sample period later.
class RepeatedProbe final : public Probe {
 public:
  using Open = std::function<Expected<std::unique_ptr<Probe>, SetupError>()>;

  /// \param first  the first round. \param open  opens each further one
  /// \param rounds  0: without end
  RepeatedProbe(std::unique_ptr<Probe> first, Open open, std::uint64_t rounds);

  [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override { return {&info_, 1}; }
  using Probe::read;
  [[nodiscard]] Expected<std::size_t, ProbeError> read(Readings& readings,
                                                       std::chrono::milliseconds patience) override;
  [[nodiscard]] std::string error_message() const override {
    return error_message_.empty() ? round_->error_message() : error_message_;
  }
  [[nodiscard]] std::vector<std::string> take_notices() override;

 private:
  bool start_again();

  ProbeInfo info_;
  Open open_;
  std::uint64_t left_;  ///< rounds after this one
  bool endless_;
  std::unique_ptr<Probe> round_;
  std::optional<std::chrono::nanoseconds> first_;  ///< time of its first sample, as recorded
  std::chrono::nanoseconds last_{0};               ///< time of the last sample
  std::chrono::nanoseconds shift_{0};              ///< of this round
  std::uint32_t next_sequence_ = 0;
  std::string error_message_;
  std::mutex mutex_;  ///< guards notices_
  std::vector<std::string> notices_;
};

}  // namespace merkel
