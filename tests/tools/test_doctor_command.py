"""`mils doctor`: every check once found and once missing."""

import argparse
import os
import socket
from pathlib import Path
from typing import Any

import pytest

from host.errors import ConfigError
from tools.commands import doctor


def diagnose(vehicle: Path | None = None) -> int:
    return doctor.run(argparse.Namespace(vehicle=vehicle))


def line_of(output: str, name: str) -> str:
    return next(line for line in output.splitlines() if line[8:].startswith(name))


def test_this_machine_can_run_the_program(capsys: pytest.CaptureFixture[str]) -> None:
    assert diagnose() == 0
    output = capsys.readouterr().out
    for name in ("python", "numpy", "pymavlink", "pyserial", "python-can", "msgpack", "cantools", "clock"):
        assert line_of(output, name).startswith("ok"), name
    for name in ("scipy", "C compiler", "serial devices", "CAN in the kernel", "CAN devices", "multicast"):
        assert line_of(output, name).split()[0] in ("ok", "missing"), name


def test_a_missing_dependency_is_an_answer_of_no(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(doctor.CORE, "no_such_module", "no-such-module")
    assert diagnose() == 1
    assert "pip install ." in line_of(capsys.readouterr().out, "no-such-module")


def test_missing_extras_devices_and_compiler_do_no_harm(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_can(*_: Any) -> None:
        raise OSError(97, "Address family not supported by protocol")

    monkeypatch.setattr(doctor, "BENCH", ("no_such_module",))
    monkeypatch.setattr("tools.commands.doctor.shutil.which", lambda _: None)
    monkeypatch.setattr("serial.tools.list_ports.comports", list)
    monkeypatch.setattr("tools.commands.doctor.socket.socket", no_can)
    assert diagnose() == 0
    output = capsys.readouterr().out
    for name, remedy in [
        ("no_such_module", "pip install '.[bench]'"),
        ("C compiler", "apt install gcc"),
        ("serial devices", "plug the autopilot in"),
        ("CAN in the kernel", "modprobe can_raw"),
        ("multicast", "ip route add"),
    ]:
        line = line_of(output, name)
        assert line.startswith("missing")
        assert remedy in line


def test_an_old_python_a_locked_device_and_a_clock_of_1970_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    class Port:
        device = "/dev/ttyACM0"

    monkeypatch.setattr(doctor, "OLDEST_PYTHON", (99, 0))
    assert not doctor._python().is_ok
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [Port()])
    monkeypatch.setattr("tools.commands.doctor.os.access", lambda *_: False)
    assert "dialout" in doctor._serial_devices().text
    monkeypatch.setattr("tools.commands.doctor.os.access", lambda *_: True)
    assert doctor._serial_devices().text == "/dev/ttyACM0"
    monkeypatch.setattr("tools.commands.doctor.time.time", lambda: 1000.0)
    assert "1970-01-01" in doctor._clock().text
    assert not doctor._clock().is_ok


def vehicle_file(folder: Path, text: str) -> Path:
    path = folder / "vehicle.toml"
    path.write_text(f'name = "x"\nspeed = 1.0\n{text}')
    return path


def test_a_vehicle_whose_link_opens_is_fine(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = '[link]\nurl = "udp:127.0.0.1:0"\n[journal]\nfolder = "new/folder"'
    assert diagnose(vehicle_file(tmp_path, text)) == 0
    output = capsys.readouterr().out
    assert line_of(output, "link").startswith("ok")
    assert "GB free" in line_of(output, "journal folder")
    assert "[mavlink] rudder is empty" in line_of(output, "rudder")
    assert not (tmp_path / "new").exists()


def test_a_vehicle_whose_link_does_not_open_is_told_why(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        url = f"udp:127.0.0.1:{taken.getsockname()[1]}"
        assert diagnose(vehicle_file(tmp_path, f'[link]\nurl = "{url}"')) == 1
    assert line_of(capsys.readouterr().out, "link").startswith(f"MISSING link              {url}")


def test_a_journal_folder_without_the_right_to_write_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tools.commands.doctor.os.access", lambda path, mode: mode != os.W_OK)  # noqa: ARG005
    text = '[link]\nurl = "udp:127.0.0.1:0"\n[journal]\nfolder = "new"'
    assert diagnose(vehicle_file(tmp_path, text)) == 1
    assert "no right to write" in line_of(capsys.readouterr().out, "journal folder")


def test_a_broken_vehicle_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="colour is not a known key"):
        diagnose(vehicle_file(tmp_path, "colour = 1"))
