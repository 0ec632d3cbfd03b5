"""Draws all recordings of a trial, writes them, and seals the answers."""

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

from tools.sitl.recording import write_csv
from tools.trial.answers import Answer, recording_name, seal
from tools.trial.deck import Card, deal
from tools.trial.draw import draw
from tools.trial.fleet import Fleet

RECORDINGS = "recordings"


def write_trial(
    folder: Path,
    seed: int,
    count: int,
    jobs: int,
    on_drawn: Callable[[], None],
    fleet: Fleet = "linear",
    is_logged: bool = False,
) -> str:
    """Writes `count` recordings of a seed and the sealed answers; gives the SHA-256 of the answers."""
    (folder / RECORDINGS).mkdir(parents=True, exist_ok=True)
    for stale in recordings(folder):
        stale.unlink()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the drawers inherit it
    answers = []
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        drawing = [
            pool.submit(_write_one, folder, seed, number, card, fleet, is_logged)
            for number, card in enumerate(deal(seed, count, fleet), start=1)
        ]
        for drawn in as_completed(drawing):
            answers.append(drawn.result())
            on_drawn()
    return seal(folder, seed, sorted(answers, key=lambda answer: answer.number))


def recordings(folder: Path) -> list[Path]:
    """The recordings of a trial, in order."""
    return sorted((folder / RECORDINGS).glob("*.csv"))


def _write_one(folder: Path, seed: int, number: int, card: Card, fleet: Fleet, is_logged: bool) -> Answer:
    drawn = draw(seed, number, card, fleet, is_logged)
    write_csv(folder / RECORDINGS / f"{recording_name(number)}.csv", drawn.table)
    return drawn.answer
