#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/encoding/encoding_parameters.hpp"
#include "core/scene/tactile_model.hpp"
#include "drivers/probe.hpp"
#include "drivers/sink.hpp"

namespace merkel {

class RecordingSwitch;
class RunJournal;
class SessionJournal;
struct SessionPosition;

/// The description of a run, for sinks that record it.
struct RunDescription {
  std::string scene;  ///< its name, for display
  /// Everything that determines the run or documents it (version, scene text, seeds, machine), by
  /// name. Names consist of letters, digits and underscores.
  std::vector<std::pair<std::string, std::string>> facts;
  TactileModel::Parameters model;
  std::vector<ProbeInfo> probes = {};  ///< one per indenter
  EncodingParameters encoding = {};    ///< no electrodes: no stimulation commands
};

/// The zero of times in a file.
enum class TimeZero {
  kRun,     ///< the start of the run; for a recording, the zero of its time base
  kUnix,    ///< 1970-01-01 UTC
  kDevice,  ///< the probe's own time: for a device, the host's monotonic clock
};

/// The settings for opening sinks.
struct SinkSetup {
  std::uint32_t neurons = 0;  ///< of the model; spikes number them from 1
  bool overwrite = false;     ///< existing files may be replaced
  bool allow_remote = false;  ///< connections to and from other machines are allowed
  RunDescription run = {};
  /// Receives messages of a sink while it opens. May be empty.
  std::function<void(const std::string&)> notice = {};
  /// Receives how far a long export has come. Thread: any. May be empty.
  std::function<void(const std::string&)> progress = {};
  TimeZero time_zero = TimeZero::kRun;  ///< for file sinks without the option `time`
  std::shared_ptr<RecordingSwitch> recording = nullptr;  ///< null: no recording on request
  /// What files are made from whose format needs the whole run; null: each writes a session for it.
  std::shared_ptr<RunJournal> journal = nullptr;
  /// Learns when a session is complete; null: no sink waits for it.
  std::shared_ptr<SessionJournal> session_journal = nullptr;
  std::shared_ptr<SessionPosition> session = nullptr;  ///< of a played session; else null
};

}  // namespace merkel
