"""Physics that no entry of the catalogue is must not pass for some of its entries."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hidden_dive import BASE, hidden_dive

from host.catalogue import BY_NAME, UNKNOWN, named, structure_of
from host.catalogue.unknown import AS_OF_PLANE, FORMS, IN_LAYERS, LAYERED_DEGREE, over_depth
from host.diagnosis.answer import Answer
from host.diagnosis.diagnose import diagnose
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.prospects import form_gains, gain
from host.diagnosis.fits.setting import DIVE
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search import beam
from host.diagnosis.search.lone_form import likely_forms, lone_form
from host.diagnosis.search.search import Search
from host.diagnosis.search.unknown_physics import unknown_in
from host.diagnosis.told.files import write_extended_model
from host.diagnosis.told.report import summary
from host.dynamics.equations import Effect
from host.identification.model import read_model
from host.identification.predict import predict
from host.vehicle import vehicle_from_table


@pytest.mark.long
def test_drag_on_one_side_of_the_keel_is_none_of_the_catalogue() -> None:
    """Quadratic drag with a current and a buoyancy that cancel would follow it nearly to the noise."""

    def keel(_: float, x: np.ndarray, __: float) -> tuple[float, float, float]:  # type: ignore[type-arg]
        return (-3.0 * x[0] ** 2 if x[0] > 0.0 else 0.0), 0.0, 0.0

    found = diagnose([hidden_dive(keel, duration=100.0)])
    assert found.verdict in ("partly_explained", "unexplained")
    assert "unknown_force_w_w" in found.extended.names
    assert {effect.name for effect in found.effects} <= {"heave_quadratic_drag"}
    assert "catalogue does not hold" in found.remaining
    assert found.slots["heave"] == max(found.slots.values())


@pytest.mark.long
def test_a_mass_that_turns_is_unexplained_and_described(tmp_path: Path) -> None:
    def turning(time: float, _: np.ndarray, __: float) -> tuple[float, float, float]:  # type: ignore[type-arg]
        return 0.0, 0.08 * np.sin(2.0 * np.pi * time / 11.0), 0.0

    dive = hidden_dive(turning, duration=100.0)
    stages: list[str] = []
    found = diagnose([dive], stages.append)
    assert found.verdict == "unexplained"
    assert not found.effects
    # One form leaves so little that nothing larger need be tried.
    assert "one form of unknown physics" in stages
    assert "what every vehicle has, led by the measurements" not in stages
    values = dict(zip(found.extended.fit.structure.names, found.extended.fit.parameters, strict=True))
    assert values["swing_period"] == pytest.approx(11.0, rel=0.01)
    assert np.hypot(values["swing_sine"], values["swing_cosine"]) == pytest.approx(0.08, rel=0.05)
    assert "swings with a period" in found.remaining
    assert "swing_period = 11 s" in found.remaining
    assert "only the form is known" in summary(Answer(found=found))
    # The model that is handed back includes it, and says so by name.
    path = tmp_path / "extended_model.json"
    write_extended_model(found, vehicle_from_table({"name": "auv", "speed": 2.5}, file="auv"), path)
    model = read_model(path)
    assert [effect["name"] for effect in model.effects] == ["unknown_swinging_moment"]
    assert predict(model, dive).score.depth_rmse_m < 0.05


def layer(_: float, x: np.ndarray, __: float) -> tuple[float, float, float]:  # type: ignore[type-arg]
    return 0.15 / np.cosh((x[3] - 24.0) / 3.0) ** 2, 0.0, 0.0


def test_water_in_layers_shows_as_a_force_that_goes_with_the_depth() -> None:
    fitter = Fitter([hidden_dive(layer, duration=100.0)])
    gains = form_gains(fitter, fitter.root)
    assert max(gains, key=lambda name: gains[name]) == "unknown_force_in_layers"
    found = fitter.grown(fitter.root, "unknown_force_in_layers", [])
    assert fitter.excess(found.fit) < 1.5
    assert fitter.free_parameters(found.names) - fitter.free_parameters(fitter.root.names) == LAYERED_DEGREE


def test_a_form_in_layers_is_told_by_its_depths() -> None:
    fitter = Fitter([hidden_dive(layer, duration=100.0)])
    found = fitter.polished(fitter.grown(fitter.root, "unknown_force_in_layers", []))
    values = dict(zip(found.fit.structure.names, found.fit.parameters.tolist(), strict=True))
    depths, sizes = over_depth("unknown_force_in_layers", values)
    true = 0.15 / np.cosh((depths - 24.0) / 3.0) ** 2
    inside = (depths > 20.0) & (depths < 29.0)
    assert np.std((sizes - true)[inside]) < 0.1 * np.std(true[inside])
    (told,) = unknown_in(found)
    assert re.search(r"to 0\.\d+ at 2[345]\.?\d* m, changing most at \d", told)


def test_a_vehicle_that_hardly_dives_is_not_asked_for_layers() -> None:
    dive = hidden_dive(duration=30.0)
    level = replace(dive, depth=20.0 + (dive.depth - 20.0) * DIVE / np.ptp(dive.depth) * 0.9)
    assert {form.name for form in {*FORMS} - {*Fitter([level]).forms}} == IN_LAYERS
    deeper = replace(dive, depth=20.0 + (dive.depth - 20.0) * DIVE / np.ptp(dive.depth) * 1.1)
    assert Fitter([deeper]).forms == FORMS


@pytest.mark.long
def test_a_layer_is_none_of_the_catalogue_and_is_described() -> None:
    found = diagnose([hidden_dive(layer, duration=100.0)])
    assert found.verdict in ("partly_explained", "unexplained")
    assert "unknown_force_in_layers" in found.extended.names
    assert "goes with the depth" in found.remaining
    assert {effect.name for effect in found.effects} <= {"vertical_current", "net_buoyancy"}  # its mean


def test_what_forms_promise_is_foretold_together_as_one_by_one() -> None:
    fitter = Fitter([hidden_dive(duration=40.0)])
    parent = fitter.grown(fitter.base, "unknown_force_w_delta", [])
    together = form_gains(fitter, parent)
    assert "unknown_force_w_delta" not in together
    charge = np.log(parent.fit.samples)
    for name in ("unknown_plane_q_delta", "unknown_plane_abs_delta", "unknown_moment_w_delta"):
        alone = gain(fitter, parent, name, [], is_thorough=True)
        assert together[name] == pytest.approx(alone - charge, abs=1e-3)


def test_the_likeliest_forms_bring_that_of_the_plane_with_them() -> None:
    gains = {"unknown_force_w_w": 40.0, "unknown_moment_w_delta": 90.0, "unknown_plane_w_delta": 70.0}
    most, of_plane, least = "unknown_moment_w_delta", "unknown_plane_w_delta", "unknown_force_w_w"
    assert likely_forms(gains, least=6.0, count=1) == [most, of_plane]
    assert likely_forms(gains, least=6.0, count=3) == [most, of_plane, least]
    assert likely_forms(gains, least=80.0, count=3) == [most, of_plane]
    assert likely_forms({most: 90.0}, least=80.0) == [most]
    assert likely_forms(gains, least=100.0) == []


def test_a_form_that_hardly_betters_what_is_known_is_no_lone_one() -> None:
    def drag(_: float, x: np.ndarray, __: float) -> tuple[float, float, float]:  # type: ignore[type-arg]
        return -3.0 * abs(x[0]) * x[0], 0.0, 0.0

    fitter = Fitter([hidden_dive(drag, duration=60.0)])
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        drag_alone = search.remember(fitter.grown(fitter.root, "heave_quadratic_drag", []))
        assert fitter.excess(fitter.root.fit) > 1.15 > fitter.excess(drag_alone.fit)
        assert lone_form(search, drag_alone) is None
        assert not any(names & UNKNOWN.keys() for names in search.tried)


def test_a_form_that_was_fitted_at_the_outset_is_known_though_a_step_promises_little(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fitter = Fitter([hidden_dive(duration=20.0)])
    root = fitter.root
    swinging = replace(root, names=root.names | {"unknown_swinging_moment"}, bic=root.bic - 100.0)
    changed = replace(root, names=root.names | {"ballast_change"}, bic=root.bic - 200.0)
    fitter.at_first |= {one.names: one for one in (swinging, changed)}
    monkeypatch.setattr("host.diagnosis.search.lone_form.form_gains", lambda *_: {})
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, root)
        assert lone_form(search, root) is swinging  # of the catalogue nothing is asked here


def test_what_wanders_with_time_gives_way_to_what_every_vehicle_has(monkeypatch: pytest.MonkeyPatch) -> None:
    fitter = Fitter([hidden_dive(duration=20.0)])
    search = Search(fitter, Workers(fitter, 1), lambda _: None, fitter.base, fitter.root)
    wandering = replace(fitter.root, names=fitter.root.names | {"unknown_wandering_moment"})
    for joint, gives_way in ((wandering.bic - 1.0, True), (wandering.bic + 1.0, False), (None, False)):
        found = None if joint is None else replace(fitter.root, bic=joint)
        monkeypatch.setattr(beam, "together", lambda *_, found=found: found)
        assert beam._is_only_flexible(search, wandering, fitter.root, fitter.root) == gives_way


@pytest.mark.long
def test_a_plane_that_bites_better_to_one_side_is_told_by_its_force_and_moment_together() -> None:
    def one_sided(_: float, __: np.ndarray, plane: float) -> tuple[float, float, float]:  # type: ignore[type-arg]
        beyond = 0.2 * abs(plane)
        return BASE["b1"] * beyond, BASE["b2"] * beyond, 0.0

    found = diagnose([hidden_dive(one_sided, duration=100.0)])
    assert found.verdict == "unexplained"
    assert "unknown_plane_abs_delta" in found.extended.names
    assert found.slots["actuator"] > 0.9


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
def test_forms_are_described_and_are_no_entries(form: Effect) -> None:
    assert form.name not in BY_NAME
    assert named(form.name) is form is UNKNOWN[form.name]
    assert form.sentence.endswith(".")
    assert form.equation.startswith(("w' =", "q' =", "zeta' ="))


def test_what_acts_at_the_plane_in_one_equation_has_a_form_in_both() -> None:
    assert {*AS_OF_PLANE, *AS_OF_PLANE.values()} <= UNKNOWN.keys()
    with_plane = [form for form in FORMS if "delta" in form.name and form.slot != "actuator"]
    assert {form.name for form in with_plane} == {*AS_OF_PLANE}


def test_all_forms_together_have_names_of_their_own() -> None:
    names = structure_of(tuple(UNKNOWN)).names
    assert len(set(names)) == len(names)


DRY = {"unknown_force_by_direction": 0, "unknown_moment_by_direction": 1}


@pytest.mark.parametrize(("form", "way"), DRY.items())
def test_what_goes_with_a_direction_alone_is_told_by_its_size(form: str, way: int) -> None:
    sizes = (-0.05, -0.3)  # m/s^2 and rad/s^2, against the motion

    def dry(_: float, x: np.ndarray, __: float) -> tuple[float, float, float]:  # type: ignore[type-arg]
        friction = sizes[way] * np.tanh(x[way] / 0.01)
        return friction * (way == 0), friction * (way == 1), 0.0

    fitter = Fitter([hidden_dive(dry, duration=60.0)])
    assert fitter.excess(fitter.root.fit) > 1.5
    found = fitter.polished(fitter.grown(fitter.root, form, []))
    size = UNKNOWN[form].parameters[0].name
    assert fitter.excess(found.fit) < 1.15
    assert found.fit.parameters[found.fit.structure.names.index(size)] == pytest.approx(sizes[way], rel=0.15)
