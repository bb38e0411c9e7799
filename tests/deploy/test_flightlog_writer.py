"""The flight recorder: crash-safe, deterministic, never in the flight's way."""

import errno
import io
import json
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from deploy.errors import LogFileError
from deploy.flightlog import recorder
from deploy.flightlog.encode import pose_in_frame, pose_to_json, to_json, vector, vectors_to_json
from deploy.flightlog.reader import read_log
from deploy.flightlog.schema import json_schema
from deploy.flightlog.topics import TOPICS, find_topic
from deploy.flightlog.writer import FlightLog

VICTIM = """
import sys
from deploy.flightlog.writer import FlightLog
log = FlightLog(sys.argv[1], 1.0e9, {"a.bin": b"attached"}, {"seed": "3"})
for i in range(100000):
    log.pose("cf1", i * 0.01, (i, 0, 0))
    if i == 1000:
        log.event(10.0, "phase", "now", phase="on_mission")
        log.write("/mocap", 10.0, {"rate": 100.0})
        # Nothing but the event's own flush brings the first ten seconds to the disk.
        while b"ergoflie.Event" not in open(sys.argv[1] + ".part", "rb").read() and log._recorder._items:
            pass
        print("ready", flush=True)
        sys.stdin.read()
"""


def open_log(path, **options):
    return FlightLog(path, 1.0e9, {}, {"seed": "0"}, **options)


def fill(log):
    log.pose("cf1", 0.0, (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0))
    log.estimate("cf1", 0.1, (1, 2, 3), (0, 0, 0), (0, 0, 0.5), tick=7)
    log.setpoint("cf1", 0.1, (1, 2, 3), yaw_rate=0.1)
    log.reference("cf1", 0.2, (1, 2, 3), (0.1, 0.2, 0.3))
    log.battery("cf1", 0.2, 3.9, level=70, state=0)
    log.link("cf1", 0.3, latency_ms=4.5, lost=2)
    log.supervisor("cf1", 0.4, 6, ["armed", "can_fly"])
    log.event(0.5, "mission_start", "go", phase="on_mission", robot="cf1", level="warning", value=1.5)
    log.write("/mocap", 0.6, {"rate": 100.0, "age": 0.01, "bodies": 1, "missing": []})


def test_what_is_written_is_read(tmp_path):
    with open_log(tmp_path / "a.mcap") as log:
        fill(log)
    record = read_log(tmp_path / "a.mcap")
    assert record.complete
    assert record.robots == ("cf1",)
    assert record.of("cf1", "pose")["position"].tolist() == [[1.0, 2.0, 3.0]]
    assert record.of("cf1", "pose")["orientation"].tolist() == [[0.0, 0.0, 0.0, 1.0]]
    assert record.of("cf1", "estimate")["attitude"].tolist() == [[0.0, 0.0, 0.5]]
    assert np.isnan(record.of("cf1", "setpoint")["velocity"]).all()
    assert record.of("cf1", "link")["lost"].tolist() == [2.0]
    assert record.of("cf1", "supervisor").texts["names"] == (["armed", "can_fly"],)
    (event,) = record.events
    assert (event.t, event.name, event.robot, event.level, event.value) == (0.5, "mission_start", "cf1", "warning", 1.5)
    assert record.series["/mocap"].t.tolist() == [0.6]


def test_every_record_fits_its_json_schema(tmp_path):
    with open_log(tmp_path / "a.mcap") as log:
        fill(log)
    with (tmp_path / "a.mcap").open("rb") as stream:
        seen = set()
        for schema, channel, message in make_reader(stream, validate_crcs=True).iter_messages():
            jsonschema.validate(json.loads(message.data), json.loads(schema.data))
            seen.add(channel.topic)
    assert {"/cf1/pose", "/cf1/link", "/events", "/log", "/mocap"} <= seen


def test_every_topic_has_a_schema_and_finds_its_row():
    for topic in TOPICS:
        jsonschema.Draft202012Validator.check_schema(json.loads(json_schema(topic)))
        assert find_topic(topic.pattern.replace("{robot}", "cf-1"))[0] is topic
    for wrong in ("/cf1", "pose", "/cf1/poses", "/plan/cf1", "//pose", "/{robot}/x"):
        with pytest.raises(ValueError, match="unknown topic"):
            find_topic(wrong)


@given(
    st.integers(0, 2**62),
    st.tuples(*[st.floats()] * 3) | st.tuples(*[st.integers(-9, 9)] * 3),
    st.none() | st.tuples(*[st.floats(-1.0, 1.0)] * 4).map(np.array),
)
def test_poses_written_out_are_what_the_encoder_writes(time, position, quaternion):
    assert pose_to_json(time, position, quaternion) == to_json(pose_in_frame(time, position, quaternion))


numbers = st.none() | st.integers(-9, 9) | st.floats() | st.floats(width=32).map(np.float32)


@given(
    st.lists(st.tuples(*[st.floats()] * 3) | st.just((1, 2, 3)) | st.just(np.ones(3)), min_size=2, max_size=2),
    st.fixed_dictionaries({"a": numbers, "b": numbers}),
)
def test_telemetry_written_out_is_what_the_encoder_writes(vectors, rest):
    names = ("position", "velocity")
    expected = to_json({**dict(zip(names, map(vector, vectors), strict=True)), **rest})
    assert vectors_to_json(names, vectors, rest) == expected
    assert vectors_to_json(names, (vectors[0], None), rest) == to_json({"position": vector(vectors[0]), **rest})


def test_same_records_give_the_same_bytes_whatever_the_threads_do(tmp_path):
    def write(path, threaded):
        with open_log(path, when_full="wait") as log:
            log.battery("warmup", 0.0, 4.0)
            for second in range(5):
                jobs = [
                    lambda n=n, s=second: [log.battery(f"cf{n}", s + 0.01 * i, 4.0) for i in range(20)]
                    for n in range(3)
                ]
                workers = [threading.Thread(target=job) for job in (jobs if threaded else reversed(jobs))]
                for worker in workers:
                    worker.start()
                    if not threaded:
                        worker.join()
                for worker in workers:
                    worker.join()
                log.event(second + 0.9, "tick", "")
        return path.read_bytes()

    alone = write(tmp_path / "a.mcap", False)
    assert write(tmp_path / "b.mcap", False) == alone
    record, other = read_log(tmp_path / "a.mcap"), None
    write(tmp_path / "c.mcap", True)
    other = read_log(tmp_path / "c.mcap")
    assert {name: len(series) for name, series in record.series.items()} == {
        name: len(series) for name, series in other.series.items()
    }


def test_kill_9_keeps_everything_up_to_the_last_event(tmp_path):
    path = tmp_path / "killed.mcap"
    env = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    victim = subprocess.Popen(
        [sys.executable, "-c", VICTIM, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=env
    )
    try:
        assert victim.stdout.readline() == b"ready\n"
    finally:
        victim.send_signal(signal.SIGKILL)
        victim.communicate()
    assert not path.exists()
    record = read_log(path.with_name("killed.mcap.part"))
    assert not record.complete
    assert len(record.of("cf1", "pose")) >= 975  # all but the last 0.25 s
    assert record.attachments["a.bin"] == b"attached"
    assert record.metadata["seed"] == "3"


ALIVE = """
import sys, time
from deploy.flightlog.writer import FlightLog
log = FlightLog(sys.argv[1], 1.0e9, {}, {})
begin = time.monotonic()
while True:
    t = time.monotonic() - begin
    log.pose("cf1", t, (t, 0, 0))
    print(t, flush=True)
    time.sleep(0.002 if t % 1.0 < 0.7 else 0.3)  # also with nothing to write for a while
"""


@pytest.mark.parametrize("line", [5, 130, 400])
def test_kill_9_at_any_moment_costs_at_most_the_last_second(tmp_path, line):
    path = tmp_path / "killed.mcap"
    env = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    victim = subprocess.Popen([sys.executable, "-c", ALIVE, str(path)], stdout=subprocess.PIPE, env=env)
    for _ in range(line):
        said = victim.stdout.readline()
    victim.send_signal(signal.SIGKILL)
    rest, _ = victim.communicate()
    written = [float(word) for word in (said + rest).split()]
    kept = read_log(path.with_name("killed.mcap.part")).of("cf1", "pose")
    assert (0.0 if kept is None else kept.t[-1]) >= written[-1] - 1.0


def test_a_stuck_disk_costs_records_not_time(tmp_path, monkeypatch):
    monkeypatch.setattr(recorder, "CAPACITY", 10)
    stuck = threading.Event()
    commit = recorder.Recorder._commit
    monkeypatch.setattr(recorder.Recorder, "_commit", lambda *args: (stuck.wait(20), commit(*args))[1])
    log = open_log(tmp_path / "a.mcap")
    log.event(0.0, "phase", "go")
    for i in range(100):
        log.battery("cf1", 1.0 + i, 4.0)
    assert log.dropped >= 80
    stuck.set()
    log.close()
    record = read_log(tmp_path / "a.mcap")
    assert record.dropped == log.dropped
    assert len(record.of("cf1", "battery")) + record.dropped in (100, 101, 102)


class FullDisk(io.BytesIO):
    """A file on a disk with little room."""

    def __init__(self, room):
        super().__init__()
        self.room = room

    def write(self, data):
        if self.tell() + len(data) > self.room:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return super().write(data)

    def close(self):
        pass  # the test still wants to see what is on it

    def fileno(self):
        return self.null.fileno()


@pytest.fixture
def full_disk(monkeypatch):
    """Whatever is opened next has so much room."""
    with open(os.devnull, "wb") as FullDisk.null:

        def make(room):
            disk = FullDisk(room)
            monkeypatch.setattr(recorder, "_create", lambda path, part: part.touch() or disk)
            monkeypatch.setattr(recorder.os, "fsync", lambda number: None)
            return disk

        yield make


def test_a_disk_that_fills_up_in_flight_stops_the_log_not_the_flight(tmp_path, full_disk):
    disk = full_disk(6000)
    log = open_log(tmp_path / "a.mcap", when_full="wait")
    for i in range(500):
        log.event(float(i), "phase", "go")
    log.close()
    log.close()
    assert log.failure == "No space left on device"
    assert log.file == tmp_path / "a.mcap.part"
    assert not (tmp_path / "a.mcap").exists()
    log.file.write_bytes(disk.getvalue()[:6000])
    record = read_log(log.file)
    assert not record.complete
    # Every record is on the disk or counted.
    kept = len(record.series["/events"]) + len(record.series["/log"])
    assert kept > 20
    assert kept + log.dropped == 1000


@pytest.mark.parametrize("room", [0, 5, 100])
def test_a_disk_that_is_full_before_the_flight_is_an_error_before_the_flight(tmp_path, full_disk, room):
    full_disk(room)
    with pytest.raises(LogFileError, match="cannot write the flight log: No space left"):
        open_log(tmp_path / "a.mcap")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_bug_in_the_writer_thread_is_not_a_complete_log(tmp_path, monkeypatch):
    log = open_log(tmp_path / "a.mcap", when_full="wait")
    monkeypatch.setattr(log._recorder, "_write", None)
    log.event(0.0, "phase", "go")
    log.close()
    assert "ended with an error" in log.failure
    assert log.file.suffix == ".part"


def test_refused_before_the_flight(tmp_path, monkeypatch):
    (tmp_path / "taken.mcap").touch()
    (tmp_path / "left.mcap.part").touch()
    for name, reason in {
        "taken.mcap": "exists already",
        "left.mcap": "exists already",
        "no/folder.mcap": "cannot write",
        "a.log": "ends in .mcap",
    }.items():
        with pytest.raises(LogFileError, match=reason):
            open_log(tmp_path / name)
    monkeypatch.setattr(recorder, "LEAST_FREE", 1 << 62)
    with pytest.raises(LogFileError, match="MB left on the disk"):
        open_log(tmp_path / "full.mcap")
    assert {path.name for path in tmp_path.iterdir()} == {"taken.mcap", "left.mcap.part"}


def test_numbers_json_cannot_say_become_null_and_other_things_are_refused(tmp_path):
    with open_log(tmp_path / "a.mcap") as log:
        log.battery("cf1", 0.0, float("nan"), level=np.float32(3.5))
        with pytest.raises(TypeError, match="has no JSON form"):
            log.write("/mocap", 0.0, {"rate": object()})
    battery = read_log(tmp_path / "a.mcap").of("cf1", "battery")
    assert np.isnan(battery["voltage"]).all()
    assert battery["level"].tolist() == [3.5]
