#!/usr/bin/env bash
# Builds the firmware for AVR boards as the Arduino IDE does, with Debian's arduino-core-avr and gcc-avr.
# usage: tests/devices/avr/build_firmware.sh FOLDER   writes FOLDER/{uno,mega,leonardo,hand}.elf; hand: an Uno with six load cells
# Exits with 77 if the packages are missing (tools/install_packages avr).
set -euo pipefail

folder=$1
sketch=$(cd "$(dirname "$0")/../../../drivers/firmware/merkel_probe" && pwd)
arduino=/usr/share/arduino/hardware/arduino/avr
core=$arduino/cores/arduino
if ! command -v avr-g++ >/dev/null || [ ! -e $core/Arduino.h ]; then
  echo "Skipped: gcc-avr or arduino-core-avr is missing (tools/install_packages avr)." >&2
  exit 77
fi

build() { # NAME MCU BOARD VARIANT [FLAG]
  local name=$1 mcu=$2 board=$3 variant=$4 flag=${5:-} objects=$folder/$1 source
  local flags=(-Os -w -ffunction-sections -fdata-sections -mmcu="$mcu" -DF_CPU=16000000L -DARDUINO=10819
    -DARDUINO_ARCH_AVR -D"ARDUINO_$board" -I"$core" -I"$arduino/variants/$variant")
  [ "$name" = leonardo ] && flags+=(-DUSB_VID=0x2341 -DUSB_PID=0x8036
    '-DUSB_MANUFACTURER="Unknown"' '-DUSB_PRODUCT="Arduino Leonardo"')
  rm -rf "$objects"
  mkdir -p "$objects"
  for source in "$core"/*.c; do avr-gcc -std=gnu11 "${flags[@]}" -c "$source" -o "$objects/$(basename "$source").o"; done
  for source in "$core"/*.S; do avr-gcc -x assembler-with-cpp "${flags[@]}" -c "$source" -o "$objects/$(basename "$source").o"; done
  # The standard and the checks are those of arduino-core-avr's platform.txt.
  # gcc-avr 5.4 defines DECIMAL_DIG, which WString.cpp uses, for C only.
  local plus=(-std=gnu++11 -fpermissive -fno-exceptions -fno-threadsafe-statics -DDECIMAL_DIG=__DECIMAL_DIG__)
  for source in "$core"/*.cpp; do avr-g++ "${plus[@]}" "${flags[@]}" -c "$source" -o "$objects/$(basename "$source").o"; done
  avr-g++ "${plus[@]}" "${flags[@]}" -Wall -Wextra -Werror -x c++ ${flag:+"$flag"} -include Arduino.h -I"$sketch" \
    -c "$sketch/merkel_probe.ino" -o "$objects/sketch.o"
  avr-gcc -Os -mmcu="$mcu" -Wl,--gc-sections -o "$folder/$name.elf" "$objects"/*.o -lm
  avr-size "$folder/$name.elf" | awk -v name="$name" 'NR == 2 { print name ": program " $1 + $2 " bytes, memory " $2 + $3 " bytes" }'
}

build uno atmega328p AVR_UNO standard
build mega atmega2560 AVR_MEGA2560 mega
build leonardo atmega32u4 AVR_LEONARDO leonardo
build hand atmega328p AVR_UNO standard -DHAND
