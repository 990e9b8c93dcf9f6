#!/usr/bin/env bash
# The release must keep the arithmetic it promises: no flag that gives up NaN or infinity, and nothing
# linked in that flushes subnormal numbers to zero for the whole process.
# usage: release_arithmetic_test.sh BUILD_FOLDER
set -euo pipefail
build=$1

forbidden='-ffast-math|-Ofast|-ffinite-math-only|-funsafe-math-optimizations|-fassociative-math|-mdaz-ftz'
if grep -E -m1 -- "$forbidden" "$build/compile_commands.json" "$build/build.ninja"; then
  echo "a target is built with a flag that gives up IEEE arithmetic" >&2
  exit 1
fi
if nm "$build/merkel" | grep -i 'set_fast_math'; then
  echo "merkel is linked with code that sets flush-to-zero" >&2
  exit 1
fi

# The check itself must notice.
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
echo 'int main() { return 0; }' >"$work/fast.cpp"
c++ -Ofast "$work/fast.cpp" -o "$work/fast"
nm "$work/fast" | grep -i set_fast_math >/dev/null || { echo "the planted flush-to-zero was not noticed" >&2; exit 1; }
