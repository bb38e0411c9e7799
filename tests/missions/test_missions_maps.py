"""Information maps from files: orientation, brightness, and everything that has to be refused."""

import io
import os
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import missions
from missions import MissionError, load_mission
from missions.maps import MapError, read_density
from missions.schema import ArrayMap, ImageMap

PHOTO = (Path(missions.__file__).parent / "photo_map.yaml").read_text()


def png(pixels, mode=None, **save):
    stream = io.BytesIO()
    image = Image.fromarray(np.asarray(pixels)) if mode is None else pixels.convert(mode)
    image.save(stream, "PNG", **save)
    return stream.getvalue()


def npy(values, **save):
    stream = io.BytesIO()
    np.save(stream, values, **save)
    return stream.getvalue()


def image_map(data, **fields):
    return read_density(ImageMap(file="x.png", **fields), data, 2)


def array_map(data, dimension=2):
    return read_density(ArrayMap(file="x.npy"), data, dimension)


# ------------------------------------------------------------------------------------------------------- images

CORNERS = np.array([[10, 20, 30], [40, 50, 60]], dtype=np.uint8)  # top row first


def test_image_is_indexed_x_y_with_the_top_row_at_upper_y():
    density = image_map(png(CORNERS)) * 255.0

    assert density.shape == (3, 2)
    assert density[0, 0] == pytest.approx(40)  # lower left
    assert density[2, 0] == pytest.approx(60)  # lower right
    assert density[0, 1] == pytest.approx(10)  # upper left
    assert density[2, 1] == pytest.approx(30)  # upper right


def test_inverted_image_and_transparency():
    rgba = np.zeros((1, 3, 4), dtype=np.uint8)
    rgba[0] = [(255, 255, 255, 255), (255, 255, 255, 0), (0, 0, 0, 255)]  # white, clear, black
    assert image_map(png(rgba))[:, 0] == pytest.approx([1.0, 0.0, 0.0])
    assert image_map(png(rgba), invert=True)[:, 0] == pytest.approx([0.0, 0.0, 1.0])


def test_sixteen_bits_are_not_clipped_to_eight():
    density = image_map(png(np.array([[0, 32768, 65535]], dtype=np.uint16)))
    assert density[:, 0] == pytest.approx([0.0, 32768 / 65535, 1.0])


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGB", "RGBA", "I;16"])
def test_every_kind_of_png_gives_the_same_map(mode):
    levels = np.array([[0, 255], [255, 0]], dtype=np.uint8)
    source = Image.fromarray(levels) if mode != "I;16" else Image.fromarray(levels.astype(np.uint16) * 257)
    data = png(source, mode) if mode != "I;16" else png(np.asarray(source))
    assert np.array_equal(image_map(data), [[1.0, 0.0], [0.0, 1.0]])


def test_a_palette_with_a_transparent_colour():
    image = Image.fromarray(np.array([[0, 1]], dtype=np.uint8), mode=None).convert("P")
    image.putpalette([255, 255, 255, 255, 255, 255])
    stream = io.BytesIO()
    image.save(stream, "PNG", transparency=0)
    assert image_map(stream.getvalue())[:, 0] == pytest.approx([0.0, 1.0])


def bomb(width, height):
    """A valid PNG of a few bytes that claims a huge size."""

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"\0" * 100)) + chunk(b"IEND", b"")
    )


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "not a readable PNG"),
        (b"GIF89a not a png", "not a readable PNG"),
        (png(CORNERS)[:40], "not a readable PNG"),
        (png(CORNERS)[:-20], "not a readable PNG"),
        (png(np.zeros((4, 4), dtype=np.uint8)), "without information"),
        (bomb(5000, 5000), "cells; allowed: 1 to 16000000"),
        (bomb(10_000, 10_000), "make the map smaller|not a readable PNG"),
        (bomb(40_000, 40_000), "image of more than"),
    ],
)
def test_images_that_are_no_maps(data, message):
    with pytest.raises(MapError, match=message):
        image_map(data)


def test_an_image_is_flat():
    with pytest.raises(MapError, match="2-D workspace"):
        read_density(ImageMap(file="x.png"), png(CORNERS), 3)


# ------------------------------------------------------------------------------------------------------- arrays


@pytest.mark.parametrize("dtype", [np.float64, np.float32, np.int16, np.uint8, ">f8", bool])
def test_array_is_taken_as_it_is(dtype):
    values = np.array([[0, 1, 0], [1, 1, 0]]).astype(dtype)
    density = array_map(npy(values))
    assert density.dtype == np.float64
    assert np.array_equal(density, values.astype(float))
    assert np.array_equal(array_map(npy(np.asfortranarray(values))), density)


def test_array_in_three_dimensions():
    assert array_map(npy(np.ones((2, 3, 4))), dimension=3).shape == (2, 3, 4)


def test_a_pickle_is_never_loaded():
    class Trap:
        def __reduce__(self):
            return (os.mkdir, ("pickle_was_loaded",))

    data = npy(np.array([[Trap()]], dtype=object), allow_pickle=True)
    with pytest.raises(MapError, match="array of type"):
        array_map(data)
    assert not Path("pickle_was_loaded").exists()


def lying_header(shape):
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return stream.getvalue() + bytes(64)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "not a .npy"),
        (b"PK\x03\x04zip", "not a .npy"),
        (npy(np.ones((3, 3)))[:60], "unreadable header"),
        (npy(np.ones((3, 3)))[:-1], "cut short"),
        (lying_header((4000, 4000)), "cut short"),
        (lying_header((10**9, 10**9)), "cells; allowed"),
        (lying_header((0, 5)), "cells; allowed"),
        (npy(np.ones(3)), "1 axes; allowed: 2"),
        (npy(np.ones((3, 3, 3))), "3 axes; allowed: 2"),
        (npy(np.ones((2, 2), dtype=complex)), "array of type '<c16'"),
        (npy(np.array([["a"]])), "array of type '<U1'"),
        (npy(np.array([[1.0, np.nan]])), "NaN or infinite"),
        (npy(np.array([[1.0, np.inf]])), "NaN or infinite"),
        (npy(np.array([[1.0, -0.5]])), r"negative entries \(least -0.5\)"),
        (npy(np.zeros((2, 2))), "without information"),
        (npy(np.full((2, 2), 1e308)), "sum overflows"),
    ],
)
def test_arrays_that_are_no_maps(data, message):
    with pytest.raises(MapError, match=message):
        array_map(data)


# -------------------------------------------------------------------------------------------------------- files


def write_mission(folder, file, text=PHOTO):
    path = folder / "m.yaml"
    path.write_text(text.replace("file: photo_map.png", f"file: {file}"))
    return path


def refused(path):
    with pytest.raises(MissionError) as caught:
        load_mission(path)
    assert str(caught.value).isprintable()
    return str(caught.value)


def test_a_missing_image_is_named_with_its_line(tmp_path):
    message = refused(write_mission(tmp_path, "nowhere.png"))
    line = PHOTO[: PHOTO.index("file: photo_map.png")].count("\n") + 1
    assert message.startswith(f"{tmp_path}/m.yaml:{line}: information.file: no such file: ")


def test_files_outside_the_folder_are_refused_unless_absolute(tmp_path):
    folder = tmp_path / "inside"
    folder.mkdir()
    (tmp_path / "outside.png").write_bytes(png(CORNERS))
    (folder / "link.png").symlink_to(tmp_path / "outside.png")
    (folder / "loop.png").symlink_to(folder / "loop.png")

    assert "leads out of the mission's folder" in refused(write_mission(folder, "../outside.png"))
    assert "leads out of the mission's folder" in refused(write_mission(folder, "x/../../outside.png"))
    assert "leads out of the mission's folder" in refused(write_mission(folder, "link.png"))
    assert "information.file: " in refused(write_mission(folder, "loop.png"))
    assert load_mission(write_mission(folder, tmp_path / "outside.png")).information.density.shape == (3, 2)


def test_only_regular_files_are_read(tmp_path):
    os.mkfifo(tmp_path / "pipe.png")  # opening it would wait for ever
    (tmp_path / "folder.png").mkdir()
    for name in ("pipe.png", "folder.png", "/dev/zero"):
        assert "not a regular file" in refused(write_mission(tmp_path, name))
    assert "information.file: " in refused(write_mission(tmp_path, "x" * 5000))


def test_a_link_inside_the_folder_and_a_subfolder_are_fine(tmp_path):
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps" / "a.png").write_bytes(png(CORNERS))
    (tmp_path / "b.png").symlink_to("maps/a.png")
    for name in ("maps/a.png", "b.png", "maps/../maps/a.png"):
        mission = load_mission(write_mission(tmp_path, name))
        assert dict(mission.source.files) == {name: png(CORNERS)}


def test_the_hash_follows_the_map(tmp_path):
    (tmp_path / "a.png").write_bytes(png(CORNERS))
    before = load_mission(write_mission(tmp_path, "a.png")).source.sha256
    (tmp_path / "a.png").write_bytes(png(CORNERS + 1))
    assert load_mission(write_mission(tmp_path, "a.png")).source.sha256 != before


def test_mission_files_that_cannot_be_read(tmp_path):
    (tmp_path / "latin1.yaml").write_bytes(b"name: x\ndescription: caf\xe9\n")
    (tmp_path / "huge.yaml").write_bytes(b"#" * 5_000_001)
    (tmp_path / "bom.yaml").write_bytes(b"\xef\xbb\xbfname: x\n")
    assert refused(tmp_path / "nowhere.yaml") == f"{tmp_path}/nowhere.yaml: no such file"
    assert "a directory" in refused(tmp_path)
    assert f"{tmp_path}/latin1.yaml:2: not UTF-8 text (byte 0xE9)" in refused(tmp_path / "latin1.yaml")
    assert "file of more than 5000000 bytes" in refused(tmp_path / "huge.yaml")
    assert "missing key 'schema_version'" in refused(tmp_path / "bom.yaml")
    with pytest.raises(MissionError, match="cannot read"):
        load_mission("nul\0byte.yaml")
    assert "Not a directory" in refused(tmp_path / "bom.yaml" / "m.yaml")
