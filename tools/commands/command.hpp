#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "tools/command_line.hpp"
#include "tools/exit_code.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// Adds a subcommand to the program, or to one of its commands.
using AddCommand = void(CommandLine& program);
AddCommand add_run_command, add_record_command, add_replay_command, add_export_command,
    add_compare_command, add_compare_encoders_command, add_doctor_command, add_probes_command,
    add_connect_command, add_calibrate_command, add_simulate_probe_command, add_inspect_command,
    add_inspect_session_command, add_scene_command, add_figures_command, add_score_command,
    add_fit_command, add_fit_skin_command, add_batch_command, add_bench_command, add_merge_command,
    add_align_command, add_bundle_command, add_chart_command, add_plan_command, add_plot_command,
    add_self_test_command, add_completion_command;

/// The help of options that several commands have.
inline constexpr const char* kSessionHelp =
    "Session, as recorded by --sink xdf:FILE; FILE@RIG for a rig in a file of LabRecorder";
inline constexpr const char* kRemoteSinksHelp =
    "Allow sinks to send to other machines and to be reached from them";
inline constexpr const char* kRemoteProbesHelp =
    "Allow other machines to send the samples (udp:0.0.0.0:PORT)";
inline constexpr const char* kThreadsHelp =
    "Number of threads; default: one per core. The result does not depend on it";

/// "20 patches and 3 probes".
[[nodiscard]] std::string contents_of(const Scene& scene);

/// The value of an option --jobs; by default, the number of cores that the program may use.
[[nodiscard]] std::size_t jobs_or_cores(const std::optional<double>& jobs);

}  // namespace merkel
