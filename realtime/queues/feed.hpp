#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "core/realtime_tag.hpp"
#include "core/records/mark.hpp"
#include "core/records/record_batch.hpp"
#include "realtime/queues/bounded_queue.hpp"
#include "realtime/queues/counter.hpp"
#include "realtime/queues/reading_ring.hpp"

namespace merkel {

/// Records of one kind on their way from one thread to one consumer. What does not fit is dropped
/// and counted.
template <class Record>
class Feed {
 public:
  explicit Feed(std::size_t capacity) : queue_(capacity) {}

  /// False when full. Real-time: yes. Thread: the producer.
  [[nodiscard]] bool try_push(const Record& record) noexcept MERKEL_REALTIME {
    return queue_.try_push(record);
  }
  /// Counts records that did not fit. Real-time: yes. Thread: the producer.
  void drop(std::uint64_t records = 1) noexcept MERKEL_REALTIME { dropped_.add(records); }
  /// No record follows. Thread: the producer, or any after it has stopped.
  void end() noexcept { ended_.store(true, std::memory_order_release); }

  /// Real-time: yes. Thread: the consumer.
  [[nodiscard]] bool try_pop(Record& record) noexcept MERKEL_REALTIME {
    return queue_.try_pop(record);
  }
  /// Appends waiting records, at most `most`. Thread: the consumer.
  void take(std::vector<Record>& records, std::size_t most = SIZE_MAX) {
    Record record;
    for (; most > 0 && queue_.try_pop(record); --most) records.push_back(record);
  }
  /// The records that wait, at least. Thread: the consumer.
  [[nodiscard]] std::size_t waiting() const noexcept { return queue_.size_approx(); }
  /// True once no record follows those that wait. Thread: any.
  [[nodiscard]] bool ended() const noexcept { return ended_.load(std::memory_order_acquire); }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_.value(); }

 private:
  BoundedQueue<Record> queue_;
  Counter dropped_;
  std::atomic<bool> ended_{false};
};

/// Of the samples of one probe, with their further columns.
template <>
class Feed<DeliveredSample> {
 public:
  /// \param columns  of the probe; its taxels are not passed on
  Feed(std::size_t capacity, std::uint32_t probe, const ProbeColumns& columns)
      : probe_(probe), ring_(ReadingColumns(ProbeColumns{.further = columns.further}), capacity) {}

  /// \param row  as it begins with the press of the probe. Thread: the producer.
  [[nodiscard]] bool try_push(const ReadingHead& head, std::span<const double> row) noexcept {
    return ring_.try_push(head, row.first(ring_.columns().width()));
  }
  void drop(std::uint64_t records = 1) noexcept { dropped_.add(records); }
  void end() noexcept { ended_.store(true, std::memory_order_release); }

  /// Appends waiting records, at most `most`. Thread: the consumer.
  void take(std::vector<DeliveredSample>& records, std::size_t most = SIZE_MAX) {
    const ProbeColumns& columns = ring_.columns().of(0);
    for (const ReadingHead* head = nullptr; most > 0 && (head = ring_.front(0)) != nullptr;
         --most) {
      const std::span<const double> row = ring_.front_row(0);
      const auto further = columns.further_in(row);
      records.push_back({.probe = probe_,
                         .sample = columns.sample(*head, row),
                         .further = {further.begin(), further.end()}});
      ring_.pop(0);
    }
  }
  [[nodiscard]] std::size_t waiting() const noexcept { return ring_.size_approx(); }
  [[nodiscard]] bool ended() const noexcept { return ended_.load(std::memory_order_acquire); }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_.value(); }

 private:
  std::uint32_t probe_;
  ReadingRing ring_;
  Counter dropped_;
  std::atomic<bool> ended_{false};
};

/// Marks hold text, and any thread but the simulation's may add them.
template <>
class Feed<Mark> {
 public:
  explicit Feed(std::size_t capacity) : capacity_(capacity) {}

  [[nodiscard]] bool try_push(const Mark& mark) {
    const std::lock_guard lock(mutex_);
    if (marks_.size() == capacity_) return false;
    marks_.push_back(mark);
    return true;
  }
  /// Appends all marks.
  void take(std::vector<Mark>& marks, std::size_t /*most*/ = SIZE_MAX) {
    const std::lock_guard lock(mutex_);
    for (Mark& mark : marks_) marks.push_back(std::move(mark));
    marks_.clear();
  }

 private:
  std::size_t capacity_;
  std::mutex mutex_;
  std::vector<Mark> marks_;
};

/// The feeds of one kind to one consumer: one from each thread that produces this kind.
template <class Record>
using Feeds = std::vector<std::unique_ptr<Feed<Record>>>;

}  // namespace merkel
