#!/usr/bin/env bash
# Fuzzes everything that reads outside bytes with libFuzzer, address and undefined sanitizers: the targets of CMakeLists.txt beside this
# file, in the build of the preset asan.
# usage: fuzz.sh [BYTES [CORPUS_FOLDER [NAME…]]]
# At least BYTES random bytes go through each target (default: ten million), or through the named ones, unless
# MERKEL_FUZZ_SECONDS end it earlier (scene_run: 60 s by default). CORPUS_FOLDER/NAME keeps interesting inputs for
# the next run; the seeds in the sources are small. `tests/fuzz/session_seeds.py build/release/merkel
# CORPUS_FOLDER/session` makes those of sessions.
set -euo pipefail
cd "$(dirname "$0")/../.."
bytes=${1:-10000000}
corpora=${2:-$(mktemp -d)}
if ! command -v clang++ >/dev/null; then
  echo "skipped: clang++ is not installed (tools/install_packages ci)"
  exit 77
fi
cmake --preset asan >/dev/null
targets=$(cat build/asan/tests/fuzz/targets.txt)
if [ $# -gt 2 ]; then
  known=$targets targets=
  for name in "${@:3}"; do
    target=$(grep "^$name " <<<"$known") || { echo "$name is none of: $(cut -d ' ' -f 1 <<<"$known" | xargs)" >&2; exit 2; }
    targets+="$target"$'\n'
  done
fi
mapfile -t built < <(sed -nE 's/^(\S+) .*/merkel_fuzz_\1/p' <<<"$targets")
cmake --build --preset asan --target "${built[@]}"
while read -r name longest; do
  [ -n "$name" ] || continue
  seconds=${MERKEL_FUZZ_SECONDS:-}
  limits=()
  if [ "$name" = scene_run ]; then  # a single run may take 100 s and 2 GB
    seconds=${MERKEL_FUZZ_SECONDS:-60}
    limits=(-timeout=100 -rss_limit_mb=2048)
  fi
  folders=("$corpora/$name")
  [ -d "tests/fuzz/seeds/$name" ] && folders+=("tests/fuzz/seeds/$name")
  mkdir -p "$corpora/$name"
  "build/asan/tests/fuzz/merkel_fuzz_$name" -seed=1 -max_len="$longest" -len_control=0 -runs=$((bytes / (longest / 8))) \
    -print_final_stats=0 -verbosity=0 "${limits[@]}" ${seconds:+"-max_total_time=$seconds"} "${folders[@]}" </dev/null
  echo "$name: no fault"
done <<<"$targets"
