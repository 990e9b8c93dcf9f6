#!/usr/bin/env bash
# Writes the man page of merkel from the --help of the program and of each subcommand.
# usage: man_page.sh MERKEL VERSION FILE.1.gz
set -euo pipefail
merkel=$1 version=$2 out=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export LC_ALL=C.UTF-8 COLUMNS=100

subcommands=$("$merkel" --help | sed -n '/^Subcommands:/,$s/^  \([a-z][a-z-]*\) .*/\1/p')
[ -n "$subcommands" ]
{
  for subcommand in $subcommands; do
    printf '[merkel %s]\n.nf\n' "$subcommand"
    # Literal text: no escapes, and no line that starts with a request.
    "$merkel" "$subcommand" --help | sed -e 's/\\/\\e/g' -e 's/-/\\-/g' -e "s/^[.']/\\\\\&&/"
    printf '.fi\n\n'
  done
} >"$work/subcommands.h2m"
help2man --no-info --locale=C.UTF-8 --section=1 --name='real-time bridge from a haptic probe to tactile spikes' \
  --version-string="$version" --include="$work/subcommands.h2m" --output="$work/merkel.1" "$merkel"
gzip -9n <"$work/merkel.1" >"$out"
