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

#include "drivers/files/input_file.hpp"
#include "drivers/run_control.hpp"
#include "realtime/pipeline.hpp"
#include "tools/python/src/initialised.hpp"
#include "tools/python/src/interpreter_exit.hpp"
#include "tools/python/src/records.hpp"
#include "tools/scene/prepared_run.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel::python {

/// The Python class Bridge: the real-time pipeline, running in separate threads. Spikes and
/// stimulation commands are queued for Python in bounded lists; a program that does not fetch them
/// loses its own copy only, counted and noticed. Nothing waits for Python.
class BridgeObject {
 public:
  struct Options {
    std::vector<std::string> sinks;
    std::optional<double> duration_s;
    bool overwrite = false;
    bool allow_remote = false;
    std::size_t most_unread = 1'000'000;  ///< spikes, and as many commands
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
  /// False in a process that was forked from that of the run: it has none of the run's threads, so
  /// nothing here can be used, ended or destroyed.
  [[nodiscard]] bool is_own_process() const noexcept;
  /// Ends the run and waits for its sinks. Any number of threads may call it at once.
  void stop() noexcept;

  /// \throws Error if the scene has no such electrode, or the run does not take drives
  void set_drive(const std::string& electrode, double amplitude, std::optional<double> frequency);
  void stop_stimulation();
  void start_stimulation();

  /// Waits for the first tick, for so long at most. False if there is none yet.
  [[nodiscard]] bool started(std::chrono::nanoseconds patience);
  /// Gives a mark to every sink that records marks, at the newest simulated time.
  /// \throws Error before the first tick and after the end
  void mark(const std::string& label);
  /// \param probe  none: all
  [[nodiscard]] bool tare(std::optional<std::size_t> probe);
  [[nodiscard]] std::map<std::string, std::uint64_t> counters();
  [[nodiscard]] std::vector<std::string> notices();

 private:
  class Outlet;
  void run();
  /// \throws Error in a process that was forked from the one of the run: it has no threads
  void check_process() const;

  ReadFiles files_;
  std::unique_ptr<PreparedRun> run_;
  std::unique_ptr<Pipeline> pipeline_;
  RunControl* control_ = nullptr;
  std::mutex mutex_;  ///< guards the rest
  std::condition_variable changed_;
  std::size_t most_unread_;
  Unread unread_;
  std::uint64_t spikes_lost_ = 0;  ///< not fetched in time
  std::uint64_t commands_lost_ = 0;
  std::vector<std::string> notices_;
  std::optional<std::chrono::nanoseconds> newest_;  ///< end of the newest tick
  std::string error_;
  bool over_ = false;
  std::mutex ending_;  ///< guards thread_
  std::thread thread_;
  const int process_;  ///< that started the threads
  std::optional<LiveRun> live_;
};

/// Leaves the copy in a forked process as it is.
struct DeleteInOwnProcess {
  void operator()(BridgeObject* bridge) const noexcept {
    if (bridge->is_own_process()) delete bridge;
  }
};
using BridgeHolder = std::unique_ptr<BridgeObject, DeleteInOwnProcess>;

/// Adds Bridge and connect() to the module.
void add_bridge(pybind11::module_& module);

}  // namespace merkel::python

template <>
struct pybind11::detail::type_caster<merkel::python::BridgeObject>
    : merkel::python::Initialised<merkel::python::BridgeObject> {};
