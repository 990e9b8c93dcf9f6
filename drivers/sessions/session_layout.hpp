#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"
#include "drivers/sessions/session_format.hpp"

namespace pugi {
class xml_node;
}

namespace merkel {

/// Which of merkel's streams one of a file is.
struct NamedStream {
  const SessionStream* stream = nullptr;
  bool states = false;      ///< the stream of states of `stream`
  std::uint32_t probe = 0;  ///< of a stream that each probe has

  friend bool operator==(const NamedStream&, const NamedStream&) = default;
};

/// Nothing if the stream is of another program.
[[nodiscard]] std::optional<NamedStream> stream_named(std::string_view name);

/// The positions of a stream's channels in a file. Channels are matched by label, so their order
/// and additional channels do not matter.
struct StreamLayout : NamedStream {
  static constexpr std::uint8_t kMissing = 0xFF;
  /// A further column of samples: its place in the file and in DeliveredSample::further.
  struct Extra {
    std::uint8_t place;
    std::uint8_t column;
  };

  std::size_t channels = 0;  ///< in the file
  /// The position in the file of each channel of `stream`.
  std::array<std::uint8_t, kMaxSessionChannels> places{};
  std::vector<Extra> extra = {};
  std::size_t extra_columns = 0;  ///< of all probes: those that this one lacks are NaN

  [[nodiscard]] bool has(std::size_t channel) const noexcept { return places[channel] != kMissing; }
};

/// The layout of a stream in a file, or an error.
/// \param info           of the stream's header
/// \param extra_columns  of the samples of all probes; gets the new ones
[[nodiscard]] Expected<StreamLayout, std::string> layout_of(
    const NamedStream& named, const pugi::xml_node& info, std::vector<std::string>& extra_columns);

}  // namespace merkel
