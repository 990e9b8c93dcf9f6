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

// Each function adds one subcommand to the program.
void add_run_command(CommandLine& program);
void add_record_command(CommandLine& program);
void add_replay_command(CommandLine& program);
void add_export_command(CommandLine& program);
void add_compare_command(CommandLine& program);
void add_compare_encoders_command(CommandLine& program);
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
void add_batch_command(CommandLine& program);
void add_bench_command(CommandLine& program);
void add_merge_command(CommandLine& program);
void add_align_command(CommandLine& program);
void add_bundle_command(CommandLine& program);
void add_chart_command(CommandLine& program);
void add_plan_command(CommandLine& program);
void add_plot_command(CommandLine& program);
void add_self_test_command(CommandLine& program);
void add_completion_command(CommandLine& program);

/// "20 patches and 3 probes".
[[nodiscard]] std::string contents_of(const Scene& scene);

/// The value of an option --jobs; by default, the number of cores that the program may use.
[[nodiscard]] std::size_t jobs_or_cores(const std::optional<double>& jobs);

/// The words, separated by ", ".
[[nodiscard]] std::string joined(const std::vector<std::string>& words);

}  // namespace merkel
