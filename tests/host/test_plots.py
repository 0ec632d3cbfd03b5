"""Pictures show what slow sensors tell."""

import numpy as np
from matplotlib import pyplot as plt

from host.identification.plots import line_through


def test_readings_with_empty_rows_between_are_joined() -> None:
    figure, axis = plt.subplots()
    values = np.full(20, np.nan)
    values[::5] = [1.0, 2.0, 3.0, 4.0]
    line_through(axis, np.arange(20.0), values)
    (line,) = axis.get_lines()
    assert line.get_ydata().tolist() == [1.0, 2.0, 3.0, 4.0]
    assert line.get_xdata().tolist() == [0.0, 5.0, 10.0, 15.0]
    plt.close(figure)
