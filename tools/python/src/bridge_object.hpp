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

/// The Python class Bridge: the real-time pipeline, running in separate threads. Spikes and
/// stimulation commands are queued for Python in bounded lists; a program that does not fetch them
/// loses its own copy only, counted.
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

  /// What Python has not fetched yet.
  struct Unread {
    std::vector<SpikeRow> spikes;
    std::vector<CommandRow> commands;

    [[nodiscard]] bool empty() const noexcept { return spikes.empty() && commands.empty(); }
  };
  /// Waits for spikes or commands, for so long at most; none after the end.
  /// \throws Error where the run failed
  [[nodiscard]] Unread read(std::chrono::nanoseconds patience);
  /// Whether the run is over and everything was fetched.
  [[nodiscard]] bool ended();
  /// Ends the run and waits for its sinks.
  void stop() noexcept;

  /// Gives a mark to every sink that records marks, at the newest simulated time. Waits 10 s at
  /// most for the first tick. \throws Error
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
  Unread unread_;
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
