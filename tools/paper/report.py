"""The whole reproduction, and its one HTML page."""

from dataclasses import dataclass
from os import cpu_count
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, select_autoescape

from host.version import program_version
from tools.paper import figures
from tools.paper.equivalence import Equality, comparison, equality
from tools.paper.errata import errata_table
from tools.paper.errata_values import constant_error
from tools.paper.lake import coefficients_table, lake, table8
from tools.paper.missing import DATA, PATTERNS, Study, missing_table, study
from tools.paper.printed import correct_truth, printed_estimates, relative_error
from tools.paper.reproduction import (
    assumed_amplitude,
    estimates_tables,
    reproduce,
    survival_table,
    table6,
)
from tools.paper.search import Search, search, search_table
from tools.paper.stages import Stage
from tools.paper.table import LINES, Table, write_tables

AMPLITUDES = {"alpha": (1e-3, 1e2), "beta": (1e-1, 1e3)}  # searched; rad, or whatever the paper used
RIGHTING_ARM = 0.03  # m, of the vehicle that Section 6's model does not describe


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How much is computed.

    amplitudes  tried in each search
    seeds       random records of the comparison of RLS and MILS
    trial       s, of the free run that Section 6 learns from
    shares      of missing samples, each on so many `records`
    """

    amplitudes: int
    seeds: int
    trial: float
    shares: tuple[float, ...]
    records: int


FULL = Effort(amplitudes=41, seeds=200, trial=200.0, shares=(0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6), records=4)
QUICK = Effort(amplitudes=17, seeds=20, trial=200.0, shares=(0.0, 0.3, 0.6), records=1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Reproduced:
    """What the page shows: tables and pictures (data URIs) by name, and the figures that its sentences "
    "quote."""

    tables: dict[str, Table]
    pictures: dict[str, str]
    facts: dict[str, Any]


def reproduce_paper(effort: Effort, stage: Stage) -> Reproduced:
    """Computes everything."""
    with stage("errata", 1):
        tables = [errata_table()]
    with stage("search of the input", 9) as step:
        searches = {
            name: search(name, np.geomspace(*span, effort.amplitudes), step)
            for name, span in AMPLITUDES.items()
        }
    with stage("Tables 2 to 6", 4) as step:
        result = reproduce(searches, step)
        tables += [search_table(searches), *estimates_tables(result), table6(result), survival_table(result)]
    with stage("RLS against MILS", effort.seeds) as step:
        same = equality()
        tables.append(comparison(effort.seeds, step))
    with stage("Section 6", 2) as step:
        trial = lake(duration=effort.trial)
        step()
        tables += [table8(trial, lake(RIGHTING_ARM, effort.trial)), coefficients_table(trial)]
    with stage("missing data", len(DATA) * len(PATTERNS) * effort.records) as step:
        lost = study(effort.shares, effort.records, step, workers=min(2, cpu_count() or 1))
        tables.append(missing_table(lost))
    with stage("figures", 1):
        pictures = {
            "search": figures.search_figure(searches),
            "rudder": figures.rudder_figure(result),
            "alpha": figures.estimates_figure(result.nearest["alpha"], "alpha"),
            "beta": figures.estimates_figure(result.nearest["beta"], "beta"),
            "pitch": figures.motion_figure(result, "alpha"),
            "depth": figures.motion_figure(result, "beta"),
            "equality": figures.equality_figure(same),
            "cleaning": figures.cleaning_figure(trial),
            "lake_parameters": figures.lake_parameters_figure(trial),
            "lake_flight": figures.lake_flight_figure(trial),
            "missing": figures.missing_figure(lost),
        }
    return Reproduced(
        tables={table.name: table for table in tables},
        pictures=pictures,
        facts=_facts(searches, same, lost),
    )


def _facts(searches: dict[str, list[Search]], same: Equality, lost: Study) -> dict[str, Any]:
    right = correct_truth().beta
    noisy = np.median(lost.parameters[2].mean(axis=0)[0], axis=-1)
    return {
        "constant_error": constant_error()[0],
        "by_length": {b.p: float(relative_error(b.values[-1], right)) for b in printed_estimates("beta")},
        "pitch": min(searches["alpha"], key=lambda one: one.distance),
        "pitch_by_sine": min(one.distance for one in searches["alpha"][:4]),
        "depth": min(searches["beta"], key=lambda one: one.distance),
        "assumed_deg": float(np.degrees(assumed_amplitude())),
        "equality": same,
        "most_apart": 100.0 * float(same.difference.max()),
        "noisy_car": float(noisy[:3].min()),
        "noisy_live": float(noisy[3]),
        "noisy_ml": float(noisy[4]),
    }


def write_report(effort: Effort, folder: Path, stage: Stage) -> Path:
    """Writes paper.html, a CSV for each table, and tables.json into `folder`; returns the page's path."""
    found = reproduce_paper(effort, stage)
    folder.mkdir(parents=True, exist_ok=True)
    write_tables(list(found.tables.values()), folder)
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=select_autoescape(["j2", "html"]),
        trim_blocks=True,
    )
    page = environment.get_template("paper.html.j2").render(
        tables=found.tables, pictures=found.pictures, version=program_version(), lines=LINES, **found.facts
    )
    path = folder / "paper.html"
    path.write_text(page, encoding="utf-8")
    return path
