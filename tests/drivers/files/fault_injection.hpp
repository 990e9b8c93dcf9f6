#pragma once

namespace merkel {

/// While it lives, one of the calls that change regular files (write, pwrite, ftruncate, fsync,
/// rename) fails, and all later ones that write data with it, as on a full disk. One at a time.
class FaultInjection {
 public:
  /// \param call   which call fails, from 0
  /// \param error  its errno
  FaultInjection(int call, int error);
  FaultInjection(const FaultInjection&) = delete;
  FaultInjection& operator=(const FaultInjection&) = delete;
  ~FaultInjection();

  /// Whether that call came.
  [[nodiscard]] static bool happened();
};

}  // namespace merkel
