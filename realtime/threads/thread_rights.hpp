#pragma once

#include "core/records/run_status.hpp"

namespace merkel {

/// The rights of the calling thread according to the kernel: its scheduling class and priority, the
/// core that it is pinned to, its timer slack, and the locked memory of the process. Does not set
/// `cpu_awake`. Real-time: no.
[[nodiscard]] RunStatus::Rights rights_of_this_thread();

}  // namespace merkel
