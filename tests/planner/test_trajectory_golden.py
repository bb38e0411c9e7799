"""Our bytes are cflib's bytes, and what we decode is what the firmware flew (tests/golden/README.md)."""

import struct
from pathlib import Path

import numpy as np
import pytest
from cflib.crazyflie.mem import CompressedStart

from planner.trajectory.compressed import END_MARKER, decode_compressed, encode_compressed
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.trajectory.poly4d import decode_poly4d, encode_poly4d
from tests.recordings import recording

GOLDEN = Path(__file__).parents[1] / "golden"
POLY4D = recording("poly4d")["trajectories"]
COMPRESSED = recording("compressed")["trajectories"]
AXES = ("x", "y", "z", "yaw")


def compare(trajectory, samples, tolerances, relative):
    """Firmware samples against our evaluation; derivatives only where both sides of a joint agree on the piece."""
    t = np.array(samples["t"])
    where = np.array(list(samples.get("where", "i" * len(t))))
    for name, order in (("pos", 0), ("vel", 1), ("acc", 2), ("jerk", 3)):
        mine = trajectory.evaluate(t, order)[:, :3]
        theirs = np.array(samples[name])
        compared = np.isin(where, list("i")) if order else ~joint_gap(trajectory, t, where)
        bound = tolerances[name] * (np.maximum(1.0, np.abs(theirs)) if relative else 1.0)
        assert (np.abs(mine - theirs) <= bound)[compared].all(), name
        assert (theirs[where == "a"] == 0).all() if order else True
    yaw = trajectory.evaluate(t)[:, 3]
    compared = ~joint_gap(trajectory, t, where)
    np.testing.assert_allclose(yaw[compared], np.array(samples["yaw"])[compared], atol=tolerances["yaw"], rtol=0)


def assert_close(trajectory, samples):
    """Positions to 1e-5 m, and what flies by in 3 µs: the firmware's clock and its sums of durations are float32."""
    t = np.array(samples["t"])
    compared = ~joint_gap(trajectory, t, np.array(list(samples["where"])))
    late = 3e-6 * np.abs(trajectory.evaluate(t, 1)[:, :3])
    assert (np.abs(trajectory.evaluate(t)[:, :3] - np.array(samples["pos"])) <= 1e-5 + late)[compared].all()


def joint_gap(trajectory, t, where):
    """Samples at joints where the two pieces disagree: some cases jump on purpose."""
    before, after = trajectory.evaluate(t - 1e-4), trajectory.evaluate(t + 1e-4)
    return (where == "j") & (np.abs(after - before).max(axis=1) > 5e-3)


@pytest.mark.parametrize("case", POLY4D, ids=lambda case: case["name"])
def test_poly4d_image_and_motion(case):
    pieces = case["pieces"]
    trajectory = PiecewisePolynomial(
        np.array([piece["duration"] for piece in pieces]),
        np.array([[piece[axis] for axis in AXES] for piece in pieces]),
    )
    image = bytes.fromhex(case["image_hex"])
    decoded = decode_poly4d(image, case["n_pieces"])
    assert encode_poly4d(decoded) == image
    # JSON has lost the sign of zeros: compare numbers, which equals bytes otherwise.
    np.testing.assert_array_equal(np.frombuffer(encode_poly4d(trajectory), "<f4"), np.frombuffer(image, "<f4"))
    forward = next(e for e in case["evals"] if e["timescale"] == 1 and not e["reversed"] and e["t_begin"] == 0)
    compare(decoded, forward, {"pos": 2e-5, "vel": 5e-5, "acc": 2e-4, "jerk": 2e-3, "yaw": 5e-5}, relative=False)
    assert_close(decoded, forward)


@pytest.mark.parametrize("case", COMPRESSED, ids=lambda case: case["name"])
def test_compressed_motion(case):
    image = bytes.fromhex(case["image_hex"]) + (b"" if case["end_marker"] else END_MARKER)
    decoded = decode_compressed(image, len(case["segments"]))
    assert decoded.duration == pytest.approx(case["duration"], abs=1e-5)
    tolerances = {"pos": 1e-4, "vel": 1e-3, "acc": 2e-3, "jerk": 2e-3, "yaw": 1e-4}
    compare(decoded, case["samples"], tolerances, relative=True)
    assert_close(decoded, case["samples"])


# The encoder keeps to ±32.767 m; one case uses -32.768 m.
@pytest.mark.parametrize(
    "case", [case for case in COMPRESSED if "extreme" not in case["name"]], ids=lambda case: case["name"]
)
def test_compressed_survives_decoding_and_encoding(case):
    """Encoding what was decoded flies the same: the same degrees or lower, within the grid."""
    image = bytes.fromhex(case["image_hex"]) + (b"" if case["end_marker"] else END_MARKER)
    decoded = decode_compressed(image, len(case["segments"]))
    again = encode_compressed(decoded)
    assert len(again) <= len(image)
    t = np.linspace(0, decoded.duration, 1001)
    difference = decode_compressed(again, decoded.pieces).evaluate(t) - decoded.evaluate(t)
    assert np.abs(difference).max() < 2.5e-3


@pytest.mark.parametrize(("value", "metres", "radians"), recording("compressed")["cflib_start_encoding"]["rows"])
def test_cflib_cuts_off_where_we_round(value, metres, radians):
    """Why starts are rounded here before cflib, or anybody, packs them."""
    x, _, _, yaw = struct.unpack("<4h", bytes(CompressedStart(value, value, value, value).pack()))
    assert (x, yaw) == (metres, radians)
    assert abs(1000.0 * value - metres) < 1.0
