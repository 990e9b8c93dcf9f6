#include "drivers/protocols/sequence_counter.hpp"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/random.hpp"

namespace merkel {
namespace {

/// The result of some numbers.
struct Followed {
  std::uint64_t passed = 0;
  std::uint64_t lost = 0;
  std::uint64_t restarts = 0;
  DeviceStream stream;
};

Followed follow(unsigned bits, const std::vector<std::uint32_t>& numbers) {
  Followed result;
  SequenceCounter counter(bits);
  for (const std::uint32_t number : numbers) {
    const auto step = counter.next(number, result.stream);
    result.passed += step.dropped() ? 0 : 1;
    result.lost += step.lost;
    result.restarts += step.restarted ? 1 : 0;
  }
  return result;
}

/// 0, 1, 2, … without some of them.
std::vector<std::uint32_t> numbers_from(std::uint32_t first, std::uint32_t count) {
  std::vector<std::uint32_t> numbers(count);
  for (std::uint32_t i = 0; i < count; ++i) numbers[i] = first + i;
  return numbers;
}

TEST(SequenceCounter, CountsEveryLostNumberAcrossTheWrap) {
  for (const unsigned bits : {4U, 8U, 16U, 32U}) {
    Random random(bits);
    std::vector<std::uint32_t> numbers;
    std::uint64_t lost = 0;
    for (std::uint32_t i = 0; i < 100'000; ++i) {
      if (i > 0 && i < 99'990 && random.uniform() < 0.02) {
        ++lost;
      } else {
        numbers.push_back(i - 500);  // wraps
      }
    }
    const Followed result = follow(bits, numbers);
    EXPECT_EQ(result.lost, lost) << bits;
    EXPECT_EQ(result.passed, numbers.size()) << bits;
    EXPECT_EQ(result.restarts, 0U) << bits;
    EXPECT_TRUE(result.stream.notices.empty());
  }
}

TEST(SequenceCounter, LateAndRepeatedRecordsAreDroppedAndAreNoReboots) {
  for (const std::uint32_t age : {1U, 5U, 40U, 1000U, 20'000U}) {
    Random random(age);
    std::vector<std::uint32_t> numbers;
    std::uint64_t old = 0;
    for (std::uint32_t i = 0; i < 20'000; ++i) {
      numbers.push_back(100'000 + i);
      if (random.uniform() < 0.1) {
        ++old;
        numbers.push_back(100'000 + i - age);
      }
    }
    const Followed result = follow(32, numbers);
    EXPECT_EQ(result.stream.counts.reordered, old) << age;
    EXPECT_EQ(result.passed, 20'000U) << age;
    EXPECT_EQ(result.lost, 0U) << age;
    EXPECT_EQ(result.restarts, 0U) << age;
  }
}

TEST(SequenceCounter, ARestartIsOneAndCostsFewRecords) {
  for (const unsigned bits : {8U, 16U, 32U}) {
    for (const std::uint32_t before : {20U, 60U, 100U}) {
      std::vector<std::uint32_t> numbers = numbers_from(0, before);
      const auto after = numbers_from(0, 120);
      numbers.insert(numbers.end(), after.begin(), after.end());
      const Followed result = follow(bits, numbers);
      EXPECT_EQ(result.restarts, 1U) << bits << " " << before;
      EXPECT_LE(numbers.size() - result.passed, 15U) << bits << " " << before;
      EXPECT_EQ(result.lost, 0U) << bits << " " << before;
    }
  }
}

TEST(SequenceCounter, OneWrongNumberIsNoEvidence) {
  for (const unsigned bits : {16U, 32U}) {
    for (const std::uint32_t wrong : {0U, 7U, 1000U, 12'000U, 30'000U, 60'000U, 0xFFFFFFFFU}) {
      std::vector<std::uint32_t> numbers = numbers_from(10'000, 1000);
      numbers[500] = wrong;
      const Followed result = follow(bits, numbers);
      EXPECT_EQ(result.restarts, 0U) << bits << " " << wrong;
      EXPECT_LE(result.lost, 1U) << bits << " " << wrong;
      EXPECT_GE(result.passed, 999U) << bits << " " << wrong;
    }
  }
}

TEST(SequenceCounter, RandomNumbersAreNoEvidenceAndASentenceSaysSo) {
  for (const unsigned bits : {8U, 16U, 32U}) {
    Random random(bits);
    std::vector<std::uint32_t> numbers(5000);
    for (auto& number : numbers) number = static_cast<std::uint32_t>(random.next());
    const Followed result = follow(bits, numbers);
    EXPECT_GE(result.passed, 4980U) << bits;
    EXPECT_LE(result.lost, 100U) << bits;
    EXPECT_LE(result.restarts, 1U) << bits;
    ASSERT_FALSE(result.stream.notices.empty());
    EXPECT_NE(result.stream.notices[0].find("its sequence numbers make no sense"),
              std::string::npos);
  }
}

TEST(SequenceCounter, AStoppedNumberSilencesNothing) {
  const Followed result = follow(32, std::vector<std::uint32_t>(1000, 7));
  EXPECT_GE(result.passed, 980U);
  EXPECT_EQ(result.stream.notices.size(), 1U);
}

TEST(SequenceCounter, AGapAfterAReopeningIsLoss) {
  SequenceCounter counter(16);
  DeviceStream stream;
  static_cast<void>(counter.next(10, stream));
  counter.reopened();
  EXPECT_EQ(counter.next(5011, stream).lost, 5000U);
  EXPECT_EQ(counter.next(5012, stream).lost, 0U);
}

}  // namespace
}  // namespace merkel
