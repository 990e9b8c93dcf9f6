#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace merkel {

/// A request of a page to its run: one line of text.
///
///   watch [NEURON]…         send drive and potential of these afferents, at most kMaxWatched
///   tare PROBE | all        tare a probe, or all of them; probes count from 0
///   mark LABEL              mark this instant with a label of at most kMaxLabel bytes
///   record start | stop     record a session
///   stop | start            stop stimulation; start it again
///   seek SECONDS            replay only: go to a time
///   pause | play            replay only: pause; continue
struct ViewRequest {
  enum class Kind {
    kWatch,
    kTare,
    kMark,
    kRecordStart,
    kRecordStop,
    kStop,
    kStart,
    kSeek,
    kPause,
    kPlay
  };
  static constexpr std::size_t kMaxWatched = 4;
  static constexpr std::size_t kMaxLabel = 200;
  static constexpr std::uint32_t kAllProbes = UINT32_MAX;

  Kind kind = Kind::kWatch;
  std::vector<std::uint32_t> neurons = {};
  std::uint32_t probe = 0;
  double time_s = 0.0;
  std::string label = {};

  /// True for requests that change a run or its recording; they need the token. Stopping needs
  /// none: it must always work.
  [[nodiscard]] bool steers() const noexcept {
    return kind == Kind::kTare || kind == Kind::kMark || kind == Kind::kRecordStart ||
           kind == Kind::kRecordStop || kind == Kind::kStart;
  }

  /// Empty if the text is not one of the above. Accepts any bytes.
  [[nodiscard]] static std::optional<ViewRequest> parse(std::string_view text);
};

}  // namespace merkel
