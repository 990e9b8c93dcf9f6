#!/bin/busybox sh
# The first process of the virtual machine: loads the drivers and reads each device with merkel.
# devices_under_qemu.py checks its output.
export PATH=/bin HOME=/tmp TMPDIR=/tmp
/bin/busybox --install -s /bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
mount -t tmpfs tmp /tmp
for module in $(cat /modules/order); do insmod "/modules/$module" || echo "no $module"; done

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
echo '@@done'
poweroff -f
