#pragma once

#include <chrono>
#include <cstdio>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/simulation/pty_master.hpp"

namespace merkel {

/// A gauge of no known kind that prints a line every 5 ms at one baud rate.
class LinePrinter {
 public:
  struct Boot {
    std::chrono::milliseconds silence{0};  ///< from the first opening of its port
    std::string header;                    ///< its first line; empty: none
    bool lone_byte = false;                ///< a line end is read alone before all else
  };
  explicit LinePrinter(std::string line, int baud = 115200)
      : LinePrinter(std::move(line), baud, {}, {}) {}
  LinePrinter(std::string line, int baud, Boot boot, std::string link = {})
      : pty_(std::move(link)), line_(std::move(line)), baud_(baud) {
    EXPECT_TRUE(pty_.plug_in());
    thread_ = std::jthread([this, boot = std::move(boot)](const std::stop_token& stop) {
      while (!stop.stop_requested() && !pty_.heard()) std::this_thread::sleep_for(kInterval);
      for (auto waited = kInterval; waited < boot.silence && !stop.stop_requested();
           waited += kInterval) {
        std::this_thread::sleep_for(kInterval);
      }
      if (boot.lone_byte) {
        const std::uint8_t byte = pty_.baud() == baud_ ? '\n' : '\n' ^ 0x95;
        pty_.write({&byte, 1});
        std::this_thread::sleep_for(10 * kInterval);
      }
      bool header = !boot.header.empty();
      while (!stop.stop_requested()) {
        std::string text = (std::exchange(header, false) ? boot.header : next_line()) + "\r\n";
        if (pty_.baud() != baud_) {
          for (char& c : text) c = static_cast<char>(c ^ 0x95);
        }
        const std::vector<std::uint8_t> bytes(text.begin(), text.end());
        pty_.write(bytes);
        std::uint8_t waste[256];
        static_cast<void>(pty_.read(waste, kInterval));
      }
    });
  }
  ~LinePrinter() {
    thread_.request_stop();
    thread_.join();
  }
  [[nodiscard]] const std::string& name() const { return pty_.name(); }

  /// From now on it prints this.
  void print(std::string line) {
    const std::scoped_lock lock(mutex_);
    line_ = std::move(line);
    step_ = 0.0;
  }
  /// From now on it prints a number that changes with every line.
  void drift(double from, double step) {
    const std::scoped_lock lock(mutex_);
    number_ = from;
    step_ = step;
  }

 private:
  static constexpr std::chrono::milliseconds kInterval{5};

  std::string next_line() {
    const std::scoped_lock lock(mutex_);
    if (step_ != 0.0) line_ = std::to_string(number_ += step_);
    return line_;
  }

  PtyMaster pty_;
  std::mutex mutex_;  ///< guards the next three
  std::string line_;
  double number_ = 0.0;
  double step_ = 0.0;
  int baud_;
  std::jthread thread_;
};

}  // namespace merkel
