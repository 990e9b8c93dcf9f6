#!/usr/bin/env bash
# Installs the libraries, and builds and runs a project that finds them with find_package(merkel).
# usage: consumer_test.sh SOURCE_FOLDER BUILD_FOLDER
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cmake --install "$2" --prefix "$work/prefix" >/dev/null
# With assertions, unlike the libraries: no type of a public header may depend on them. The library
# of the queues has such types.
cmake -S "$1/tests/consumer" -B "$work/build" -G Ninja -DCMAKE_BUILD_TYPE=Debug \
  -DCMAKE_PREFIX_PATH="$work/prefix" >/dev/null
cmake --build "$work/build"
if ninja -C "$work/build" -t deps | grep readerwriterqueue; then
  echo "a public header includes the library of the queues" >&2
  exit 1
fi
"$work/build/consumer"

# The same program by pkg-config, from a folder that moved.
mv "$work/prefix" "$work/moved"
pc=$(cd "$work/moved" && find . -name merkel.pc -printf '%h')
flags=$(PKG_CONFIG_PATH="$work/moved/$pc" pkg-config --cflags --libs merkel)
# shellcheck disable=SC2086  # words
"${CXX:-c++}" -std=c++20 "$1/tests/consumer/consumer.cpp" $flags -o "$work/by_pkg_config"
"$work/by_pkg_config"
mv "$work/moved" "$work/prefix"

# The program, installed: its version names the commit, and the unit names the program.
"$work/prefix/bin/merkel" --version | grep -E '^merkel [0-9.]+ \(([0-9a-f]{40}(-dirty)?|unknown)\)$'
grep -x "ExecStart=$work/prefix/bin/merkel run /etc/merkel/%i.toml" \
  "$work/prefix/lib/systemd/system/merkel@.service"
[ -e "$work/prefix/lib/udev/rules.d/70-merkel.rules" ]
if command -v help2man >/dev/null; then
  # To the end: with -q, grep would leave zcat a broken pipe.
  zcat "$work/prefix/share/man/man1/merkel.1.gz" | grep -F '.SH "MERKEL SIMULATE-PROBE"' >/dev/null
fi
# What belongs to it: completion, documents, the node of BRAND.
for place in bash-completion/completions/merkel fish/vendor_completions.d/merkel.fish zsh/vendor-completions/_merkel \
  doc/merkel/README.md doc/merkel/tools/scene/README.md; do
  [ -s "$work/prefix/share/$place" ] || { echo "share/$place is not installed" >&2; exit 1; }
done
"$work/prefix/share/doc/merkel/examples/brand_node" --help | grep BRAND >/dev/null
