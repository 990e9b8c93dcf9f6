#!/usr/bin/env bash
# Shows that include_rules.sh passes on the sources and fails on each kind of planted violation.
# usage: include_rules_test.sh SOURCE_FOLDER
set -euo pipefail
source=$1
rules="$source/tests/project/include_rules.sh"
"$rules" "$source"

copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
plant() {  # FILE LINE
  rm -rf "${copy:?}"/*
  cp -r "$source"/{core,drivers,realtime,tools} "$copy"
  echo "$2" >>"$copy/$1"
  if "$rules" "$copy" >"$copy/said"; then
    echo "not noticed: $2 in $1"
    exit 1
  fi
  grep -q "$1" "$copy/said"
}
plant core/math/random.hpp '#include "drivers/probe.hpp"'
plant core/math/random.hpp '#include <thread>'
plant drivers/probe.hpp '#include "realtime/pipeline.hpp"'
plant realtime/pipeline.cpp '#include "drivers/protocols/trace_file.hpp"'
plant core/records/tick_record.hpp '#include "core/contact/contact_validity.hpp"'
plant tools/command_line.cpp '#include "tools/commands/command.hpp"'
plant tools/scene/scene_file.cpp '# include "tests/tools/program.hpp"'
plant drivers/sinks/lsl_sink.cpp 'constexpr std::chrono::milliseconds kFarewell{5};'
