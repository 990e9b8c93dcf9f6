#pragma once

#include "core/records/run_status.hpp"

namespace merkel {

/// What the calling thread has been given, as the kernel says: its scheduling class and priority,
/// the core that it is pinned to, its timer slack, and how much of the process's memory is locked.
/// `cpu_awake` is left to the caller. Real-time: no.
[[nodiscard]] RunStatus::Rights rights_of_this_thread();

}  // namespace merkel
