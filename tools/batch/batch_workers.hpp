#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// Work shared between processes of this program: each item runs in one of them. A process that
/// dies takes only its item along, and gets a successor. Each has a core of its own if there are
/// enough.
struct SharedWork {
  std::size_t items = 0;
  std::size_t processes = 1;
  /// Runs an item in a worker. \return false if it was interrupted: the worker ends
  std::function<bool(std::size_t)> run;
  /// Called in this process for an item whose worker died, with the reason.
  std::function<void(std::size_t, const std::string&)> on_death;
  /// Called in this process, often, with the number of finished items.
  std::function<void(std::size_t)> on_progress;
};

/// Runs all items, or those that are finished when `stop` is set: the workers then get SIGTERM, as
/// they do when this process dies. In a worker, SIGINT, SIGTERM and SIGHUP are blocked except where
/// `run` unblocks them. Call before any thread was started. \return the number of finished items
[[nodiscard]] Expected<std::size_t, SetupError> run_shared(const SharedWork& work,
                                                           const std::atomic<bool>& stop);

}  // namespace merkel
