#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <pybind11/pybind11.h>

#include "drivers/run_control.hpp"
#include "realtime/pipeline.hpp"
#include "tools/python/src/records.hpp"
#include "tools/scene/prepared_run.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel::python {

/// The Python class Bridge: the real-time pipeline, running in separate threads. Spikes are queued
/// for Python in a bounded list; a program that does not fetch them loses its own copy only,
/// counted.
class BridgeObject {
 public:
  struct Options {
    std::vector<std::string> sinks;
    std::optional<double> duration_s;
    bool overwrite = false;
    bool allow_remote = false;
  };
  /// Opens probes and sinks and starts. \throws Error
  BridgeObject(Scene scene, const Options& options);
  BridgeObject(const BridgeObject&) = delete;
  BridgeObject& operator=(const BridgeObject&) = delete;
  ~BridgeObject();

  /// Waits for spikes, for so long at most; none after the end. \throws Error where the run failed
  [[nodiscard]] std::vector<SpikeRow> read(std::chrono::nanoseconds patience);
  /// Whether the run is over and all its spikes were fetched.
  [[nodiscard]] bool ended();
  /// Ends the run and waits for its sinks.
  void stop() noexcept;

  /// Gives a mark to every sink that records marks, at the newest simulated time. Waits for the run
  /// to start.
  void mark(const std::string& label);
  [[nodiscard]] bool tare(std::size_t probe);
  [[nodiscard]] std::map<std::string, std::uint64_t> counters();
  [[nodiscard]] std::vector<std::string> notices();

 private:
  class Outlet;
  void run();

  std::unique_ptr<PreparedRun> run_;
  std::unique_ptr<Pipeline> pipeline_;
  RunControl* control_ = nullptr;
  std::mutex mutex_;  ///< guards the rest
  std::condition_variable changed_;
  std::vector<SpikeRow> waiting_;
  std::vector<std::string> notices_;
  std::optional<std::chrono::nanoseconds> newest_;  ///< end of the newest tick
  std::string error_;
  bool over_ = false;
  bool stopped_ = false;
  std::thread thread_;
};

/// Adds Bridge and connect() to the module.
void add_bridge(pybind11::module_& module);

}  // namespace merkel::python
