"""The score on the terminal, as trial.json and as one self-contained page with the confusion matrix."""

import json
from dataclasses import asdict
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, select_autoescape
from rich.console import Console
from rich.table import Table

from tools.trial.hidden import KINDS, STRANGERS
from tools.trial.judge import NOTHING, Judged
from tools.trial.score import Rate, Score

SHOWN_CONFUSIONS = 15


def print_score(result: Score, console: Console) -> None:
    """Three tables: rates, what each effect came to, the most frequent confusions."""
    table = Table("question", "answer", "95 % interval", "cases", "bar", title="Blind trial")
    for rate in [*result.rates, *result.bands]:
        low, high = rate.interval
        met = {None: "", True: "met", False: "missed"}[rate.is_met]
        table.add_row(
            rate.name, _percent(rate.share), f"{_percent(low)} - {_percent(high)}", str(rate.count),
            f"{bar(rate)} {met}",
        )  # fmt: skip
    console.print(table)
    table = Table("hidden", "named (outside: not claimed explained)", "cases", title="By effect")
    for rate in result.by_effect:
        if rate.count:
            table.add_row(rate.name, _percent(rate.share), str(rate.count))
    console.print(table)
    wrong = sorted(
        ((count, pair) for pair, count in result.confusion.items() if pair[0] != pair[1]), reverse=True
    )
    table = Table("hidden", "named first", "cases", title="Most frequent confusions")
    for count, (hidden, named) in wrong[:SHOWN_CONFUSIONS]:
        table.add_row(hidden, named, str(count))
    console.print(table)
    console.print(
        f"{result.recordings} recordings, {len(result.failed)} without a diagnosis; seconds each: median "
        f"{result.median_seconds:.1f}, longest {result.longest_seconds:.1f}; memory up to "
        f"{result.largest_memory_mb:.0f} MB"
    )


def write_json(path: Path, seed: int, digest: str, result: Score, judged: list[Judged]) -> None:
    """All figures and every judged recording."""
    content = {
        "schema": 1,
        "seed": seed,
        "answers_sha256": digest,
        "recordings": result.recordings,
        "failed": result.failed,
        "rates": [_plain(rate) for rate in [*result.rates, *result.bands]],
        "by_effect": [_plain(rate) for rate in result.by_effect if rate.count],
        "confusion": [
            {"hidden": hidden, "named_first": named, "count": count}
            for (hidden, named), count in sorted(result.confusion.items())
        ],
        "coefficients": {
            name: {"median_relative_error": error, "coverage": rate.share, "count": rate.count}
            for name, (error, rate) in result.errors.items()
        },
        "seconds": {"median": result.median_seconds, "longest": result.longest_seconds},
        "memory_mb": result.largest_memory_mb,
        "judged": [asdict(one) for one in judged],
    }
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def write_page(
    path: Path,
    seed: int,
    digest: str,
    result: Score,
    judged: list[Judged],
    usual: list[str],
    vehicles: list[str],
) -> None:
    """trial.html.

    usual      what every vehicle has beside what is hidden
    vehicles   the published ones that they are like; none in other trials
    """
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), autoescape=select_autoescape(default=True)
    )
    rows = [name for name in (NOTHING, *KINDS, *STRANGERS) if any(h == name for h, _ in result.confusion)]
    # Every name that was given, or a row would be short of some.
    never_hidden = {named for _, named in result.confusion} - {NOTHING, *KINDS}
    columns = [NOTHING, *KINDS, *sorted(never_hidden)]
    matrix = []
    for hidden in rows:
        counts = [result.confusion.get((hidden, named), 0) for named in columns]
        matrix.append((hidden, [(count, count / sum(counts)) for count in counts]))
    wrong = [j for j in judged if not _is_right(j)]
    page = environment.get_template("trial.html.j2").render(
        seed=seed,
        digest=digest,
        score=result,
        columns=columns,
        matrix=matrix,
        strangers=tuple(STRANGERS),
        usual=usual,
        vehicles=vehicles,
        bar=bar,
        percent=_percent,
        wrong=sorted(wrong, key=lambda j: -j.weakest_misfit),
    )
    path.write_text(page, encoding="utf-8")


def bar(rate: Rate) -> str:
    """What a rate must reach, in words."""
    if rate.least is not None and rate.most is not None:
        return f"{_percent(rate.least)} - {_percent(rate.most)}"
    if rate.least is not None:
        return f">= {_percent(rate.least)}"
    return f"<= {_percent(rate.most)}" if rate.most is not None else ""


def _is_right(judged: Judged) -> bool:
    return judged.admits if judged.case == "outside" else judged.is_exact and not judged.has_failed


def _percent(share: float) -> str:
    return "-" if share != share else f"{100 * share:.1f} %".replace(".0 %", " %")


def _plain(rate: Rate) -> dict[str, object]:
    low, high = rate.interval
    return {
        "name": rate.name,
        "share": rate.share if rate.count else None,
        "interval": [low, high],
        "hits": rate.hits,
        "count": rate.count,
        "least": rate.least,
        "most": rate.most,
        "is_met": rate.is_met,
    }
