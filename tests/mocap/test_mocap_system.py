import contextlib
import multiprocessing
import time
from pathlib import Path

import pytest

from mocap.errors import MocapConnectError, MocapLost, MocapUnavailable
from mocap.system import SystemMocap
from mocap.systems import BODIES, WITH_BODIES, Library, library_for
from tests.contracts import mocap as contract


@pytest.fixture(autouse=True)
def importable(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parent / "fakes"))


def system(kind, **options):
    options = {"connect_timeout": 20.0} | options
    return SystemMocap(kind, {"hostname": "nowhere"}, time.monotonic, **options)


def wait_for_frames(source):
    """Until something arrived: readiness of the pipe, no sleeping."""
    assert source._pipe.poll(10.0)


def children():
    return [child for child in multiprocessing.active_children() if child.name == "mocap"]


def test_frames_of_the_child_process_meet_the_contract():
    with contextlib.closing(system("works")) as source:
        contract.delivers_frames_in_order(source, lambda: wait_for_frames(source))
        contract.delivers_finite_poses_with_unit_quaternions(source, lambda: wait_for_frames(source))
        contract.stamps_are_not_from_the_future(source, lambda: wait_for_frames(source), time.monotonic)
        contract.closes_twice(source)
        assert not children()


def test_bodies_that_are_not_tracked_are_absent():
    with contextlib.closing(system("works")) as source:
        frames = contract.polls(source, lambda: wait_for_frames(source), rounds=6)
    assert contract.all_frames(frames, "cf1")
    assert not contract.all_frames(frames, "cf2")
    assert frames[0].bodies["cf1"].position == pytest.approx((0.1, 0.2, 1.3))


def test_a_server_that_refuses_is_named():
    with pytest.raises(MocapConnectError, match=r"motion capture \(refuses\): no route to nowhere"):
        system("refuses")
    assert not children()


def test_a_connection_that_hangs_is_given_up():
    began = time.monotonic()
    with pytest.raises(MocapConnectError, match=r"no connection within 0\.3 s"):
        system("hangs", connect_timeout=0.3)
    assert time.monotonic() - began < 5.0
    assert not children()


def test_a_child_that_dies_while_connecting_is_noticed():
    with pytest.raises(MocapConnectError, match="process ended"):
        system("dies at once")


def test_a_library_that_is_missing_says_how_to_install_it():
    library = Library("mocap.clients.nowhere", "nowhere", "mocap")
    with pytest.raises(
        MocapUnavailable, match=r"the nowhere package is not installed: pip install 'ergoflie\[mocap\]'"
    ):
        SystemMocap("vicon", {}, time.monotonic, connect_timeout=20.0, library=library)


def test_every_system_has_something_that_talks_to_it_or_a_way_to_get_it():
    assert all(library_for(system, "bodies") is BODIES for system in (*WITH_BODIES, "nokov"))
    assert library_for("qualisys", "markers").package == "qtm-rt"
    assert library_for("optitrack", "markers").package == "natnet"
    with pytest.raises(
        MocapUnavailable, match=r"\(vicon\): nothing hands over its unlabelled markers; .*optitrack, qualisys"
    ):
        library_for("vicon", "markers")
    with pytest.raises(MocapUnavailable, match=r"got 'vikon'; allowed: vicon, optitrack, qualisys, vrpn; .*: nokov"):
        library_for("vikon", "positions")


@pytest.mark.parametrize(
    ("kind", "message"), [("falls silent", "no frame for"), ("dies", "process ended"), ("breaks", "the stream broke")]
)
def test_frames_that_stop_are_an_error_after_the_last_frame_was_handed_over(kind, message):
    source = system(kind, frame_timeout=0.2)
    frames = []

    def until_lost():
        deadline = time.monotonic() + 10.0
        while time.monotonic() < deadline:
            frames.extend(source.poll())
            with contextlib.suppress(OSError, EOFError):
                source._pipe.poll(0.05)

    with pytest.raises(MocapLost, match=message):
        until_lost()
    assert [frame.number for frame in frames] == [1, 2, 3]
    with pytest.raises(MocapLost, match=message):
        source.poll()
    assert not children()
