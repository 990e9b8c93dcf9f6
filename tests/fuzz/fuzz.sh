#!/usr/bin/env bash
# Fuzzes every parser of the protocol table with libFuzzer, address and undefined sanitizers.
# usage: fuzz.sh SOURCE_FOLDER [BYTES [CORPUS_FOLDER]]
# At least BYTES random bytes go through each (default: ten million). What is found is kept in
# CORPUS_FOLDER/PROTOCOL, where the next run goes on from; the seeds in the sources are small.
set -euo pipefail
source=$1
bytes=${2:-10000000}
corpora=${3:-$(mktemp -d)}
if ! command -v clang++ >/dev/null; then
  echo "skipped: clang++ is not installed (tools/install_packages ci)"
  exit 77
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
longest=4096

flags=(-std=c++20 -O1 -g1 -I "$source" -fsanitize=address,undefined,fuzzer-no-link
  -fno-sanitize-recover=all)
objects=()
for file in "$source"/drivers/protocols/*.cpp "$source"/drivers/{uri,files/csv_text}.cpp \
  "$source"/core/{nearest_name,parameter_error}.cpp; do
  object="$work/$(basename "$file" .cpp).o"
  clang++ "${flags[@]}" -c "$file" -o "$object"
  objects+=("$object")
done
for protocol in $(sed -n 's/^ *{"\([a-z0-9]*\)", .*/\1/p' "$source/drivers/protocols/protocol_table.cpp"); do
  clang++ "${flags[@]}" "-DMERKEL_FUZZED_PROTOCOL=\"$protocol\"" -fsanitize=fuzzer \
    "$source/tests/fuzz/protocol_fuzz.cpp" "${objects[@]}" -o "$work/$protocol"
  mkdir -p "$corpora/$protocol"
  seeds="$source/tests/fuzz/seeds/$protocol"
  "$work/$protocol" -seed=1 -max_len=$longest -len_control=0 -runs=$((bytes / (longest / 8))) \
    -print_final_stats=0 -verbosity=0 "$corpora/$protocol" "$seeds"
  echo "$protocol: no fault"
done
clang++ "${flags[@]}" -fsanitize=fuzzer "$source/tests/fuzz/descriptor_fuzz.cpp" "${objects[@]}" \
  -o "$work/hid_descriptor"
mkdir -p "$corpora/hid_descriptor"
"$work/hid_descriptor" -seed=1 -max_len=$longest -len_control=0 -runs=$((bytes / (longest / 8))) \
  -print_final_stats=0 -verbosity=0 "$corpora/hid_descriptor" "$source/tests/fuzz/seeds/hid_descriptor"
echo "hid_descriptor: no fault"
