"""Columns parsed all together are those that JSON, record by record, gives; and so is the file around them."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from deploy.flightlog import columns as module
from deploy.flightlog.columns import columns
from deploy.flightlog.encode import pose_to_json, vectors_to_json
from deploy.flightlog.mcapfile import McapFile
from deploy.flightlog.topics import find_topic

finite = st.floats(allow_nan=False, allow_infinity=False)
vectors = st.tuples(finite, finite, finite)


def joined(records):
    return b"".join(record + b"," for record in records)


@given(st.lists(st.tuples(st.integers(0, 2**60), vectors, st.tuples(*[finite] * 4)), min_size=1, max_size=5))
def test_poses_come_back_to_the_last_bit(rows):
    numbers, texts = columns(find_topic("/a/pose")[0], joined(pose_to_json(*row) for row in rows), len(rows))
    assert numbers["position"].tolist() == [list(row[1]) for row in rows]
    assert numbers["orientation"].tolist() == [list(row[2]) for row in rows]
    assert texts == {}


@given(st.lists(st.tuples(vectors, vectors, st.none() | st.integers(-9, 9)), min_size=1, max_size=5))
def test_telemetry_comes_back_with_what_is_not_known(rows):
    names = ("position", "velocity")
    records = [vectors_to_json(names, row[:2], {"yaw_rate": None, "tick": row[2]}) for row in rows]
    numbers, _ = columns(find_topic("/a/setpoint")[0], joined(records), len(rows))
    assert numbers["velocity"].tolist() == [list(row[1]) for row in rows]
    assert np.isnan(numbers["yaw_rate"]).all()
    expected = [np.nan if row[2] is None else float(row[2]) for row in rows]
    np.testing.assert_array_equal(numbers["tick"], expected)


def test_records_that_are_not_alike_are_read_one_by_one(monkeypatch):
    topic = find_topic("/a/setpoint")[0]
    with_velocity = vectors_to_json(("position", "velocity"), ((1, 2, 3), (4, 5, 6)), {"yaw_rate": 0.5, "tick": 1})
    without = vectors_to_json(("position",), ((7, 8, 9),), {"yaw_rate": None, "tick": 2})
    swapped = b'{"velocity":{"z":6,"y":5,"x":4},"tick":3}'
    numbers, _ = columns(topic, joined([with_velocity, without, swapped]), 3)
    np.testing.assert_array_equal(numbers["velocity"], [[4, 5, 6], [np.nan] * 3, [4, 5, 6]])
    np.testing.assert_array_equal(numbers["tick"], [1, 2, 3])
    monkeypatch.setattr(module.json, "loads", lambda text: pytest.fail("parsed one by one") if text[:1] == b"[" else {})
    with pytest.raises(pytest.fail.Exception):
        columns(topic, joined([with_velocity, swapped]), 2)


@pytest.mark.parametrize("data", [b"{},{", b"nonsense,", b'{"position":1},', b"[],[],"])
def test_what_is_no_record_is_an_error_the_reader_knows(data):
    with pytest.raises((ValueError, LookupError, TypeError, AttributeError)):
        columns(find_topic("/a/estimate")[0], data, 2)


def test_the_library_reads_what_we_write_by_its_indexes(tmp_path):
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        file = McapFile(stream, "test")
        file.describe("about", {"b": "2", "a": "1"})
        file.attach("x.bin", b"abc", 5)
        first = file.declare("/one", "S", b"{}", {"doc": "d"})
        file.chunk([(10, first, b'{"n":1}'), (12, first, b'{"n":2}')])
        second = file.declare("/two", "S", b"{}", {})
        file.chunk([(15, second, b'{"n":3}'), (11, first, b'{"n":4}')])
        file.chunk([])
        file.finish()
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary.statistics.message_count == file.written == 4
        assert summary.statistics.channel_message_counts == {first: 3, second: 1}
        assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (10, 15)
        assert len(summary.chunk_indexes) == 2
        assert len(summary.schemas) == 1
        found = [(c.topic, m.log_time, m.sequence, json.loads(m.data)["n"]) for _, c, m in reader.iter_messages()]
        assert found == [("/one", 10, 0, 1), ("/one", 11, 2, 4), ("/one", 12, 1, 2), ("/two", 15, 0, 3)]
        assert [m.log_time for _, _, m in reader.iter_messages(topics=["/two"])] == [15]
        assert [item.data for item in reader.iter_attachments()] == [b"abc"]
        assert [item.metadata for item in reader.iter_metadata()] == [{"a": "1", "b": "2"}]
