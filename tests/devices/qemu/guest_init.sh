#!/bin/busybox sh
# The first process of the virtual machine: loads the drivers and reads each device with merkel.
# devices_under_qemu.py checks its output.
export PATH=/bin HOME=/tmp TMPDIR=/tmp
/bin/busybox --install -s /bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
mount -t tmpfs tmp /tmp
# shellcheck disable=SC2086  # one word an option
while read -r module options; do insmod "/modules/$module" $options || echo "no $module"; done </modules/order

wait_for() {  # FILE, at most 10 s
  for _ in $(seq 200); do [ -e "$1" ] && return; usleep 50000; done
  echo "there is no $1"
}
# A part of the test: NAME COMMAND…
part() {
  local name=$1
  shift
  echo "@@begin $name"
  "$@" 2>/tmp/err
  echo "@@exit $?"
  cat /tmp/err
  echo "@@end $name"
}
# Events after merkel has recorded for a while.
later() {
  while [ ! -e /tmp/trace.csv.part ]; do usleep 50000; done
  sleep 1
  for word; do
    case $word in
      adapter) echo '@@replug the adapter' >/dev/console ;;
      *) echo "$word" >&3; sleep 1 ;;
    esac
  done
}
record() { merkel record "$1" /tmp/trace.csv --overwrite --json --duration-s "$2"; }

wait_for /dev/ttyUSB0
chmod 600 /dev/ttyUSB0
part probes merkel probes --json
serial='serial:/dev/ttyUSB0?protocol=hbf1&baud=460800'
later adapter &
part serial record "$serial" 3
part serial_wrong_baud record 'serial:/dev/ttyUSB0?protocol=hbf1&baud=115200' 1
part serial_forbidden su nobody -s /bin/sh -c "merkel record '$serial' /tmp/nothing.csv"

mkfifo /tmp/usb
virtual_usb_device </tmp/usb 2>/tmp/usb_says &
exec 3>/tmp/usb
wait_for /dev/hidraw0
part hid_forbidden su nobody -s /bin/sh -c \
  "merkel record 'hid:1209:0001?fields=force_N:16:16:s:0.001' /tmp/nothing.csv"
fields=fields=seq:0:16:u,force_N:16:16:s:0.001,time_us:32:32:u
later unplug replug &
part hid record "hid:1209:0001?$fields" 3
usb='usb:1209:0001?protocol=hbf1&interface=1&in=130&out=2'
later stall &
part usb_stall record "$usb" 2
later unplug replug &
part usb record "$usb" 3
part hid_by_libusb record "hid:1209:0001?backend=libusb&$fields" 1
part hid_unmapped record hid:1209:0001 1
part run merkel run /scene.toml --json --duration-s 0.6 --sink csv:/tmp/spikes.csv \
  --probe "hid:1209:0001?$fields"
part usb_says cat /tmp/usb_says

# The card of comedi_test, as an ordinary user.
as_user() { su nobody -s /bin/sh -c "$*"; }
wait_for /dev/comedi0
card='comedi:/dev/comedi0?columns=force_V,depth_V&force_N_per_V=1&depth_mm_per_V=1'
part comedi_forbidden as_user merkel record "'$card'" /tmp/nothing.csv
chgrp iocard /dev/comedi0
chmod 660 /dev/comedi0
part comedi_wrong_reference as_user merkel record "'$card&reference=differential'" /tmp/nothing.csv
part comedi as_user merkel record "'$card'" /tmp/card.xdf --json --duration-s 3
# The values of both channels by the driver's formula, from the first one's place in the period on. The
# waveform's period begins at multiples of 0.1 s of the monotonic clock: the error of the times.
waveforms() {
  merkel inspect session /tmp/card.xdf --stream samples | awk -F, '
    function raw(V) { return int((V + 10) * 65535 / 20 + 0.5) }
    function saw(t) { return int(t * 32766 / 100000) + 16384 }
    NR == 1 { for (i = 1; i <= NF; ++i) place[$i] = i; next }
    { n = NR - 2; time[n] = $place["time_s"]; a[n] = raw($place["force_mN"] / 1000); b[n] = raw($place["depth_mm"]) }
    END {
      least = NR
      for (t = 0; t < 100000; ++t) {
        if (saw(t) != a[0]) continue
        for (apart = 0; apart <= 50; apart += 50) {  # the second channel is converted after the first
          wrong = 0
          for (k = 0; k <= n; ++k) {
            now = (t + 100 * k) % 100000
            later = (now + apart) % 100000
            if (a[k] != saw(now) || b[k] != (later < 50000 ? 16384 : 49150)) ++wrong
          }
          if (wrong < least) { least = wrong; first = t }
        }
      }
      for (k = 0; k <= n; ++k) {
        late = (time[k] * 1000000) % 100000 - (first + 100 * k) % 100000
        if (late > 50000) late -= 100000
        if (late < -50000) late += 100000
        squares += late * late
        mean += late
      }
      printf "scans=%d wrong=%d mean_us=%.0f mean_square_us2=%.0f\n", n + 1, least, mean / (n + 1), squares / (n + 1)
    }'
}
part comedi_values waveforms
part comedi_fast as_user merkel record "'comedi:/dev/comedi0?columns=force_V&force_N_per_V=1&rate_hz=40000'" \
  /tmp/fast.csv --json --duration-s 92
rm /tmp/fast.csv
stopped() {  # for longer than fills two megabytes, the buffer of Debian's kernel
  while [ ! -e /tmp/overrun.xdf.part ]; do usleep 50000; done
  sleep 2
  killall -STOP merkel
  sleep 10
  killall -CONT merkel
}
stopped &
eight='comedi:/dev/comedi0?columns=force_V,-,-,-,-,-,-,-&force_N_per_V=1&rate_hz=25000'
part comedi_overrun as_user merkel record "'$eight'" /tmp/overrun.xdf --json --duration-s 30
part comedi_doctor as_user merkel doctor --probe "'$card'" --json --seconds 8
part comedi_connect as_user "merkel connect '$card' --out /tmp/card.toml --yes && cat /tmp/card.toml"
sed 's/decimate.*//; s/\[probe\]/[probe]\ndecimate = "mean"/' /scene.toml >/tmp/mean.toml
chmod 644 /tmp/mean.toml
part comedi_run as_user merkel run /tmp/mean.toml --json --duration-s 0.6 --sink csv:/tmp/card_spikes.csv \
  --probe "'$card'"
echo '@@done'
poweroff -f
