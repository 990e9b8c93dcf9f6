#pragma once

#include "core/worker_team.hpp"

namespace merkel {

/// A team that runs its parts one after the other, for work whose parts do not wait for each other.
class SerialTeam final : public WorkerTeam {
 public:
  explicit SerialTeam(int size) : size_(size) {}
  [[nodiscard]] int size() const noexcept override { return size_; }
  void run(int parts, Part part, void* context) noexcept override {
    most_parts = parts > most_parts ? parts : most_parts;
    for (int k = 0; k < parts; ++k) part(context, k);
  }
  void barrier() noexcept override {}

  int most_parts = 0;

 private:
  int size_;
};

}  // namespace merkel
