"""The import map of ARCHITECTURE.md, held by reading the code."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
OURS = {"firmware_model", "bridge", "host", "tools"}
MAY_IMPORT = {
    "firmware_model": set(),
    "bridge": set(),
    "host": {"firmware_model", "bridge"},
    "tools/sitl": set(),
    "tools/trial": set(),
    "tools/commands": OURS,
}
# The plant imports nothing else of ours, so that it cannot confirm our errors; nor does the blind trial, the
# answers of which must not come from what it judges.
OWN_FOLDERS = {
    "tools/sitl": ("tools.sitl.",),
    "tools/trial": ("tools.trial.", "tools.sitl."),
}
# The folders of ARCHITECTURE.md: each imports only from those above it.
FOLDERS = (
    "host",
    "host.live",
    "host.recordings",
    "host.compiled",
    "host.noise",
    "host.dynamics",
    "host.catalogue",
    "host.likelihood",
    "host.identification",
    "host.diagnosis.recordings",
    "host.diagnosis.fits",
    "host.diagnosis.search",
    "host.diagnosis.disturbances",
    "host.diagnosis.proof",
    "host.diagnosis",
    "host.diagnosis.against",
    "host.diagnosis.told",
)
# The vehicle file takes settings from where they are used; the answer holds a comparison.
UPWARD = {"host.vehicle", "host.diagnosis.answer"}


def imported_roots(path: Path) -> set[str]:
    roots = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            roots |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            roots.add((node.module or "").split(".")[0])
    return roots & OURS


@pytest.mark.parametrize("folder", sorted(MAY_IMPORT))
def test_package_imports_only_what_the_map_allows(folder: str) -> None:
    files = sorted((ROOT / folder).rglob("*.py"))
    assert files
    own = {folder} if "/" not in folder else set()
    for path in files:
        foreign = imported_roots(path) - own - MAY_IMPORT[folder]
        if folder in OWN_FOLDERS:
            foreign = {
                node.module
                for node in ast.walk(ast.parse(path.read_text()))
                if isinstance(node, ast.ImportFrom)
                and (node.module or "").split(".")[0] in OURS
                and not f"{node.module}.".startswith(OWN_FOLDERS[folder])
            }
        assert not foreign, f"{path} imports {foreign}"


def folder_of(module: str) -> str:
    return max((one for one in FOLDERS if f"{module}.".startswith(f"{one}.")), key=len)


@pytest.mark.parametrize("folder", FOLDERS)
def test_a_folder_of_host_imports_only_from_those_above_it(folder: str) -> None:
    above = FOLDERS[: FOLDERS.index(folder) + 1]
    for path in sorted((ROOT / folder.replace(".", "/")).glob("*.py")):
        if ".".join(path.relative_to(ROOT).with_suffix("").parts) in UPWARD:
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("host"):
                modules = {f"{node.module}.{alias.name}" for alias in node.names}
                assert {folder_of(module) for module in modules} <= set(above), f"{path}: from {node.module}"
