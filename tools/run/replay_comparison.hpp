#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <span>
#include <string>
#include <utility>

namespace merkel {

/// Compares the items that a replay makes with the recorded ones, in order and bit for bit.
template <class Item>
class ReplayComparison {
 public:
  using Describe = std::function<std::string(const Item&)>;

  /// \param noun, preposition  for sentences: "a {spike} {of} {description}"
  ReplayComparison(std::string noun, std::string preposition, Describe describe)
      : noun_(std::move(noun)),
        preposition_(std::move(preposition)),
        describe_(std::move(describe)) {}

  /// Adds recorded items, before the replay makes them.
  void expect(std::span<const Item> recorded) {
    if (difference_.empty()) recorded_.insert(recorded_.end(), recorded.begin(), recorded.end());
  }
  void take(std::span<const Item> made) {
    made_ += made.size();
    for (const Item& item : made) {
      if (!difference_.empty()) return;
      if (recorded_.empty()) {
        difference_ = "the replay has " + named(item) + ", which the recording does not have";
      } else if (recorded_.front() != item) {
        difference_ = "the replay has " + named(item) + ", but the recording has one " +
                      preposition_ + " " + describe_(recorded_.front());
      } else {
        recorded_.pop_front();
      }
    }
  }
  /// Notes that the replay should have made the next recorded item.
  void miss() {
    if (!difference_.empty()) return;
    difference_ =
        "the recording has " + named(recorded_.front()) + ", which the replay does not have";
  }

  /// The recorded items that are still to come.
  [[nodiscard]] const std::deque<Item>& remaining() const noexcept { return recorded_; }
  /// Number of items that the replay made.
  [[nodiscard]] std::uint64_t made() const noexcept { return made_; }
  /// Empty if every item equals the recorded one; else the first difference, as a sentence.
  [[nodiscard]] const std::string& difference() const noexcept { return difference_; }

 private:
  [[nodiscard]] std::string named(const Item& item) const {
    return "a " + noun_ + " " + preposition_ + " " + describe_(item);
  }

  std::string noun_;
  std::string preposition_;
  Describe describe_;
  std::deque<Item> recorded_;
  std::uint64_t made_ = 0;
  std::string difference_;
};

}  // namespace merkel
