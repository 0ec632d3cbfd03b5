"""The page: whole, self-contained, and with every table beside it."""

import json
import re
from contextlib import contextmanager

import pytest

from tools.paper.report import Effort, write_report
from tools.paper.stages import stages
from tools.paper.table import Table

TABLES = (
    "errata",
    "input_search",
    "tables_2_3",
    "tables_4_5",
    "table_6",
    "unguarded_update",
    "rls_against_mils",
    "table_8",
    "section_6_coefficients",
    "missing_data",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    @contextmanager
    def stage(_name, _steps):
        yield lambda: None

    folder = tmp_path_factory.mktemp("paper")
    write_report(Effort(amplitudes=3, seeds=2, trial=50.0, shares=(0.0,), records=1), folder, stage)
    return folder


def test_page_is_self_contained(folder):
    page = (folder / "paper.html").read_text(encoding="utf-8")
    assert page.count('src="data:image/png;base64,') == page.count("<img") >= 10
    assert not re.search(r'(src|href)="(?!data:|#)', page)
    assert "<script" not in page


def test_page_and_files_hold_all_tables(folder):
    page = (folder / "paper.html").read_text(encoding="utf-8")
    document = json.loads((folder / "tables.json").read_text(encoding="utf-8"))
    assert tuple(sorted(document)) == tuple(sorted(TABLES))
    for name in TABLES:
        assert f'id="{name}"' in page
        assert (folder / f"{name}.csv").read_text(encoding="utf-8").count("\n") >= len(document[name]["rows"])


def test_table_6_reproduces_its_own_printed_errors(folder):
    rows = json.loads((folder / "tables.json").read_text(encoding="utf-8"))["table_6"]["rows"]
    own = [row for row in rows if row["source"] == "printed in Table 6" and row["method"] != "RLS"]
    assert len(own) == 3
    for row in own:
        assert row["e against printed, %"] == pytest.approx(row["e printed, %"], abs=2e-3)


def test_table_refuses_rows_of_another_width():
    with pytest.raises(ValueError, match="2 cells for 1 columns"):
        Table(name="t", title="", columns=("a",), rows=[(1, 2)], formats=("",))


def test_table_shows_what_has_no_value():
    table = Table(
        name="t",
        title="",
        columns=("a", "b"),
        rows=[(float("nan"), float("inf")), (None, -2.0)],
        formats=(".1f",) * 2,
    )
    assert table.shown() == [["–", "overflow"], ["–", "−2.0"]]


def test_stages_say_one_line_each_on_a_pipe_and_nothing_when_quiet(capsys):
    for quiet, said in ((False, "errata\n"), (True, "")):
        with stages(quiet) as stage, stage("errata", 2) as step:
            step()
        assert capsys.readouterr().err == said
