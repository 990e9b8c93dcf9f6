#!/usr/bin/env bash
# Fuzzes everything that reads outside bytes with libFuzzer, address and undefined sanitizers: every parser
# of the protocol table, scans of cards, entries of Redis, sessions, traces, files of spikes, pulses and commands, calibrations, scenes,
# recordings, URIs and addresses.
# usage: fuzz.sh SOURCE_FOLDER [BYTES [CORPUS_FOLDER [NAME…]]]
# At least BYTES random bytes go through each target (default: ten million), or through the named ones, unless
# MERKEL_FUZZ_SECONDS end it earlier (scene_run: 60 s by default). CORPUS_FOLDER/NAME keeps interesting inputs for
# the next run; the seeds in the sources are small. `tests/fuzz/session_seeds.py build/release/merkel
# CORPUS_FOLDER/session` makes those of sessions. CMAKE_CXX_COMPILER_LAUNCHER may be ccache.
set -euo pipefail
source=$1
bytes=${2:-10000000}
corpora=${3:-$(mktemp -d)}
wanted=("${@:4}")
if ! command -v clang++ >/dev/null; then
  echo "skipped: clang++ is not installed (tools/install_packages ci)"
  exit 77
fi
work=$(mktemp -d)
limits=()  # of time and memory, for libFuzzer
seconds=${MERKEL_FUZZ_SECONDS:-}
trap 'rm -rf "$work"' EXIT

flags=(-std=c++20 -O1 -g1 -I "$source" -isystem /usr/include/eigen3 -fsanitize=address,undefined,fuzzer-no-link
  -isystem /usr/include/hdf5/serial -fno-sanitize-recover=all)
# Compiles a source once; prints the object's path. The kernels of core read no outside bytes; they are compiled
# without sanitizers, with which clang takes minutes for each.
object_of() {
  local object flag chosen=()
  object="$work/${1//\//_}.o"
  for flag in "${flags[@]}"; do
    [[ $1 == core/*kernel* && $flag == -f*sanitize* ]] || chosen+=("$flag")
  done
  # shellcheck disable=SC2086
  [ -e "$object" ] || ${CMAKE_CXX_COMPILER_LAUNCHER:-} clang++ "${chosen[@]}" -c "$source/$1" -o "$object"
  echo "$object"
}

# fuzz NAME LONGEST_INPUT "COMPILER_ARGUMENTS" FUZZED_SOURCE SOURCE…
fuzz() {
  local name=$1 longest=$2 arguments=$3 fuzzed=$4 objects=()
  shift 4
  if [ ${#wanted[@]} -gt 0 ] && ! printf '%s\n' "${wanted[@]}" | grep -qx "$name"; then return; fi
  for file in "$@"; do objects+=("$(object_of "$file")"); done
  # shellcheck disable=SC2086
  clang++ "${flags[@]}" -fsanitize=fuzzer "$source/tests/fuzz/$fuzzed" "${objects[@]}" $arguments \
    -o "$work/$name"
  local folders=("$corpora/$name")
  [ -d "$source/tests/fuzz/seeds/$name" ] && folders+=("$source/tests/fuzz/seeds/$name")
  mkdir -p "$corpora/$name"
  "$work/$name" -seed=1 -max_len="$longest" -len_control=0 -runs=$((bytes / (longest / 8))) \
    -print_final_stats=0 -verbosity=0 "${limits[@]}" ${seconds:+"-max_total_time=$seconds"} "${folders[@]}"
  echo "$name: no fault"
}

sessions=(drivers/sessions/{rig_recording,session_format,session_items,session_reader,xdf_file}.cpp drivers/clock/clock_line.cpp)
words=(core/parameters/{field,nearest_name,parameter_error,range}.cpp drivers/files/csv_text.cpp)
protocols=("${words[@]}" drivers/{printable_text,uri}.cpp drivers/files/{trace_file,line_reader,input_file,output_file,file_rename}.cpp)
for file in "$source"/drivers/protocols/*.cpp; do protocols+=("drivers/protocols/${file##*/}"); done
for protocol in $(sed -n 's/^ *{"\([a-z0-9]*\)", .*/\1/p' "$source/drivers/protocols/protocol_table.cpp"); do
  fuzz "$protocol" 4096 "-DMERKEL_FUZZED_PROTOCOL=\"$protocol\"" protocol_fuzz.cpp "${protocols[@]}"
done
fuzz ati_rdt 4096 "-DMERKEL_FUZZED_PROTOCOL=\"ati_rdt\"" protocol_fuzz.cpp "${protocols[@]}"
fuzz csv_frames 4096 "-DMERKEL_FUZZED_PROTOCOL=\"csv\" -DMERKEL_FUZZED_OPTIONS=\"columns=taxel_kPa*9&frame_lines=3\"" \
  protocol_fuzz.cpp "${protocols[@]}"
fuzz connect_lines 4096 -lfmt connect_lines_fuzz.cpp "${protocols[@]}" tools/connect/{array_scene,csv_readings,hand_scene,text_rows}.cpp \
  drivers/probes/channel_selection.cpp drivers/calibration/probe_calibration.cpp
fuzz hbf1_frames 2048 "" hbf1_frames_fuzz.cpp "${protocols[@]}"
fuzz analog_scans 4096 "" analog_scans_fuzz.cpp "${protocols[@]}"
fuzz redis_entries 4096 "" redis_entries_fuzz.cpp "${protocols[@]}" drivers/transports/redis_lines.cpp
fuzz hid_descriptor 4096 "" descriptor_fuzz.cpp "${protocols[@]}"
fuzz spike_file 4096 -lpugixml spike_file_fuzz.cpp "${words[@]}" drivers/files/line_reader.cpp \
  drivers/spike_files/spike_file.cpp "${sessions[@]}" drivers/sessions/session_samples.cpp
fuzz pulse_file 2048 -lpugixml pulse_file_fuzz.cpp "${words[@]}" drivers/files/{line_reader,npy_file,output_file,input_file,file_rename}.cpp \
  drivers/spike_files/pulse_file.cpp "${sessions[@]}" drivers/sessions/session_samples.cpp
fuzz stimulation_file 2048 -lpugixml stimulation_file_fuzz.cpp "${words[@]}" drivers/files/line_reader.cpp \
  drivers/spike_files/stimulation_file.cpp "${sessions[@]}"
fuzz nwb_spikes 2048 -lhdf5_serial nwb_spikes_fuzz.cpp \
  drivers/spike_files/nwb_spikes.cpp drivers/files/{hdf5_file,file_rename}.cpp
fuzz trace 2048 "" trace_fuzz.cpp "${protocols[@]}"
fuzz toml 512 "" toml_fuzz.cpp drivers/files/toml{,_guard}.cpp
fuzz calibration 1024 "" calibration_fuzz.cpp "${protocols[@]}" \
  drivers/calibration/{calibration_file,probe_calibration}.cpp drivers/files/toml{,_guard}.cpp
core=()
for file in "$source"/core/*/*.cpp "$source"/core/*/*/*.cpp "$source"/core/*/*/*/*.cpp; do
  [ -e "$file" ] && core+=("${file#"$source"/}")
done
core+=(drivers/files/csv_text.cpp drivers/uri.cpp)
scenes=(tools/scene/scene_{file,keys,stimulation,table,presets,writer}.cpp tools/scene/loop_settings.cpp
  drivers/files/{height_map_file,input_file,toml,toml_guard}.cpp realtime/threads/thread_setup.cpp)
profiles=$work/stimulator_profiles.cpp
cmake -DNAME=kStimulatorProfiles "-DOUT=$profiles" -DHEADER=tools/embedded_text.hpp \
  "-DFILES=$(printf '%s;' "$source"/tools/scene/stimulators/*.toml)" -P "$source/drivers/files/embed_texts.cmake"
# One instruction set is enough for memory faults.
flags+=(-DHWY_COMPILE_ONLY_STATIC)
fuzz session 8192 "-lpugixml -lhwy" session_fuzz.cpp "${core[@]}" \
  "${sessions[@]}" drivers/sessions/session_{headers,layout,writer}.cpp drivers/sinks/afferent_table.cpp \
  drivers/clock/clock_pair.cpp drivers/files/{file_rename,input_file,output_file}.cpp
fuzz scene 2048 "-lhwy $profiles" scene_fuzz.cpp "${core[@]}" "${scenes[@]}"
# A single run may take 10 s and 2 GB.
limits=(-timeout=10 -rss_limit_mb=2048)
seconds=${MERKEL_FUZZ_SECONDS:-60}
fuzz scene_run 64 "-lhwy $profiles" scene_run_fuzz.cpp "${core[@]}" "${scenes[@]}"
limits=()
seconds=${MERKEL_FUZZ_SECONDS:-}
fuzz recordings 2048 "" recordings_fuzz.cpp "${words[@]}" tools/studies/score/parse_recordings.cpp \
  tools/studies/score/rate_sections.cpp tools/studies/score/measure_sections.cpp tools/studies/score/json_fields.cpp \
  core/contact/{taxel_array,tip_kinds}.cpp core/contact/solver/tip_heights.cpp
fuzz table 2048 "" table_fuzz.cpp tools/batch/text_table.cpp
fuzz uri 512 "" uri_fuzz.cpp "${words[@]}" drivers/uri.cpp drivers/sinks/host_name.cpp
