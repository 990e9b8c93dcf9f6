#include "tools/run/long_work.hpp"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <utility>

#include <fmt/core.h>

#include "core/units.hpp"
#include "tools/exit_code.hpp"

namespace merkel {
namespace {

/// A shorter rest is what readers run ahead.
constexpr std::chrono::seconds kLongRest{60};

}  // namespace

LongWork::LongWork(std::string sentence, std::chrono::milliseconds patience)
    : thread_([sentence = std::move(sentence), patience](const std::stop_token& stop) {
        std::mutex mutex;
        std::unique_lock lock(mutex);
        std::condition_variable_any changed;
        const auto over = [] { return false; };
        changed.wait_for(lock, stop, patience, over);
        if (!stop.stop_requested()) warn(sentence);
      }) {}

void LongRun::report(const RunProgress& progress) {
  if (progress.wall < next_) return;
  next_ *= 2;
  const double wall_s = units::s_from(progress.wall);
  const double simulated_s = units::s_from(progress.simulated);
  std::string text = fmt::format("simulated {:.0f} s", simulated_s);
  if (progress.known - progress.simulated > kLongRest) {
    const double rest_s = units::s_from(progress.known - progress.simulated);
    text += fmt::format(" of at least {:.0f} s", units::s_from(progress.known));
    text += fmt::format(" in {:.0f} s: about {:.0f} s more", wall_s,
                        rest_s * wall_s / std::max(simulated_s, 1e-3));
  } else {
    text += fmt::format(" in {:.0f} s", wall_s);
  }
  warn(text + "; an interrupt (Ctrl-C) ends the run and keeps its output");
}

}  // namespace merkel
