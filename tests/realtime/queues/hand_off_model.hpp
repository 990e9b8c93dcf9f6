#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/math/random.hpp"

namespace merkel {

/// A model of the hand-off between a writing and a reading thread: a bounded queue and a flag that
/// is set after the last item. Each thread is a list of atomic steps, which a scheduler interleaves
/// at random. A write may reach the other thread several steps after it was made, in any order that
/// release and acquire allow. The model checks the protocol on all interleavings that the random
/// scheduler produces, rather than on those that one machine happens to show.
class HandOffModel {
 public:
  struct Protocol {
    bool reads_flag_first = true;  ///< the reader reads the flag before the queue
    bool releases_items = true;    ///< the writer's index is stored with release
    bool releases_flag = true;     ///< the flag is set with release
    bool waits_when_full = true;  ///< like a recording's reader; a device's reader drops and counts
  };
  struct Outcome {
    std::vector<int> taken;
    int dropped = 0;
    bool finished = false;  ///< the reader saw the end
  };

  HandOffModel(const Protocol& protocol, int items, int capacity, std::uint64_t seed)
      : protocol_(protocol), items_(items), capacity_(capacity), random_(seed) {}

  Outcome run() {
    cells_.assign(static_cast<std::size_t>(capacity_), kUnwritten);
    for (int step = 0; step < 100'000 && !outcome_.finished; ++step) {
      if (random_.uniform() < 0.3) {
        deliver_one();
      } else if (random_.uniform() < 0.5) {
        write_step();
      } else {
        read_step();
      }
    }
    return outcome_;
  }

 private:
  static constexpr int kUnwritten = -1;
  enum class Place : std::uint8_t { kCell, kTail, kEnded };
  /// A write on its way to the reader's view of memory.
  struct Write {
    Place place;
    std::size_t index;
    int value;
    bool release;  ///< arrives after all earlier writes
  };

  void make(const Write& write) { on_the_way_.push_back(write); }

  void deliver_one() {
    if (on_the_way_.empty()) return;
    const auto chosen =
        static_cast<std::size_t>(random_.uniform() * static_cast<double>(on_the_way_.size()));
    const Write write = on_the_way_[chosen];
    if (write.release && chosen > 0) return;
    for (std::size_t i = 0; i < chosen; ++i) {
      // Writes to one place keep their order.
      if (on_the_way_[i].place == write.place && on_the_way_[i].index == write.index) return;
    }
    on_the_way_.erase(on_the_way_.begin() + static_cast<std::ptrdiff_t>(chosen));
    switch (write.place) {
      case Place::kCell:
        cells_[write.index] = write.value;
        break;
      case Place::kTail:
        tail_ = write.value;
        break;
      case Place::kEnded:
        ended_ = true;
        break;
    }
  }

  void write_step() {
    if (written_ == items_) {
      if (!flagged_) make({Place::kEnded, 0, 1, protocol_.releases_flag});
      flagged_ = true;
      return;
    }
    if (!cell_written_) {
      // The reader's index also reaches the writer late, which can only make the queue look fuller
      // than it is: `head_seen_` lags behind `head_`.
      if (random_.uniform() < 0.5) head_seen_ = head_;
      if (pushed_ - head_seen_ == capacity_) {
        if (protocol_.waits_when_full) return;
        ++outcome_.dropped;
        ++written_;
        return;
      }
      make({Place::kCell, static_cast<std::size_t>(pushed_ % capacity_), written_, false});
      cell_written_ = true;
      return;
    }
    make({Place::kTail, 0, ++pushed_, protocol_.releases_items});
    ++written_;
    cell_written_ = false;
  }

  /// Reads the flag once, or tries once to take an item, in the protocol's order.
  void read_step() {
    if (looks_at_flag_) {
      flag_was_set_ = ended_;
      looks_at_flag_ = false;
      if (!protocol_.reads_flag_first && found_empty_ && flag_was_set_) outcome_.finished = true;
      return;
    }
    if (head_ < tail_) {
      outcome_.taken.push_back(cells_[static_cast<std::size_t>(head_ % capacity_)]);
      cells_[static_cast<std::size_t>(head_ % capacity_)] = kUnwritten;
      ++head_;
      found_empty_ = false;
      return;  // and tries again, with the flag as read before
    }
    found_empty_ = true;
    if (protocol_.reads_flag_first && flag_was_set_) outcome_.finished = true;
    looks_at_flag_ = true;
  }

  Protocol protocol_;
  int items_;
  int capacity_;
  Random random_;
  Outcome outcome_;

  // State of the writer.
  int written_ = 0;  ///< items produced
  int pushed_ = 0;   ///< of these, put into the queue
  bool cell_written_ = false;
  bool flagged_ = false;
  int head_seen_ = 0;
  std::vector<Write> on_the_way_;

  // Memory as the reader sees it.
  std::vector<int> cells_;
  int tail_ = 0;
  bool ended_ = false;

  // State of the reader.
  int head_ = 0;
  bool looks_at_flag_ = true;
  bool flag_was_set_ = false;
  bool found_empty_ = false;
};

}  // namespace merkel
