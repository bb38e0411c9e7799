"""Logs that were cut or damaged: what can be saved is saved, and nothing ends in a traceback."""

import numpy as np
import pytest
from mcap.reader import make_reader

from deploy.cli.__main__ import main
from deploy.errors import LogFileError
from deploy.flightlog.reader import read_log
from tests.deploy import synthetic_flight as synthetic


def read_or_refuse(path):
    """The record, or None when the log was refused with one line; anything else fails the test."""
    try:
        return read_log(path)
    except LogFileError as error:
        line = str(error)
    assert "\n" not in line
    return None


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    path = tmp_path_factory.mktemp("flight") / "flight.mcap"
    plan = synthetic.write_flight(path, synthetic.flight_plan(duration=6.0, robots=2))
    return path, plan


def test_the_plan_in_a_log_is_the_plan_that_was_flown(flight):
    path, plan = flight
    record = read_log(path)
    assert record.complete
    assert record.problems == ()
    assert record.flight_plan.trajectories == plan.trajectories
    assert record.flight_plan.certificate == plan.certificate


def test_a_log_cut_anywhere_gives_what_is_left_or_one_line(flight, tmp_path):
    data = flight[0].read_bytes()
    cuts = np.random.default_rng(5).integers(0, len(data) - 1, 50)
    read = 0
    for cut in [*cuts, 0, 4, 8, len(data) - 1]:
        part = tmp_path / "cut.mcap.part"
        part.write_bytes(data[:cut])
        record = read_or_refuse(part)
        if record is None:
            continue
        read += 1
        finished = b"ergoflie.summary" in data[:cut]
        assert record.complete <= finished
        assert record.complete or record.problems
    assert read > 25


def test_a_log_cut_anywhere_is_reported_or_refused_in_one_line(tmp_path, capsys):
    path = tmp_path / "short.mcap"
    synthetic.write_flight(path, synthetic.flight_plan(duration=3.0, robots=1))
    data, codes = path.read_bytes(), []
    for number, cut in enumerate(np.random.default_rng(6).integers(0, len(data), 50)):
        part = tmp_path / f"{number}.mcap.part"
        part.write_bytes(data[:cut])
        codes.append(main(["report", str(part)]))
        said = capsys.readouterr()
        assert "Traceback" not in said.out + said.err
        assert (codes[-1] == 2) == said.err.startswith("ergoflie: ")
        assert said.err.count("\n") == (codes[-1] == 2)
        assert (codes[-1] == 2) != (tmp_path / f"{number}.html").exists()
    assert len({*codes}) > 1


def test_later_cuts_keep_more(flight, tmp_path):
    data = flight[0].read_bytes()
    counts = []
    for share in (0.3, 0.6, 0.9):
        part = tmp_path / f"{share}.part"
        part.write_bytes(data[: int(share * len(data))])
        counts.append(len(read_log(part).of("cf1", "pose")))
    assert 0 < counts[0] < counts[1] < counts[2]


def test_a_damaged_chunk_costs_that_chunk_only(flight, tmp_path):
    data = bytearray(flight[0].read_bytes())
    whole = len(read_log(flight[0]).of("cf1", "pose"))
    with flight[0].open("rb") as stream:
        chunks = make_reader(stream).get_summary().chunk_indexes
    middle = chunks[len(chunks) // 2].chunk_start_offset + 200
    data[middle : middle + 50] = bytes(50)
    (tmp_path / "a.mcap").write_bytes(data)
    record = read_log(tmp_path / "a.mcap")
    assert not record.complete
    assert record.problems
    assert whole - 80 <= len(record.of("cf1", "pose")) <= whole


def test_damage_nobody_needs_is_reported_too(flight, tmp_path):
    data = flight[0].read_bytes()
    for at in range(len(data) // 3, len(data) // 3 + 400, 7):
        (tmp_path / "a.mcap").write_bytes(data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])
        assert not read_log(tmp_path / "a.mcap").complete


def test_noise_never_ends_in_a_traceback(flight, tmp_path):
    original = flight[0].read_bytes()
    rng = np.random.default_rng(11)
    for _ in range(30):
        data = bytearray(original)
        for at in rng.integers(0, len(data), 20):
            data[at] = rng.integers(256)
        (tmp_path / "noise.mcap").write_bytes(data)
        record = read_or_refuse(tmp_path / "noise.mcap")
        if record is not None and record.complete:
            assert record.flight_plan.trajectories == flight[1].trajectories


def test_other_files_are_refused(tmp_path, flight):
    from deploy.planfile import plan_bytes

    for data in (b"", b"hello", plan_bytes(flight[1])):
        (tmp_path / "x.mcap").write_bytes(data)
        with pytest.raises(LogFileError):
            read_log(tmp_path / "x.mcap")
    with pytest.raises(LogFileError, match="cannot read"):
        read_log(tmp_path / "missing.mcap")
