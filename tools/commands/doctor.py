"""`mils doctor`: what this machine has, what it lacks, and how to get it."""

import argparse
import importlib
import os
import shutil
import socket
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

from bridge.errors import BridgeError
from host.vehicle import Vehicle, read_vehicle

OLDEST_PYTHON = (3, 11)
CORE = {
    "numpy": "numpy",
    "pymavlink": "pymavlink",
    "serial": "pyserial",
    "can": "python-can",
    "msgpack": "msgpack",
    "cantools": "cantools",
}
"""Module to distribution, of the companion install; msgpack is python-can's multicast extra."""
BENCH = ("scipy", "casadi", "matplotlib", "jinja2", "rich")
_CAN_DEVICE = "280"  # ARPHRD_CAN in /sys/class/net/*/type
_MULTICAST_GROUP = "239.74.163.2"  # python-can's default


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One line; `text` says what was found or how to get it. Only what is needed makes the answer "no"."""

    name: str
    is_ok: bool
    text: str
    is_needed: bool = False


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "vehicle", metavar="VEHICLE.toml", type=Path, nargs="?", help="also check what it needs"
    )


def run(args: argparse.Namespace) -> int:
    """0 all that is needed is there, 1 something needed is missing. Raises ConfigError for a broken file."""
    is_lacking = False
    for check in _machine():
        is_lacking |= _tell(check)
    if args.vehicle is not None:
        for check in _vehicle(read_vehicle(args.vehicle), args.vehicle):
            is_lacking |= _tell(check)
    return 1 if is_lacking else 0


def _tell(check: Check) -> bool:
    """Prints a check; whether something needed is missing."""
    word = "ok" if check.is_ok else ("MISSING" if check.is_needed else "missing")
    print(f"{word:8s}{check.name:18s}{check.text}", flush=True)
    return check.is_needed and not check.is_ok


def _machine() -> Iterator[Check]:
    yield _python()
    for module, distribution in CORE.items():
        yield _dependency(module, distribution, "in the source folder: pip install .", is_needed=True)
    for module in BENCH:
        remedy = "for identify, simulate, predict; in the source folder: pip install '.[bench]'"
        yield _dependency(module, module, remedy, is_needed=False)
    yield _compiler()
    yield _serial_devices()
    yield _can_kernel()
    yield _can_devices()
    yield _can_interfaces()
    yield _multicast()
    yield _clock()


def _vehicle(vehicle: Vehicle, path: Path) -> Iterator[Check]:
    yield Check(name="vehicle file", is_ok=True, text=f"{path}: {vehicle.name}", is_needed=True)
    yield _link(vehicle)
    folder = vehicle.journal.folder
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    may_write = os.access(folder, os.W_OK)
    free = shutil.disk_usage(folder).free / 1e9
    text = (
        f"{vehicle.journal.folder}, {free:.1f} GB free" if may_write else f"{folder}: no right to write there"
    )
    yield Check(name="journal folder", is_ok=may_write, text=text, is_needed=True)
    if not (vehicle.mavlink.rudder or vehicle.link.url.startswith("can:")):
        text = (
            "[mavlink] rudder is empty: name the output channels of the stern plane, or nothing is identified"
        )
        yield Check(name="rudder", is_ok=False, text=text)


def _link(vehicle: Vehicle) -> Check:
    from bridge.open import open_source

    try:
        open_source(vehicle.link.url, vehicle.mavlink, vehicle.can).close()
    except BridgeError as error:
        return Check(name="link", is_ok=False, text=str(error), is_needed=True)
    return Check(name="link", is_ok=True, text=f"{vehicle.link.url} opens", is_needed=True)


def _python() -> Check:
    found = ".".join(map(str, sys.version_info[:3]))
    is_ok = sys.version_info[:2] >= OLDEST_PYTHON
    text = found if is_ok else f"{found}, but 3.11 or newer is needed: apt install python3 on Debian 12"
    return Check(name="python", is_ok=is_ok, text=text, is_needed=True)


def _dependency(module: str, distribution: str, remedy: str, is_needed: bool) -> Check:
    try:
        if is_needed:
            importlib.import_module(module)  # found and broken is missing too
        elif find_spec(module) is None:
            raise ImportError("not installed")
        found = version(distribution)
    except PackageNotFoundError:
        found = "version unknown"
    except Exception as error:
        # A broken installation may raise anything while it is imported.
        cause = str(error).splitlines()[0] if str(error) else type(error).__name__
        return Check(name=distribution, is_ok=False, text=f"{remedy} ({cause})", is_needed=is_needed)
    return Check(name=distribution, is_ok=True, text=found, is_needed=is_needed)


def _compiler() -> Check:
    found = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    return Check(name="C compiler", is_ok=found is not None, text=found or "for export-c: apt install gcc")


def _serial_devices() -> Check:
    if find_spec("serial") is None:
        return Check(name="serial devices", is_ok=False, text="pyserial is not installed")
    from serial.tools.list_ports import comports

    devices = [port.device for port in comports()]
    if not devices:
        return Check(name="serial devices", is_ok=False, text="none: plug the autopilot in, see `dmesg`")
    locked = [device for device in devices if not os.access(device, os.R_OK | os.W_OK)]
    if locked:
        text = f"no right to use {', '.join(locked)}: sudo usermod -aG dialout $USER, then log in again"
        return Check(name="serial devices", is_ok=False, text=text)
    return Check(name="serial devices", is_ok=True, text=", ".join(devices))


def _can_kernel() -> Check:
    name = "CAN in the kernel"
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except (OSError, AttributeError) as error:
        remedy = "sudo modprobe can_raw; in a container use can:udp_multicast or can:socketcand"
        return Check(name=name, is_ok=False, text=f"{remedy} ({error})")
    return Check(name=name, is_ok=True, text="can_raw")


def _can_devices() -> Check:
    types = Path("/sys/class/net").glob("*/type")
    devices = sorted(path.parent.name for path in types if path.read_text().strip() == _CAN_DEVICE)
    text = ", ".join(devices) or "none: sudo ip link set can0 up type can bitrate 500000"
    return Check(name="CAN devices", is_ok=bool(devices), text=text)


def _can_interfaces() -> Check:
    if find_spec("can") is None:
        return Check(name="CAN interfaces", is_ok=False, text="python-can is not installed")
    from can.interfaces import VALID_INTERFACES

    ours = ("socketcan", "slcan", "socketcand", "udp_multicast", "virtual")
    others = len(set(VALID_INTERFACES) - set(ours))
    found = [name for name in ours if name in VALID_INTERFACES]
    return Check(
        name="CAN interfaces", is_ok=True, text=f"{', '.join(found)} and {others} others of python-can"
    )


def _multicast() -> Check:
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            membership = socket.inet_aton(_MULTICAST_GROUP) + socket.inet_aton("0.0.0.0")
            probe.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
    except OSError as error:
        remedy = "for can:udp_multicast: sudo ip route add 239.0.0.0/8 dev eth0"
        return Check(name="multicast", is_ok=False, text=f"{remedy} ({error.strerror})")
    return Check(name="multicast", is_ok=True, text=_MULTICAST_GROUP)


def _clock() -> Check:
    """A Pi without a battery starts long before this file was installed."""
    now = time.time()
    found = time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime(now))
    is_ok = now >= Path(__file__).stat().st_mtime - 86400
    remedy = f"{found} is before the installation, journals would be misdated: sudo timedatectl set-ntp true"
    return Check(name="clock", is_ok=is_ok, text=found if is_ok else remedy)
