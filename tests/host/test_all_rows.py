import casadi as ca
import numpy as np
import pytest

from host.compiled.all_rows import MOST_ROWS, AllRows


def test_every_operation_equals_casadi_s() -> None:
    x, p = ca.SX.sym("x", 2), ca.SX.sym("p", 2)
    a, b, c, d = x[0], x[1], p[0], p[1]
    results = [a + b, a - b, a * c, b / a, -a, a**2, ca.sqrt(ca.fabs(b)), 2 * b, 1 / a, ca.exp(b)]
    results += [ca.log(ca.fabs(a)), ca.fabs(a) ** c, ca.fabs(a) ** 2.5, ca.sin(a), ca.cos(b), ca.tan(b)]
    results += [ca.tanh(a), ca.sign(b), ca.fmin(a, b), ca.fmax(a, c), a < b, a <= b, ca.eq(a, a), ca.ne(a, b)]
    results += [ca.logic_not(a < b), ca.logic_and(a < b, b < c), ca.logic_or(a < b, b < c), c * d]
    results += [ca.if_else(a < b, a, c), ca.SX(3.0)]
    function = ca.Function("all", [x, p], [ca.vertcat(*results)])
    rows, parameters = np.random.default_rng(1).normal(size=(2, 50)), np.array([0.7, -1.3])
    expected = np.array(function.map(50)(rows, np.tile(parameters[:, None], (1, 50))))
    (found,) = AllRows(function)(rows, parameters)
    np.testing.assert_allclose(found[:, :, 0].T, expected, rtol=1e-15)


def test_matrices_keep_their_shape_and_rows_beyond_one_batch_are_there() -> None:
    x = ca.SX.sym("x")
    matrix = ca.SX(2, 3)
    matrix[1, 2] = x
    (found,) = AllRows(ca.Function("sparse", [x], [matrix]))(np.arange(MOST_ROWS + 10.0)[None])
    assert found.shape == (MOST_ROWS + 10, 2, 3)
    np.testing.assert_array_equal(found[:, 1, 2], np.arange(MOST_ROWS + 10.0))
    assert np.count_nonzero(found) == MOST_ROWS + 9


def test_an_unknown_operation_is_refused() -> None:
    x = ca.SX.sym("x")
    with pytest.raises(NotImplementedError, match="operation"):
        AllRows(ca.Function("erf", [x], [ca.erf(x)]))


def test_it_is_the_same_without_a_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    x, p = ca.SX.sym("x", 3), ca.SX.sym("p", 2)
    matrix = ca.jacobian(ca.vertcat(ca.exp(x[0]) * p[0], ca.sin(x[1] * x[2]) / p[1]), x)
    every = AllRows(ca.Function("both", [x, p], [matrix, x[0] + p[1]]))
    rows, parameters = np.random.default_rng(1).normal(size=(3, 150)), np.array([0.7, -1.3])
    with_one = every(rows, parameters)
    monkeypatch.setattr("host.compiled.all_rows._compiled", lambda: None)
    for one, other in zip(with_one, every(rows, parameters), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-15)


@pytest.mark.parametrize("has_compiler", [True, False])
def test_only_what_is_asked_for_is_worked_out(has_compiler: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    x, p = ca.SX.sym("x", 2), ca.SX.sym("p", 4)
    value = ca.vertcat(p[0] * ca.sin(x[0]) + p[1] * x[1], p[2] * ca.exp(p[3] * x[0]) + x[1])
    every = AllRows(ca.Function("slopes", [x, p], [ca.jacobian(value, x), ca.jacobian(value, p)]))
    rows, parameters = np.random.default_rng(2).normal(size=(2, 70)), np.array([0.7, -1.3, 0.4, 0.2])
    if not has_compiler:
        monkeypatch.setattr("host.compiled.all_rows._compiled", lambda: None)
    by_x, by_p = every(rows, parameters)
    few = every.with_columns(1, (1, 3))
    assert len(few._laid.steps) < len(every._laid.steps)
    some_x, some_p = few(rows, parameters)
    np.testing.assert_array_equal(some_x, by_x)
    np.testing.assert_array_equal(some_p, by_p[:, :, [1, 3]])
    assert every.with_columns(1, (0, 1, 2, 3)) is every
    np.testing.assert_array_equal(every(rows, parameters)[1], by_p)  # which is as it was
