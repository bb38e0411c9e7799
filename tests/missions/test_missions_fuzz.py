"""Whatever the bytes, the answer is a Mission or a MissionError in one line: never a traceback."""

import io
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import missions
from missions import Mission, MissionError, load_mission, parse_mission
from missions.maps import MapError, read_density
from missions.schema import ArrayMap, ImageMap

FOLDER = Path(missions.__file__).parent
SHIPPED = [(FOLDER / name).read_text() for name in ("imec_four_drones.yaml", "one_drone.yaml", "photo_map.yaml")]
PNG = (FOLDER / "photo_map.png").read_bytes()
QUICK = settings(
    deadline=None, derandomize=True, max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def outcome(function, error):
    """What the function returns, or the error it may raise; anything else fails the test."""
    try:
        return function()
    except error as refusal:
        return refusal


def judge(text):
    result = outcome(lambda: parse_mission(text, path="m.yaml", read_file=lambda name: PNG), MissionError)
    if isinstance(result, MissionError):
        assert str(result).startswith("m.yaml")
        assert str(result).isprintable()
        assert len(str(result)) < 1000
    else:
        assert isinstance(result, Mission)


@QUICK
@given(st.text(max_size=400))
def test_any_text(text):
    judge(text)


@QUICK
@given(st.binary(max_size=400))
def test_any_bytes(tmp_path, data):
    (tmp_path / "m.yaml").write_bytes(data)
    with pytest.raises(MissionError):
        load_mission(tmp_path / "m.yaml")


NASTY = r"""
null ~ true on 0012 1:30 1e-3 -1 0 1e308 -1e308 1e-320 .nan 1_000 0x10 2026-01-31 '' "\0" "\ud800" "a\nb" [] {}
[[]] [{}] *a &a !!int - ? : | > % @ ` [1,2] [[1,2],[3]] {a:1} 99999999999999999999 gaussians none image uniform array
circle ../x /dev/null .
"""
SCALARS = st.one_of(
    st.sampled_from([*NASTY.split(), "\x85", "\u2028", "'\u2028'"]),
    st.floats().map(repr),
    st.integers().map(str),
    st.text(max_size=10),
)


@st.composite
def mutated(draw):
    """A shipped mission in which a few values, lines or stretches of text were replaced, repeated or cut."""
    text = draw(st.sampled_from(SHIPPED))
    for _ in range(draw(st.integers(1, 4))):
        lines = text.split("\n")
        at = draw(st.integers(0, len(lines) - 1))
        match draw(st.integers(0, 5)):
            case 0:
                lines[at] = lines[at].partition(":")[0] + ": " + draw(SCALARS)
            case 1:
                del lines[at]
            case 2:
                lines.insert(at, draw(st.sampled_from(lines)))
            case 3:
                lines[at] = " " * draw(st.integers(0, 4)) + lines[at].lstrip()
            case 4:
                cut = draw(st.integers(0, len(lines[at])))
                lines[at] = lines[at][:cut] + draw(SCALARS) + lines[at][cut + draw(st.integers(0, 5)) :]
            case _:
                numbers = [i for i, character in enumerate(lines[at]) if character.isdigit()]
                if numbers:
                    where = draw(st.sampled_from(numbers))
                    lines[at] = lines[at][:where] + draw(SCALARS) + lines[at][where + 1 :]
        text = "\n".join(lines)
    return text


@settings(QUICK, max_examples=400)
@given(mutated())
def test_mutations_of_shipped_missions(text):
    judge(text)


@QUICK
@given(st.sampled_from([KeyError("x"), OSError(5, "disk on fire"), OSError(), MissionError("no")]))
def test_a_reader_of_files_may_fail(failure):
    def read_file(name):
        raise failure

    with pytest.raises(MissionError, match=r"^m\.yaml:\d+: information\.file: "):
        parse_mission(SHIPPED[2], path="m.yaml", read_file=read_file)


def npy():
    stream = io.BytesIO()
    np.save(stream, np.arange(12.0).reshape(3, 4))
    return stream.getvalue()


@settings(QUICK, max_examples=300)
@given(st.data())
def test_damaged_maps(data):
    information, original = data.draw(
        st.sampled_from([(ImageMap("x"), PNG[:2000]), (ImageMap("x"), PNG), (ArrayMap("x"), npy())])
    )
    damaged = bytearray(original)
    for _ in range(data.draw(st.integers(0, 6))):
        # Headers are where the interesting damage is.
        at = data.draw(st.integers(0, min(len(damaged), 200) - 1) | st.integers(0, len(damaged) - 1))
        damaged[at] = data.draw(st.integers(0, 255))
    result = outcome(lambda: read_density(information, bytes(damaged), 2), MapError)
    if isinstance(result, MapError):
        assert str(result).isprintable()
    else:
        assert result.ndim == 2
        assert np.isfinite(result).all()
        assert result.min() >= 0.0 < result.max()
