#pragma once

#include <cstdint>
#include <optional>

#include "drivers/protocols/protocol.hpp"

namespace merkel {

/// Follows sequence numbers that increase by one and wrap after `bits` bits. The same rule for
/// every protocol:
///
/// - A small gap is loss. A large gap is loss only if the numbers go on from there; a larger one
///   than any outage explains is a restart.
/// - A record older than the newest one came late: it is dropped and counted as reordered. Its
///   number was counted as lost when the newer record came.
/// - A sender has restarted if its numbers went back and go on from there.
/// - Numbers of which fewer than a quarter follow their predecessor are no evidence of anything:
///   every record passes, nothing is counted, and a notice says so.
class SequenceCounter {
 public:
  struct Step {
    std::uint32_t lost = 0;  ///< missing numbers before this one
    bool duplicate = false;  ///< the same number again: drop the record
    bool late = false;       ///< older than the newest record: drop the record
    bool restarted = false;  ///< the sender has restarted

    [[nodiscard]] bool dropped() const noexcept { return duplicate || late; }
  };

  /// \param bits  of the counter, 4 to 32
  explicit SequenceCounter(unsigned bits) noexcept;

  /// Restarts with the next number: the device is known to have restarted.
  void forget() noexcept;
  /// The port was closed for a while: the next gap is loss, however large.
  void reopened() noexcept { reopened_ = true; }

  /// Takes the number of a record; counts duplicates and late records.
  Step next(std::uint32_t number, DeviceStream& stream);

 private:
  /// Numbers that do not go on from the newest one but may go on from each other.
  struct Run {
    std::uint32_t number = 0;  ///< the last one
    std::uint32_t length = 0;
  };
  struct Jump {
    std::uint32_t before = 0;  ///< the newest number before it
    std::uint32_t lost = 0;
    std::uint32_t length = 0;  ///< records since
  };
  [[nodiscard]] bool follows(std::uint32_t number, std::uint32_t previous) const noexcept;
  bool makes_sense(bool in_order, DeviceStream& stream);
  Step forward(std::uint32_t number, std::uint32_t step) noexcept;
  Step backward(std::uint32_t number, std::uint32_t step) noexcept;

  std::uint32_t mask_;
  std::uint32_t window_;  ///< largest small gap
  std::optional<std::uint32_t> last_;
  std::optional<Run> back_;
  std::optional<Jump> jump_;
  bool reopened_ = false;
  std::uint32_t in_order_ = 0;  ///< of the last 32 steps, one bit each
  std::uint32_t steps_ = 0;     ///< bits in use
  bool sense_ = true;
};

}  // namespace merkel
