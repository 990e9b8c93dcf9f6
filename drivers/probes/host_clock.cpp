#include "drivers/probes/host_clock.hpp"

#include <thread>

namespace merkel {
namespace {

class RealClock final : public HostClock {
 public:
  [[nodiscard]] std::chrono::nanoseconds now() override {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(
        std::chrono::steady_clock::now().time_since_epoch());
  }
  void sleep_for(std::chrono::nanoseconds time) override { std::this_thread::sleep_for(time); }
};

}  // namespace

HostClock& HostClock::real() {
  static RealClock clock;
  return clock;
}

}  // namespace merkel
