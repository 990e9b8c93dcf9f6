#!/usr/bin/env bash
# Checks the shipped systemd unit: it is valid, its exposure is at most 3.0 of 10, and it has a
# watchdog. Checks that the udev rules leave USB serial ports of unknown devices to ModemManager.
# usage: service_test.sh SOURCE_FOLDER
set -euo pipefail
source=$1
rules=$source/drivers/system/70-merkel.rules
if grep ID_MM_ "$rules" | grep -v 'ATTRS{idVendor}'; then
  echo "a rule takes every USB serial port from ModemManager"
  exit 1
fi
command -v systemd-analyze >/dev/null || { echo "no systemd-analyze: skipped"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
sed -e 's|@CMAKE_INSTALL_FULL_BINDIR@/merkel|/bin/true|' \
  "$source/drivers/system/merkel@.service.in" >"$folder/merkel@.service"
grep -q '^WatchdogSec=' "$folder/merkel@.service"
cp "$folder/merkel@.service" "$folder/merkel@test.service"
systemd-analyze security --offline=true --threshold=30 --no-pager "$folder/merkel@test.service"
