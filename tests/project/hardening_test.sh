#!/usr/bin/env bash
# The release program must be hardened: position-independent, all of its tables read-only once it
# runs, stack protector, checked copies (_FORTIFY_SOURCE), and on x86 control-flow protection.
# usage: hardening_test.sh BUILD_FOLDER
set -euo pipefail
build=$1

# Prints the missing features of a program, one word each.
lacks() {
  local header dynamic program symbols
  header=$(readelf -hW "$1") dynamic=$(readelf -dW "$1") program=$(readelf -lW "$1")
  symbols=$(readelf -sW --dyn-syms "$1")
  grep -q 'Type: *DYN' <<<"$header" || echo PIE
  grep -qE 'BIND_NOW|Flags:.* NOW' <<<"$dynamic" || echo BIND_NOW
  grep -q GNU_RELRO <<<"$program" || echo RELRO
  grep -qE 'GNU_STACK.* RW ' <<<"$program" || echo non-executable-stack
  grep -q '__stack_chk_fail' <<<"$symbols" || echo stack-protector
  grep -qE '__(strcpy|memcpy|memmove|memset|read|snprintf|vsnprintf|fprintf|printf|recv|poll)_chk' <<<"$symbols" || echo FORTIFY_SOURCE
}
# Prints the objects of a library that are built without control-flow protection.
unprotected() {
  readelf -nW "$1" | awk '
    /^File: / { if (file != "" && !found) print file; file = $2; found = 0 }
    /IBT, SHSTK/ { found = 1 }
    END { if (file != "" && !found) print file }'
}

missing=$(lacks "$build/merkel")
if [ "$(uname -m)" = x86_64 ]; then
  for library in "$build"/{core/libmerkel_core,drivers/libmerkel_drivers,realtime/libmerkel_realtime,tools/libmerkel_tools,tools/scene/libmerkel_scene}.a; do
    missing+=$(unprotected "$library")
  done
fi
if [ -n "$missing" ]; then
  echo "merkel is built without: $missing" >&2
  exit 1
fi

# The check itself must notice.
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cat >"$work/soft.cpp" <<'CODE'
#include <cstdio>
#include <cstring>
int main(int argc, char** argv) {
  char text[16];
  std::strcpy(text, argv[argc - 1]);
  return std::puts(text) < 0;
}
CODE
c++ -O2 -U_FORTIFY_SOURCE -fno-stack-protector -fcf-protection=none -fno-pie -no-pie \
  -Wl,-z,norelro,-z,lazy,-z,execstack "$work/soft.cpp" -o "$work/soft" 2>/dev/null ||
  c++ -O2 -U_FORTIFY_SOURCE -fno-stack-protector -fno-pie -no-pie \
    -Wl,-z,norelro,-z,lazy,-z,execstack "$work/soft.cpp" -o "$work/soft"
noticed=$(lacks "$work/soft" | xargs)
if [ "$noticed" != "PIE BIND_NOW RELRO non-executable-stack stack-protector FORTIFY_SOURCE" ]; then
  echo "of a program without any protection only this was noticed: $noticed" >&2
  exit 1
fi
if [ "$(uname -m)" = x86_64 ]; then
  c++ -fcf-protection=none -c "$work/soft.cpp" -o "$work/soft.o"
  ar rc "$work/soft.a" "$work/soft.o"
  [ -n "$(unprotected "$work/soft.a")" ] || { echo "missing control-flow protection was not noticed" >&2; exit 1; }
fi
