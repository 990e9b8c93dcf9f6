#pragma once

#include <cstdint>

namespace merkel {

/// An HDF5 handle (hid_t), closed by the function of its kind.
class Hdf5Handle {
 public:
  Hdf5Handle(std::int64_t id, int (*closer)(std::int64_t)) : id_(id), close_(closer) {}
  Hdf5Handle(Hdf5Handle&&) = delete;
  ~Hdf5Handle() {
    if (id_ >= 0) static_cast<void>(close_(id_));
  }
  [[nodiscard]] std::int64_t id() const { return id_; }
  [[nodiscard]] bool valid() const { return id_ >= 0; }

 private:
  std::int64_t id_;
  int (*close_)(std::int64_t);
};

}  // namespace merkel
