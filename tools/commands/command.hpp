#pragma once

#include <string>
#include <vector>

#include "core/expected.hpp"
#include "tools/command_line.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// Exit codes of the program.
inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;      ///< while running
inline constexpr int kWrongInput = 2;  ///< or wrong usage
inline constexpr int kRefused = 3;     ///< by a device or the host

// Each function adds one subcommand to the program.
void add_run_command(CommandLine& program);
void add_record_command(CommandLine& program);
void add_replay_command(CommandLine& program);
void add_export_command(CommandLine& program);
void add_compare_command(CommandLine& program);
void add_doctor_command(CommandLine& program);
void add_probes_command(CommandLine& program);
void add_connect_command(CommandLine& program);
void add_calibrate_command(CommandLine& program);
void add_simulate_probe_command(CommandLine& program);
void add_inspect_command(CommandLine& program);
void add_inspect_session_command(CommandLine& inspect);
void add_scene_command(CommandLine& program);
void add_figures_command(CommandLine& program);
void add_score_command(CommandLine& program);
void add_fit_command(CommandLine& program);
void add_fit_skin_command(CommandLine& fit);
void add_bench_command(CommandLine& program);
void add_chart_command(CommandLine& program);
void add_plan_command(CommandLine& program);

/// scene_named() for a command: prints the scene's notice to stderr.
[[nodiscard]] Expected<Scene, SetupError> given_scene(const std::string& name_or_file);

/// The words, separated by ", ".
[[nodiscard]] std::string joined(const std::vector<std::string>& words);

/// Prints "merkel: sentence" to stderr. Returns the exit code of wrong input: 2.
int refuse(const std::string& sentence);
/// The same for a set-up error. \return 2 or 3, depending on the kind of error
int refuse(const SetupError& error);
/// The same for a failure at run time. \return 1
int fail(const std::string& sentence);

}  // namespace merkel
