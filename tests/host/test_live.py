"""The live loop on a scripted source: what comes in is recorded, learnt, published and kept."""

import dataclasses
import json
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from bridge.errors import LinkClosed
from bridge.measurement import Measurement, Quantity
from host.live.journal import Journal, JournalReading, read_journal
from host.live.loop import LiveLoop, Progress
from host.live.state import save_state
from host.vehicle import Vehicle, effective_table, vehicle_from_table

H = 0.1
U0 = 2.5
TABLE_1 = {"a1": -0.63084, "a2": -3.38699, "a3": -8.19858, "b1": 0.41385, "b2": -3.94120}


def rudder_at(k: int) -> float:
    """Steps of 0.2 rad that a 1.7 s and a 4.1 s switch make irregular."""
    return 0.2 * (1 if (k // 17) % 2 else -1) + 0.1 * (1 if (k // 41) % 2 else -1)


def dive(steps: int, start_us: int = 5_000_000, boot: int = 0) -> list[Measurement]:
    """Noise-free depth, pitch and rudder of the paper's vehicle, stepped by Euler as in its CAR model."""
    w = q = theta = 0.0
    zeta = 10.0
    out = []
    for k in range(steps):
        delta = rudder_at(k)
        for quantity, value in ((Quantity.PITCH, theta), (Quantity.DEPTH, zeta), (Quantity.RUDDER, delta)):
            t_us = start_us + k * 100_000
            out.append(Measurement(quantity=quantity, value=value, t_us=t_us, source="test", boot=boot))
        w, q, theta, zeta = (
            w + H * (TABLE_1["a1"] * w + TABLE_1["b1"] * delta),
            q + H * (TABLE_1["a2"] * q + TABLE_1["a3"] * theta + TABLE_1["b2"] * delta),
            theta + H * q,
            zeta + H * (w - U0 * theta),
        )
    return out


class Script:
    """A source that gives the items of a script one read each, and lets 0.1 s pass with each.

    An exception in the script is raised. At its end the link closes.
    """

    def __init__(self, time: list[float], script: list[Any]) -> None:
        self.time = time
        self.script = script
        self.counts: Counter[str] = Counter()
        self.notes: list[str] = ["depth_source auto chose SCALED_PRESSURE2"]
        self.published: list[tuple[int, dict[str, float]]] = []
        self.warned: list[tuple[int, str, dict[str, float]]] = []

    def read(self, timeout_s: float) -> list[Measurement]:
        self.time[0] += timeout_s
        if not self.script:
            raise LinkClosed("the log has ended")
        item = self.script.pop(0)
        if isinstance(item, BaseException):
            raise item
        batch: list[Measurement] = item
        return batch

    def publish(self, t_us: int, values: Mapping[str, float]) -> None:
        self.published.append((t_us, dict(values)))

    def warn(self, t_us: int, notice: str, values: Mapping[str, float]) -> None:
        self.warned.append((t_us, notice, dict(values)))

    def close(self) -> None:
        pass


def one_instant_a_read(measurements: list[Measurement]) -> list[Any]:
    return [measurements[i : i + 3] for i in range(0, len(measurements), 3)]


class Run:
    """One run of the loop; `path` of its journal, what was said, and its end."""

    def __init__(
        self,
        folder: Path,
        script: list[Any],
        *,
        later: list[list[Any]] | None = None,
        duration: float | None = None,
        watch: Callable[[LiveLoop, Progress], None] = lambda loop, progress: None,  # noqa: ARG005
        **tables: Any,
    ) -> None:
        self.time = [1000.0]
        self.said: list[str] = []
        self.progress: list[Progress] = []
        self.sources = [Script(self.time, script)]
        self.vehicle = self.configured(folder, tables)
        scripts = list(later or [])

        def reopen() -> Script:
            self.sources.append(Script(self.time, scripts.pop(0)))
            return self.sources[-1]

        def sleep(seconds: float) -> None:
            self.time[0] += seconds

        def on_progress(progress: Progress) -> None:
            self.progress.append(progress)
            watch(self.loop, progress)

        journal = Journal(
            folder,
            vehicle=self.vehicle.name,
            configuration=effective_table(self.vehicle),
            wall_s=lambda: 1.7e9,
            warn=self.said.append,
        )
        self.path = journal.path
        self.loop = LiveLoop(
            self.sources[0],
            self.vehicle,
            journal,
            reopen=reopen,
            clock=lambda: self.time[0],
            sleep=sleep,
            say=self.said.append,
            on_progress=on_progress,
        )
        self.duration = duration

    def run(self) -> Progress:
        return self.loop.run(self.duration)

    @property
    def journal(self) -> JournalReading:
        return read_journal(self.path)

    @staticmethod
    def configured(folder: Path, tables: dict[str, Any]) -> Vehicle:
        table = {
            "name": "table1",
            "speed": U0,
            "link": {"url": "log:script"},
            "journal": {"folder": str(folder)},
            "estimator": {"method": "mils"},
        }
        return vehicle_from_table(table | tables, file="test")


LIVE = {"url": "udp:0", "reopen_for": 20.0}


def test_the_paper_s_vehicle_is_recovered_recorded_and_published(tmp_path: Path) -> None:
    sent = dive(1500)
    run = Run(tmp_path, one_instant_a_read(sent))
    end = run.run()
    for name, value in TABLE_1.items():
        assert end.estimate.values[name] == pytest.approx(value, rel=1e-3), name
    assert end.estimate.u0 == U0
    assert all(end.estimate.valid.values())
    assert list(run.journal.measurements) == sent
    published = run.sources[0].published
    times = [t_us for t_us, _ in published]
    assert times == [5_000_000 + k * 1_000_000 for k in range(150)]
    assert published[-1][1]["a2"] == pytest.approx(TABLE_1["a2"], rel=1e-3)
    assert published[-1][1]["valid"] == 63.0
    assert {"a1", "a1_std", "b2", "b2_std", "u0", "u0_std", "status", "valid"} <= published[-1][1].keys()
    assert all(len(name) <= 10 for _, values in published for name in values)
    assert [(e["t_us"], e["estimate"]) for e in run.journal.estimates] == published
    assert end.samples.total() == 1500
    assert end.measurements == {Quantity.PITCH: 1500, Quantity.DEPTH: 1500, Quantity.RUDDER: 1500}
    assert end.refused == {}
    assert end.never_heard == ()
    assert end.cause == "the log has ended"
    assert not run.loop.has_lost_link


def test_what_is_not_known_is_not_published(tmp_path: Path) -> None:
    run = Run(tmp_path, one_instant_a_read(dive(10)))
    run.run()
    assert run.sources[0].published[0][1].keys() == {"u0", "u0_std", "status", "valid"}


def test_nothing_goes_out_when_publishing_is_off(tmp_path: Path) -> None:
    run = Run(tmp_path, one_instant_a_read(dive(100)), publish={"enabled": False, "period": 0.5})
    run.run()
    assert run.sources[0].published == []
    assert len(run.journal.estimates) == 20


def test_every_refusal_is_counted_by_who_refused(tmp_path: Path) -> None:
    sent = dive(300)
    spike = dataclasses.replace(sent[603], value=3.0)
    script = one_instant_a_read([*sent[:603], spike, *sent[604:]])
    script.insert(10, sent[30:33])
    script.insert(20, sent[33:36])
    run = Run(tmp_path, script)
    run.sources[0].counts["refused.crc"] = 4
    run.sources[0].counts["ATTITUDE"] = 300
    end = run.run()
    assert end.refused == {
        "link.refused.crc": 4,
        "alignment.refused.duplicate": 3,
        "alignment.refused.backwards": 3,
        "estimator.outlier": 1,
    }
    assert len(run.journal.measurements) == 906


def test_nothing_is_joined_across_a_restart_of_the_vehicle(tmp_path: Path) -> None:
    sent = dive(600) + dive(600, start_us=0, boot=1)
    run = Run(tmp_path, one_instant_a_read(sent))
    end = run.run()
    # Four instants fill the rows, once in each boot; those of the second start from other states.
    assert end.samples["WAITING"] >= 4
    assert end.estimate.values["a1"] == pytest.approx(TABLE_1["a1"], rel=1e-3)
    assert [e["detail"] for e in run.journal.events if e["event"] == "segment"] == [
        "a new stretch of time begins at 0.0 s: the vehicle or the link restarted"
    ]
    assert list(run.journal.measurements) == sent


def test_a_lost_link_is_reopened_and_learning_goes_on(tmp_path: Path) -> None:
    first, second = dive(300), dive(900, start_us=60_000_000)
    run = Run(
        tmp_path,
        [*one_instant_a_read(first), LinkClosed("unplugged")],
        later=[one_instant_a_read(second)],
        link=LIVE,
        duration=120.0,
    )
    end = run.run()
    assert end.estimate.values["b2"] == pytest.approx(TABLE_1["b2"], rel=1e-3)
    assert {m.boot for m in run.journal.measurements} == {0, 1}
    assert sum("link lost (unplugged)" in sentence for sentence in run.said) == 1
    assert "measurements come again after 0.6 s" in run.said
    assert len(run.sources[1].published) >= 89


def test_a_link_that_never_comes_back_ends_the_run_with_all_kept(tmp_path: Path) -> None:
    run = Run(tmp_path, one_instant_a_read(dive(50)), link=LIVE | {"reopen_for": 0.0})
    end = run.run()
    assert run.loop.has_lost_link
    assert end.cause == "the log has ended"
    assert end.samples.total() == 50


def test_a_missing_quantity_is_said_once(tmp_path: Path) -> None:
    sent = [m for m in dive(200) if m.quantity is not Quantity.RUDDER]
    run = Run(tmp_path, [sent[i : i + 2] for i in range(0, len(sent), 2)])
    end = run.run()
    assert [sentence for sentence in run.said if sentence.startswith("no ")] == ["no rudder for 5 s"]
    assert end.never_heard == (Quantity.RUDDER,)
    assert end.samples == {"WAITING": 200}


def test_what_the_source_decided_is_said_once(tmp_path: Path) -> None:
    run = Run(tmp_path, one_instant_a_read(dive(50)))
    run.run()
    assert run.said.count("depth_source auto chose SCALED_PRESSURE2") == 1
    assert {"event": "source", "detail": run.sources[0].notes[0], "wall_s": 1.7e9} in run.journal.events


def test_it_stops_when_told_and_keeps_what_was_under_way(tmp_path: Path) -> None:
    run = Run(
        tmp_path,
        one_instant_a_read(dive(1000)),
        watch=lambda loop, progress: loop.stop("stopped by SIGTERM") if progress.seconds > 9.9 else None,
    )
    end = run.run()
    assert end.cause == "stopped by SIGTERM"
    assert end.seconds == pytest.approx(10.0, abs=1.0)
    assert end.samples.total() * 3 == len(run.journal.measurements)
    assert run.journal.events[-1] == {"event": "end", "detail": "stopped by SIGTERM", "wall_s": 1.7e9}
    assert run.vehicle.state_file.exists()
    seconds = [progress.seconds for progress in run.progress]
    assert seconds == pytest.approx([*range(1, len(seconds) + 1)], abs=0.2)


def test_it_stops_when_its_time_is_over(tmp_path: Path) -> None:
    end = Run(tmp_path, one_instant_a_read(dive(1000)), duration=5.0).run()
    assert end.cause == "5 s are over"
    assert end.seconds == pytest.approx(5.0, abs=0.11)


def test_an_interrupt_in_the_middle_loses_nothing(tmp_path: Path) -> None:
    script = one_instant_a_read(dive(100))
    run = Run(tmp_path, [*script[:80], KeyboardInterrupt(), *script[80:]])
    with pytest.raises(KeyboardInterrupt):
        run.run()
    assert len(run.journal.measurements) == 240
    assert run.vehicle.state_file.exists()


def test_what_was_learnt_is_there_at_the_next_start(tmp_path: Path) -> None:
    first = Run(tmp_path, one_instant_a_read(dive(1000))).run()
    second = Run(tmp_path, one_instant_a_read(dive(3)))
    end = second.run()
    assert end.estimate.values["a3"] == first.estimate.values["a3"]
    assert any("state restored" in sentence for sentence in second.said)


def test_a_run_that_learns_nothing_leaves_the_state_alone(tmp_path: Path) -> None:
    run = Run(tmp_path, one_instant_a_read(dive(3)))
    run.run()
    assert not run.vehicle.state_file.exists()


def test_a_state_of_another_configuration_is_kept_aside_and_said(tmp_path: Path) -> None:
    Run(tmp_path, one_instant_a_read(dive(300))).run()
    run = Run(tmp_path, one_instant_a_read(dive(3)), mavlink={"water_density": 998.0})
    end = run.run()
    assert end.estimate.updates == 0
    assert any("another configuration" in sentence and "starting fresh" in sentence for sentence in run.said)
    assert (tmp_path / "table1.state.refused1.json").exists()


def test_a_state_that_the_estimator_refuses_is_kept_aside(tmp_path: Path) -> None:
    run = Run(tmp_path, one_instant_a_read(dive(3)))
    vehicle = run.vehicle
    save_state(vehicle.state_file, {"schema": 0}, vehicle=vehicle.name, configuration=vehicle.meaning)
    assert run.run().estimate.updates == 0
    assert any("does not fit" in sentence for sentence in run.said)
    assert (tmp_path / "table1.state.refused1.json").exists()


def test_a_state_that_cannot_be_saved_is_said_once(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    state = {"file": str(tmp_path / "file" / "state.json"), "period": 1.0}
    run = Run(tmp_path, one_instant_a_read(dive(200)), state=state)
    run.run()
    assert sum("state cannot be saved" in sentence for sentence in run.said) == 1


def test_without_state_none_is_read_or_written(tmp_path: Path) -> None:
    run = Run(tmp_path, one_instant_a_read(dive(300)), state={"enabled": False})
    run.run()
    assert not run.vehicle.state_file.exists()


def test_the_state_is_saved_and_the_journal_synced_on_the_way(tmp_path: Path) -> None:
    seen: list[int] = []

    def watch(loop: LiveLoop, progress: Progress) -> None:  # noqa: ARG001
        if run.vehicle.state_file.exists():
            seen.append(json.loads(run.vehicle.state_file.read_text())["body"]["updates"])

    run = Run(tmp_path, one_instant_a_read(dive(600)), watch=watch, state={"period": 5.0})
    run.run()
    assert len(set(seen)) >= 10


def test_the_noise_proof_estimator_is_what_runs_by_default(tmp_path: Path) -> None:
    run = Run(tmp_path, one_instant_a_read(dive(600)), estimator={})
    end = run.run()
    assert run.vehicle.estimator.method == "robust"
    assert end.samples == {"WAITING": 4, "UPDATED": 596}  # four values say where the vehicle is
    published = run.sources[0].published[-1][1]
    # Euler's steps are not those of a held plane: a third is all that can be asked of these data.
    assert published["a3"] == pytest.approx(TABLE_1["a3"], rel=0.3)
    assert published["u0"] == pytest.approx(U0, rel=0.1)
    assert published["u0_std"] > 0.0


def test_a_state_of_the_other_method_is_kept_aside_and_said(tmp_path: Path) -> None:
    Run(tmp_path, one_instant_a_read(dive(300))).run()
    run = Run(tmp_path, one_instant_a_read(dive(3)), estimator={"method": "robust"})
    assert run.run().estimate.updates <= 3
    assert any("another configuration" in sentence for sentence in run.said)
