#include <array>
#include <atomic>
#include <chrono>
#include <thread>

#include "drivers/probes/open_probe.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "drivers/simulation/device_simulator.hpp"
#include "tools/run/session_replay.hpp"
#include "tools/scene/prepared_run.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/scene/session_scene.hpp"
#include "tools/self_test/self_test.hpp"

namespace merkel {
namespace {

constexpr const char* kLoopbackPress = "sim:taps?count=4";
constexpr std::chrono::seconds kLoopbackDuration{2};

Expected<std::vector<ProbeSample>, SetupError> loopback_trace() {
  auto probe = open_probe(kLoopbackPress);
  if (!probe) return Unexpected<SetupError>(probe.error());
  std::vector<ProbeSample> trace;
  std::array<ProbeSample, 256> chunk;
  for (;;) {
    const auto count = (*probe)->read(chunk, std::chrono::milliseconds{0});
    if (!count) return trace;
    trace.insert(trace.end(), chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(*count));
  }
}

Expected<std::unique_ptr<DeviceSimulator>, SetupError> loopback_device() {
  const auto protocol = find_protocol("hbf1");
  if (!protocol) return Unexpected<SetupError>(protocol.error());
  auto trace = loopback_trace();
  if (!trace) return Unexpected<SetupError>(trace.error());
  return DeviceSimulator::create(
      {.protocol = *protocol, .trace = std::move(*trace), .baud = (*protocol)->baud});
}

/// Records a run of the device to a session.
Expected<RunReport, SetupError> record_device(const std::string& uri, const std::string& session) {
  auto scene = preset_scene("paper");
  scene->probes.front().uri = uri;
  auto run = prepare_run(std::move(*scene), {});
  if (!run) return Unexpected<SetupError>(run.error());
  run->parameters.duration = kLoopbackDuration;
  return run->run({"xdf:" + session}, {.overwrite = true});
}

Expected<SessionReplay::Outcome, SetupError> replay_of(const std::string& path) {
  auto session = SessionReader::open(path);
  if (!session) return Unexpected<SetupError>(session.error());
  const auto scene = scene_of_session(*session);
  if (!scene) return Unexpected<SetupError>(scene.error());
  auto model = TactileModel::create(scene->model);
  if (!model) return bad_input(scene->sentence(model.error()));
  SessionReplay replay(*model);
  const auto read = session->for_each([&](const SessionChunk& chunk) { replay.take(chunk); });
  if (!read) return Unexpected<SetupError>(read.error());
  return replay.finish();
}

}  // namespace

SelfCheck check_loopback_device(const std::string& folder) {
  SelfCheck check{.what = "a device on a pseudo-terminal"};
  const std::string session = folder + "/session.xdf";
  auto device = loopback_device();
  if (!device) {
    check.host_refused = device.error().kind == SetupError::Kind::kUnavailable;
    check.finding = device.error().sentence;
    return check;
  }
  std::atomic<bool> ended{false};
  std::jthread playing([&] { (*device)->run(ended); });
  const auto report = record_device((*device)->uri(), session);
  ended = true;
  playing.join();
  if (!report) {
    check.finding = report.error().sentence;
    return check;
  }
  const auto verdict = replay_of(session);
  if (!verdict) {
    check.finding = verdict.error().sentence;
    return check;
  }
  const std::string error = report->failure();
  check.passed = error.empty() && verdict->spikes > 0 && verdict->identical();
  check.finding = std::to_string(report->probes.front().samples_in) + " samples, " +
                  std::to_string(verdict->spikes) + " spikes, the replay of the session is " +
                  (verdict->identical() ? "bit-identical" : "different: " + verdict->difference);
  if (!error.empty()) check.finding = error;
  return check;
}

}  // namespace merkel
