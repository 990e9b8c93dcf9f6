#!/usr/bin/env bash
# Checks who may include whom: core <- drivers <- realtime <- tools <- tests, and no two sub-folders each other; and that sources of drivers can be joined.
# usage: include_rules.sh SOURCE_FOLDER; prints every violation and fails if there is one.
set -euo pipefail
cd "$1"

# allow FOLDER REGEX: every quoted include below FOLDER must match REGEX.
allow() {
  grep -rnE '^ *# *include *"' "$1" --include='*.hpp' --include='*.cpp' |
    grep -vE "include *\"($2)\"" || true
}

# forbid FOLDER REGEX: no angled include below FOLDER may match REGEX.
forbid() {
  grep -rnE "^ *# *include *<($2)>" "$1" --include='*.hpp' --include='*.cpp' || true
}

violations=$(
  allow core 'core/[^"]*'
  allow drivers '(core|drivers)/[^"]*'
  allow realtime '(core|realtime)/[^"]*|drivers/(probe|sink|clock/clock_pair)\.hpp'
  # Inside realtime the folders form a line too.
  allow realtime/queues '(core|realtime/queues)/[^"]*'
  allow realtime/threads '(core|realtime/(queues|threads))/[^"]*'
  allow realtime/clocks '(core|realtime/(queues|threads|clocks))/[^"]*'
  allow realtime/input '(core|realtime/(queues|threads|clocks|input))/[^"]*|drivers/probe\.hpp'
  allow realtime/output '(core|realtime/(queues|threads|clocks|input|output))/[^"]*|drivers/(probe|sink)\.hpp'
  allow realtime/loop '(core|realtime/(queues|threads|clocks|input|output|loop))/[^"]*'
  allow tools '(core|drivers|realtime|tools)/[^"]*'
  # core uses no threads, clocks, files or devices; models share solved tips when they are set up
  forbid core 'mutex' | grep -v '^core/contact/tip_field\.cpp:' || true
  forbid core 'thread|shared_mutex|condition_variable|future|semaphore|fstream|iostream|filesystem|ctime|time\.h|unistd\.h|fcntl\.h|sys/.*'
)
if [ -n "$violations" ]; then
  echo "forbidden includes (core <- drivers <- realtime <- tools <- tests):"
  echo "$violations"
  exit 1
fi

# Inside a folder the sub-folders and the files beside them form lines too: no two include each other.
circles=$(grep -rE '^ *# *include *"' core drivers realtime tools --include='*.hpp' --include='*.cpp' |
  sed -nE 's|^([^:]+): *# *include *"([^"]+)"|\1 \2|p' |
  awk 'function folder(path,  part) { return split(path, part, "/") > 2 ? part[1] "/" part[2] : part[1] }
       { from = folder($1); to = folder($2) }
       from != to { line[++n] = $1 " includes " $2; back[n] = to SUBSEP from; pair[from, to] }
       END { for (i = 1; i <= n; i++) if (back[i] in pair) print line[i] }')
if [ -n "$circles" ]; then
  echo "sub-folders that include each other:"
  echo "$circles"
  exit 1
fi

# Optional libraries change which sources of drivers are joined: no two may have a constant of the same name.
twice=$(grep -rhE '^constexpr ' drivers --include='*.cpp' |
  sed -nE 's/^constexpr [^={(]*[ &*](k[A-Za-z0-9_]+)(\[[^]]*\])* *[={(].*/\1/p' | sort | uniq -d)
if [ -n "$twice" ]; then
  echo "constants that two sources of drivers have, which cannot be joined:"
  grep -rnwE "^constexpr .*($(echo "$twice" | paste -sd '|'))" drivers --include='*.cpp'
  exit 1
fi
