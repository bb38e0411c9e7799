"""Several information maps in one mission: what is read, what is refused, and other weights written into its text."""

import io
import re

import numpy as np
import pytest

from missions import MissionError, parse_mission
from missions.information import SeveralMaps
from missions.weights import reweighted, rewritten
from planner.ergodic.basis import CosineBasis
from planner.ergodic.target import information_coefficients
from planner.indicators import ergodic_metric

TEXT = """\
schema_version: 1   # stays
name: two_maps
workspace: {lower: [0.0, 0.0], upper: [2.0, 2.0]}
horizon: {duration: 8.0}
information:
  type: several
  maps:
    - name: people   # stays, too
      map: {type: gaussians, components: [{mean: [0.5, 0.5], covariance: 0.05}]}
    - {name: gas, map: {type: gaussians, components: [{mean: [1.5, 1.5], covariance: 0.05}]}}
robots: [{name: one, start: [1.0, 1.0]}]
limits: {acceleration: 0.5}
"""
FLOW = TEXT.replace(
    TEXT[TEXT.index("information:") : TEXT.index("robots:")],
    "information: {type: several, maps: [{name: a, map: {type: uniform}}, {name: b, map: {type: uniform}}]}\n",
)
ARRAYS = TEXT.replace(
    "{type: gaussians, components: [{mean: [0.5, 0.5], covariance: 0.05}]}", "{type: array, file: a.npy}"
).replace("{type: gaussians, components: [{mean: [1.5, 1.5], covariance: 0.05}]}", "{type: array, file: b.npy}")


def read(text, **files):
    return parse_mission(text, path="m.yaml", read_file=lambda name: files[name.removesuffix(".npy")])


def npy(array):
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def weighed(weights, text=TEXT):
    return text.replace("  type: several\n", f"  type: several\n  weights: {weights}\n")


def test_maps_count_by_their_weights_which_are_the_same_by_default():
    mission = read(TEXT)
    assert mission.information.shares == (0.5, 0.5)
    assert mission.information.names == ("people", "gas")
    basis = CosineBasis(np.zeros(2), np.full(2, 2.0), 10)
    people, gas = (information_coefficients(item.map, basis) for item in mission.information.maps)
    assert ergodic_metric(mission).phi_k == pytest.approx(0.5 * people + 0.5 * gas)
    assert ergodic_metric(read(weighed([1.0, 0.0]))).phi_k == pytest.approx(people)


def test_maps_from_files_are_all_read_and_kept():
    first, second = np.ones((4, 3)), np.arange(12.0).reshape(4, 3)
    mission = read(ARRAYS, a=npy(first), b=npy(second))
    assert isinstance(mission.information, SeveralMaps)
    assert np.array_equal(mission.information.maps[1].map.density, second)
    assert set(mission.source.files) == {"a.npy", "b.npy"}


MISTAKES = [
    (weighed([0.5, 0.6]), r"information\.weights: got weights that sum to 1\.1; allowed: a sum of 1"),
    (weighed([1.0]), r"information\.weights: got 1 items; allowed: 2 to 6"),
    (weighed([0.2, 0.3, 0.5]), r"information\.weights: got 3 weights; allowed: 2, one for each map"),
    (weighed([-0.5, 1.5]), r"information\.weights\[0\]: got -0\.5; allowed: at least 0, at most 1"),
    (TEXT.replace("name: gas", "name: people"), r"information\.maps\[1\]\.name: got 'people' twice; allowed: a name"),
    (TEXT.replace("name: gas", "name: gas leak"), r"information\.maps\[1\]\.name: got 'gas leak'; allowed: what the"),
    (TEXT.replace("[1.5, 1.5]", "[9.5, 1.5]"), r"information\.maps\[1\]\.map\.components\[0\]\.mean: this Gaussian"),
    (
        TEXT[: TEXT.index("    - {name: gas")] + TEXT[TEXT.index("robots:") :],
        r"information\.maps: got 1 items; .* 2 to",
    ),
    (
        FLOW.replace("[{name: a", "[" + ", ".join(["{name: z, map: {type: uniform}}"] * 5) + ", {name: a"),
        r"information\.maps: got 7 items; allowed: 2 to 6",
    ),
    (FLOW.replace("{type: uniform}", "{type: several, maps: []}", 1), r"information\.maps\[0\]\.map\.type: got 'sev"),
]


@pytest.mark.parametrize(("text", "message"), MISTAKES)
def test_mistakes_are_told_where_they_are(text, message):
    with pytest.raises(MissionError, match=r"^m\.yaml:\d+: " + message):
        read(text)


def test_maps_of_different_sizes_are_refused():
    with pytest.raises(MissionError, match=r"maps\[1\]\.map\.file: got a map of 4 × 4 cells; allowed: 4 × 3, as"):
        read(ARRAYS, a=npy(np.ones((4, 3))), b=npy(np.ones((4, 4))))


@pytest.mark.parametrize(
    "text", [TEXT, FLOW, weighed([0.25, 0.75]), weighed("# none\n    - 0.5\n    - 0.5"), "﻿" + TEXT]
)
def test_other_weights_are_written_into_the_text_and_nothing_else_changes(text):
    before = read(text)
    weights = (0.1 + 0.2, 1.0 - (0.1 + 0.2))
    after = rewritten(before, weights)
    assert after.information.shares == weights
    assert after == reweighted(before, weights)
    anyhow = r"weights:( # none\n   )? (\[[^]]*\],?|- 0\.5\n    - 0\.5)\s*"
    assert re.sub(anyhow, "", after.source.text) == re.sub(anyhow, "", text)


def test_one_map_has_no_weights():
    one = read(TEXT.replace(TEXT[TEXT.index("information:") : TEXT.index("robots:")], "information: {type: uniform}\n"))
    with pytest.raises(ValueError, match="2 weights for the maps of mission 'two_maps'"):
        reweighted(one, (0.5, 0.5))
