#!/usr/bin/env bash
# The headers of each folder must compile without anything before them: one unit per folder, in the order of their names.
# usage: headers_test.sh SOURCE_FOLDER COMPILER
set -euo pipefail
cd "$1"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for folder in $(find core drivers realtime tools/scene -name '*.hpp' -printf '%h\n' | sort -u); do
  unit=$work/${folder//\//_}.cpp
  printf '#include "%s"\n' "$folder"/*.hpp >"$unit"
  echo "$unit"
done | xargs -P 2 -n 1 "$2" -std=c++20 -fsyntax-only -Wall -Wextra -I. -isystem /usr/include/eigen3
