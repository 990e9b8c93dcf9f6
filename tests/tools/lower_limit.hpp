#pragma once

#include <sys/resource.h>

namespace merkel {

/// Lowers a limit of this program, and of those that it starts, during its lifetime.
class LowerLimit {
 public:
  LowerLimit(__rlimit_resource_t resource, rlim_t most) : resource_(resource) {
    ::getrlimit(resource, &before_);
    rlimit lower = before_;
    lower.rlim_cur = most;
    ::setrlimit(resource, &lower);
  }
  LowerLimit(const LowerLimit&) = delete;
  LowerLimit& operator=(const LowerLimit&) = delete;
  ~LowerLimit() { ::setrlimit(resource_, &before_); }

 private:
  __rlimit_resource_t resource_;
  rlimit before_{};
};

}  // namespace merkel
