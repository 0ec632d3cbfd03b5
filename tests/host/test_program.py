"""Programs on few places: as many instructions as they need, and none too few."""

import casadi as ca
import numpy as np

from host.compiled.all_rows import AllRows
from host.compiled.program import ADD, MUL, PRODUCT_PLUS, Program, laid_out

SQUARE = 6


def test_a_product_and_the_sum_that_alone_takes_it_are_one() -> None:
    program = Program({}, [(0, 0, 0), (0, 1, 1)], [(MUL, 0, 1, 1, 2), (ADD, 0, 2, 2, 3)], [(0, 0, 0, 3)])
    laid = laid_out(program)
    assert laid.steps[:, :4].tolist() == [[PRODUCT_PLUS, 0, 1, 0]]
    assert laid.steps[0, 4] == laid.results[0, 3] == 2


def test_a_product_that_more_than_a_sum_takes_is_worked_out() -> None:
    steps = [(MUL, 0, 1, 1, 2), (ADD, 0, 2, 2, 3), (SQUARE, 2, 2, 2, 4)]
    told = [(0, 0, 0, 3), (0, 1, 0, 4)]
    assert len(laid_out(Program({}, [(0, 0, 0), (0, 1, 1)], steps, told)).steps) == 3
    twice = [(MUL, 0, 1, 1, 2), (ADD, 2, 2, 2, 3)]
    assert len(laid_out(Program({}, [(0, 0, 0), (0, 1, 1)], twice, [(0, 0, 0, 3)])).steps) == 2
    is_result = [(MUL, 0, 1, 1, 2), (ADD, 0, 2, 2, 3)]
    both = Program({}, [(0, 0, 0), (0, 1, 1)], is_result, [(0, 0, 0, 2), (0, 1, 0, 3)])
    assert len(laid_out(both).steps) == 2


def test_intermediate_values_share_places() -> None:
    x = ca.SX.sym("x")
    value = x
    for _ in range(50):
        value = ca.sin(value)
    function = AllRows(ca.Function("deep", [x], [value]))
    assert function._laid.places == 2
    (found,) = function(np.array([[0.3, -0.2]]))
    expected = np.array([0.3, -0.2])
    for _ in range(50):
        expected = np.sin(expected)
    np.testing.assert_allclose(found[:, 0, 0], expected, rtol=1e-13)


def test_sums_of_products_are_those_of_casadi_to_the_last_bit() -> None:
    x = ca.SX.sym("x", 6)
    sums = [x[0] * x[1] + x[2], x[2] - x[0] * x[1], x[3] * x[4] - x[5], x[0] * x[1] + x[2] * x[3]]
    function = ca.Function("sums", [x], [ca.vertcat(*sums)])
    rows = np.random.default_rng(3).normal(size=(6, 90))
    every = AllRows(function)
    assert len(every._laid.steps) < function.n_instructions() - 6 - len(sums)
    np.testing.assert_array_equal(every(rows)[0][:, :, 0].T, np.array(function.map(90)(rows)))
