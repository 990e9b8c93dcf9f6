#!/usr/bin/env python3
"""Reads devices with merkel on Debian's kernel in a virtual machine: ftdi_sio, usbhid with hidraw, usbfs,
each unplugged and plugged in again, and comedi_test, a data-acquisition card. Needs neither root nor KVM nor a network.

  tests/devices/qemu/devices_under_qemu.py --fetch     (once: gets the kernel's package by apt)
  tests/devices/qemu/devices_under_qemu.py

Exits with 77 and prints what is missing if it cannot run."""
import argparse
import glob
import json
import os
import re
import shutil
import stat
import subprocess
import sys
import tarfile
import tempfile
import threading
import time

HERE = os.path.dirname(os.path.abspath(__file__))
MODULES = ["xhci_pci", "ftdi_sio", "usbhid", "hid_generic", "vhci_hcd", "comedi_test"]
# Of the card: a sawtooth on channel 0 and a square on channel 1.
OPTIONS = {"comedi_test": " amplitude=5000000 period=100000"}
# hidapi's backends are loaded at run time.
LOADED_LATER = ["libhidapi-hidraw.so.0", "libhidapi-libusb.so.0"]
SCENE = """[receptors]
placement = "lattice"
[neuron]
method = "rush_larsen"
precision = "float"
step_us = 100
[probe]
delay_ms = 300
[loop]
scheduler = "normal"  # an emulated processor is too slow for real time
stale_after_ms = 200
max_catch_up_ticks = 1000000
"""


class Skipped(Exception):
    pass


def fetch_kernel(cache):
    """Downloads the kernel's package with apt; the metapackage gives its present name."""
    os.makedirs(cache, exist_ok=True)
    depends = subprocess.run(["apt-cache", "depends", "linux-image-amd64"], capture_output=True, text=True,
                             check=True).stdout
    package = re.search(r"Depends: (linux-image-\d\S*-amd64)", depends).group(1)
    if not glob.glob(f"{cache}/{package}_*.deb"):
        subprocess.run(["apt-get", "download", "-qq", package], cwd=cache, check=True)


def kernel_of(cache):
    """(path of the kernel, folder of its modules), unpacked from the package in the cache, or those
    of this machine."""
    packages = sorted(glob.glob(f"{cache}/linux-image-*.deb"))
    if packages:
        unpacked = packages[-1] + ".modules"
        if not os.path.exists(unpacked):
            with tempfile.TemporaryDirectory(dir=cache) as folder:
                wanted = re.compile(r"\./(boot/vmlinuz|lib/modules/[^/]*/kernel/drivers/(usb|hid|comedi)/)")
                with subprocess.Popen(["dpkg-deb", "--fsys-tarfile", packages[-1]],
                                      stdout=subprocess.PIPE) as unpacking:
                    with tarfile.open(fileobj=unpacking.stdout, mode="r|") as archive:
                        for member in archive:
                            if wanted.match(member.name) and member.isfile():
                                archive.extract(member, folder)
                shutil.copytree(folder, unpacked)
        return glob.glob(f"{unpacked}/boot/vmlinuz-*")[0], glob.glob(f"{unpacked}/lib/modules/*")[0]
    for kernel in sorted(glob.glob("/boot/vmlinuz-*-amd64"), reverse=True):
        modules = "/lib/modules/" + kernel.split("vmlinuz-")[1]
        if os.access(kernel, os.R_OK) and find_modules(modules).get("vhci_hcd"):
            return kernel, modules
    raise Skipped(f"there is no kernel with vhci_hcd: fetch Debian's by {sys.argv[0]} --fetch "
                  f"--cache {cache}")


def find_modules(folder):
    """Paths by name; the kernel writes _ for -."""
    return {os.path.basename(path)[:-3].replace("-", "_"): path
            for path in glob.glob(f"{folder}/kernel/**/*.ko", recursive=True)}


def in_order(names, modules):
    """The modules and their dependencies, in loading order."""
    order = []

    def add(name):
        if name in order or name not in modules:  # otherwise built in
            return
        with open(modules[name], "rb") as file:
            depends = re.search(rb"\0depends=([^\0]*)\0", file.read()).group(1).decode()
        for other in filter(None, depends.split(",")):
            add(other.replace("-", "_"))
        order.append(name)

    for name in names:
        if name not in modules:
            raise Skipped(f"the kernel has no module {name}: it must be the one of linux-image-amd64")
        add(name)
    return order


def libraries_of(program):
    """The files that the loader opens for a program, including the program."""
    lines = subprocess.run(["ldd", program], capture_output=True, text=True).stdout
    return set(re.findall(r"(?:=> |^\s*)(/\S+) \(", lines, re.M))


class Archive:
    """An initial file system in cpio's newc form."""

    def __init__(self, path):
        self.file = open(path, "wb")
        self.number = 0
        self.folders = set()

    def entry(self, name, mode, content=b""):
        self.number += 1
        fields = [self.number, mode, 0, 0, 1, 0, len(content), 0, 0, 0, 0, len(name) + 1, 0]
        head = b"070701" + b"".join(b"%08x" % field for field in fields) + name.encode() + b"\0"
        self.file.write(head + b"\0" * (-len(head) % 4) + content + b"\0" * (-len(content) % 4))

    def folder(self, name):
        if name and name not in self.folders:
            self.folder(os.path.dirname(name))
            self.folders.add(name)
            self.entry(name, stat.S_IFDIR | 0o755)

    def add(self, name, content, mode=0o755):
        self.folder(os.path.dirname(name))
        self.entry(name, stat.S_IFREG | mode, content)

    def copy(self, path, name=None):
        with open(path, "rb") as file:
            self.add(name or path.lstrip("/"), file.read())

    def close(self):
        self.entry("TRAILER!!!", 0)
        self.file.close()


def make_initial_files(path, arguments, modules):
    archive = Archive(path)
    for folder in ["proc", "sys", "dev", "tmp", "bin"]:
        archive.folder(folder)
    programs = {"bin/merkel": arguments.merkel, "bin/virtual_usb_device": arguments.usb_device,
                "bin/busybox": shutil.which("busybox")}
    libraries = set()
    for name, program in programs.items():
        archive.copy(program, name)
        libraries |= libraries_of(program)
    known = subprocess.run(["/sbin/ldconfig", "-p"], capture_output=True, text=True).stdout
    for library in LOADED_LATER:
        place = re.search(rf"{re.escape(library)} .*=> (\S+)", known)
        if not place:
            raise Skipped(f"{library} is missing: install libhidapi-dev")
        libraries |= {place.group(1)} | libraries_of(place.group(1))
    for library in sorted(libraries):
        archive.copy(os.path.realpath(library), "lib/" + os.path.basename(library))
        if "ld-linux" in library:
            archive.copy(os.path.realpath(library), library.lstrip("/"))
    for name in modules:
        archive.copy(modules[name], f"modules/{name}.ko")
    archive.add("modules/order", "".join(f"{name}.ko{OPTIONS.get(name, '')}\n" for name in modules).encode())
    archive.add("scene.toml", SCENE.encode(), 0o644)
    archive.add("etc/passwd", b"root:x:0:0:root:/:/bin/sh\nnobody:x:65534:65534:nobody:/:/bin/sh\n")
    archive.add("etc/group", b"root:x:0:\ndialout:x:20:\niocard:x:107:nobody\n")
    with open(f"{HERE}/guest_init.sh", "rb") as file:
        archive.add("init", file.read())
    archive.close()


class Machine:
    """The virtual machine and its output."""

    def __init__(self, kernel, initial_files, terminal):
        self.lines = []
        self.changed = threading.Condition()
        self.ended = False
        adapter = "usb-serial,id=adapter,chardev=probe,serial=QEMU7"
        self.process = subprocess.Popen(
            ["qemu-system-x86_64", "-M", "pc", "-accel", "tcg", "-cpu", "max", "-m", "1536",
             "-nodefaults", "-display", "none", "-no-reboot", "-kernel", kernel,
             "-initrd", initial_files, "-append",
             "console=ttyS0 quiet loglevel=1 mitigations=off panic=-1 no_timer_check tsc=unstable "
             "random.trust_cpu=on nokaslr audit=0",
             "-chardev", "file,id=console,path=/dev/stderr", "-serial", "chardev:console",
             "-chardev", f"serial,id=probe,path={terminal}",
             "-device", "qemu-xhci", "-device", adapter, "-monitor", "stdio"],
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
            errors="replace")
        self.adapter = adapter
        threading.Thread(target=self.listen, daemon=True).start()

    def listen(self):
        for line in self.process.stderr:
            with self.changed:
                self.lines.append(line.rstrip())
                self.changed.notify_all()
        with self.changed:
            self.ended = True
            self.changed.notify_all()

    def monitor(self, command):
        try:
            self.process.stdin.write(command + "\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            pass  # the machine has ended; parts are missing

    def wait_for(self, line, seconds):
        with self.changed:
            self.changed.wait_for(lambda: self.ended or line in self.lines, seconds)
            return line in self.lines

    def parts(self):
        """The output of each part of the test: exit code, standard output, errors."""
        text = "\n".join(self.lines)
        found = re.findall(r"@@begin (\w+)\n(.*?)@@exit (\d+)\n(.*?)@@end \1", text, re.S)
        return {name: (int(code), out, err) for name, out, code, err in found}


FAILURES = []


def check(true, what):
    print(f"  {'ok' if true else 'FAILED'}: {what}")
    if not true:
        FAILURES.append(what)


def json_of(out):
    """The summary of a part, without messages to the host in between."""
    return json.loads("\n".join(line for line in out.splitlines() if not line.startswith("@@")))


def check_parts(parts):
    def device(name):
        code, out, err = parts.get(name, (-1, "", "it did not run"))
        print(f"{name}:")
        check(code == 0, f"merkel ends well {err.strip() + out if code else ''}")
        if code != 0:
            return None, err
        summary = json_of(out)
        counts = summary.get("device") or summary["probes"][0]["device"]
        print(f"  {counts['readings']} readings, {counts['lost']} lost, {counts['damaged']} damaged, "
              f"{counts['outages']} outages, {counts['port']}")
        return counts, err

    def refused(name, *words, exit_code=3):
        code, _, err = parts.get(name, (-1, "", "it did not run"))
        print(f"{name}:\n  {err.strip()}")
        check(code == exit_code and err.count("\n") == 1, f"one sentence, exit {exit_code}")
        for word in words:
            check(word in err, f"it says \"{word}\"")

    code, out, err = parts.get("probes", (-1, "", "it did not run"))
    print("probes:")
    check(code == 0, f"merkel probes ends well {err if code else ''}")
    listed = {entry["uri"]: entry for entry in json.loads(out)["devices"]} if code == 0 else {}
    port = listed.get("serial:/dev/ttyUSB0", {})
    check(port.get("serial_number") == "QEMU7", "the adapter's serial number")
    check(port.get("latency_timer", "").endswith(" ms"), "its latency timer")
    check("usb:0403:6001" in listed, "it is listed as a USB device too")
    check("comedi_test" in listed.get("comedi:/dev/comedi0", {}).get("name", ""), "the card is listed")

    counts, err = device("serial")
    if counts:
        check("low-latency flag set, latency timer 1 ms" in counts["port"],
              "ftdi_sio takes the low-latency flag")
        check(counts["readings"] > 1000, "readings come")
        check(counts["outages"] == 1 and "is disconnected" in err and "is back" in err,
              "one outage, and it came back")
        check(counts["lost"] > 100, "what was sent meanwhile is counted as lost")
    refused("serial_wrong_baud", "baud rate (now 115200 Bd")
    refused("serial_forbidden", "no permission to open /dev/ttyUSB0", "udev rules")
    refused("hid_forbidden", "no permission to open /dev/hidraw0", "udev rules")
    for name in ["hid", "usb"]:
        counts, err = device(name)
        if counts:
            check(counts["readings"] > 300, "readings come")
            check(counts["outages"] == 1 and "is disconnected" in err and "is back" in err,
                  "one outage, and it came back")
            check(counts["damaged"] == 0, "nothing is damaged")
    counts, _ = device("usb_stall")
    if counts:
        check(counts["outages"] == 0, "a stall is no outage")
        check(counts["readings"] > 1000, "readings come")
    check_card(parts, device, refused)
    code, out, _ = parts.get("usb_says", (-1, "", ""))
    check(out.count("halt cleared") >= 1, "the halt was cleared on the bus")
    counts, _ = device("hid_unmapped")
    if counts:
        check(counts["readings"] > 100 and counts["device_clock"],
              "force and time are found by the report descriptor")
    counts, _ = device("run")
    if counts:
        check(counts["readings"] > 100, "readings come")
        check(json_of(parts["run"][1])["spikes"] > 0, "spikes come of them")
    counts, _ = device("hid_by_libusb")
    if counts:
        check(counts["port"] == "libusb" and counts["readings"] > 100,
              "libusb takes the device from usbhid")


def check_card(parts, device, refused):
    """The data-acquisition card, read by an ordinary user in the group of its node."""
    refused("comedi_forbidden", "no permission to open /dev/comedi0", "iocard")
    refused("comedi_wrong_reference", "set reference=ground", exit_code=2)
    counts, _ = device("comedi")
    if counts:
        check(counts["overruns"] == 0 and counts["lost"] == 0, "nothing is lost")
        check(counts["device_clock"], "the card's clock gives the times")
    code, out, _ = parts.get("comedi_values", (-1, "", ""))
    print("comedi_values:\n  " + out.strip())
    values = dict(word.split("=") for word in out.split()) if code == 0 else {}
    check(int(values.get("scans", 0)) > 25000, "three seconds of scans are in the session")
    check(values.get("wrong") == "0", "every value of both channels is the waveform's")
    # The driver passes its scans on once in a tick of the kernel, 4 ms: the envelope is that of the fastest.
    check(float(values.get("mean_square_us2", "inf")) < 5000 ** 2, "the times are those of the waveform to 5 ms")
    counts, _ = device("comedi_fast")
    if counts:
        check(counts["overruns"] == 0 and counts["lost"] == 0, "nothing is lost")
        check(counts["readings"] >= 3_600_000, "as many scans as an hour has at 1 kHz")
    counts, err = device("comedi_overrun")
    if counts:
        # A slow host adds some of its own.
        check(counts["overruns"] >= 1 and "its buffer was full" in err, "an overrun, and it says so")
        check(counts["outages"] == 0, "it is no outage")
        # Of ten seconds, two megabytes hold five.
        check(counts["lost"] > 100_000, "the lost readings are counted")
        check(counts["lost"] + counts["readings"] > 25_000 * 29, "all scans of thirty seconds are read or counted")
    code, out, err = parts.get("comedi_doctor", (-1, "", ""))
    print("comedi_doctor:")
    times = json_of(out) if code == 0 else {}
    check(abs(times.get("rate_hz", 0) - 10_000) < 100, f"doctor measures the rate of the scans {err}")
    check(times.get("device", {}).get("lost") == 0 and times["read"]["count"] > 100, "losses and the time of a read")
    code, out, err = parts.get("comedi_connect", (-1, "", ""))
    print("comedi_connect:")
    check(code == 0 and "uri = \"comedi:/dev/comedi0" in out, f"connect writes its scene {err}")
    counts, _ = device("comedi_run")
    if counts:
        check(json_of(parts["comedi_run"][1])["probes"][0]["decimate"] == "mean", "the ticks use the mean")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--fetch", action="store_true", help="get the kernel's package, and end")
    parser.add_argument("--cache", default="build/release/qemu", help="where the package is kept")
    parser.add_argument("--merkel", default="build/release/merkel")
    parser.add_argument("--usb-device",
                        default="build/release/tests/devices/qemu/merkel_virtual_usb_device")
    parser.add_argument("--console", action="store_true", help="print what the machine says")
    arguments = parser.parse_args()
    if arguments.fetch:
        fetch_kernel(arguments.cache)
        return 0
    for program, package in [("qemu-system-x86_64", "qemu-system-x86"), ("busybox", "busybox-static"),
                             ("dpkg-deb", "dpkg")]:
        if not shutil.which(program):
            raise Skipped(f"{program} is missing: install the package {package}")
    started = time.monotonic()
    kernel, folder = kernel_of(arguments.cache)
    modules = find_modules(folder)
    modules = {name: modules[name] for name in in_order(MODULES, modules)}
    with tempfile.TemporaryDirectory() as temporary:
        make_initial_files(f"{temporary}/initrd", arguments, modules)
        terminal = f"{temporary}/probe"
        with subprocess.Popen([arguments.merkel, "simulate-probe", "hbf1", "--trace",
                               "tests/traces/taps.csv", "--repeat", "--baud", "460800",
                               "--link", terminal], stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL) as probe:
            while not os.path.exists(terminal):
                time.sleep(0.01)
            prepared = time.monotonic()
            machine = Machine(kernel, f"{temporary}/initrd", terminal)
            try:
                if machine.wait_for("@@replug the adapter", 120):
                    machine.monitor("device_del adapter")
                    time.sleep(1.0)
                    machine.monitor("device_add " + machine.adapter)
                    machine.wait_for("@@done", 400)
            finally:
                machine.process.kill()
                machine.process.wait()
                probe.terminate()
    if arguments.console or not machine.parts():
        print("\n".join(machine.lines))
    check_parts(machine.parts())
    print(f"kernel {os.path.basename(kernel)}: prepared in {prepared - started:.1f} s, examined in "
          f"{time.monotonic() - prepared:.1f} s")
    print(f"{len(FAILURES)} checks FAILED" if FAILURES else "all passed")
    return 1 if FAILURES else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Skipped as reason:
        print(f"skipped: {reason}")
        sys.exit(77)
