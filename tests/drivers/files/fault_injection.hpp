#pragma once

namespace merkel {

/// During its lifetime, one call that changes regular files (write, pwrite, ftruncate, fsync,
/// rename) fails, and so do all later calls that write data, as on a full disk. One object at a
/// time.
class FaultInjection {
 public:
  /// \param call   index of the failing call, from 0
  /// \param error  its errno
  FaultInjection(int call, int error);
  FaultInjection(const FaultInjection&) = delete;
  FaultInjection& operator=(const FaultInjection&) = delete;
  ~FaultInjection();

  /// True if the failing call was made.
  [[nodiscard]] static bool happened();
};

}  // namespace merkel
