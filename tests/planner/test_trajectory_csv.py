"""Trajectory CSV: what we write, Crazyswarm reads; what is published, we read."""

import numpy as np
import pytest

from planner.trajectory.csv import HEADER, from_csv, to_csv
from planner.trajectory.errors import TrajectoryError
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.trajectory.poly4d import decode_poly4d, encode_poly4d

RNG = np.random.default_rng(3)
TRAJECTORY = PiecewisePolynomial(RNG.uniform(0.1, 2.0, 5), RNG.normal(size=(5, 4, 8)))


def test_bytes_survive_the_csv():
    data = encode_poly4d(TRAJECTORY)
    assert encode_poly4d(from_csv(to_csv(decode_poly4d(data, 5)))) == data


def test_columns_are_those_of_uav_trajectories():
    text = to_csv(TRAJECTORY)
    assert text.startswith("duration,x^0,x^1,x^2,x^3,x^4,x^5,x^6,x^7,y^0,")
    assert HEADER.endswith("yaw^7")
    table = np.loadtxt(text.splitlines(), delimiter=",", skiprows=1, usecols=range(33))  # as Crazyswarm reads it
    np.testing.assert_array_equal(table[:, 0], TRAJECTORY.durations)
    np.testing.assert_array_equal(table[:, 9:17], TRAJECTORY.coefficients[:, 1])


def test_trailing_commas_and_empty_lines_are_read():
    lines = to_csv(TRAJECTORY).splitlines()
    published = "\r\n".join([lines[0] + ",", *(line + "," for line in lines[1:]), "", ""])
    np.testing.assert_array_equal(from_csv(published).coefficients, TRAJECTORY.coefficients)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "no pieces"),
        (HEADER, "no pieces"),
        (HEADER + "\n1,2,3", "line 2: 3 columns; 33 expected"),
        (HEADER + "\n" + ",".join(["1"] * 34), "34 columns"),
        (HEADER + "\n" + ",".join(["1"] * 32 + ["x"]), "line 2: could not convert"),
        (HEADER + "\n" + ",".join(["1"] * 32 + ["nan"]), "finite"),
        (HEADER + "\n" + ",".join(["-1"] + ["0"] * 32), "duration -1 s"),
    ],
)
def test_bad_files_are_refused_with_line_and_reason(text, reason):
    with pytest.raises(TrajectoryError, match=reason):
        from_csv(text)
