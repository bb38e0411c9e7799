"""Information maps from files: PNG images and NumPy arrays to densities.

A density is indexed [x, y(, z)], cell-centred over the workspace, finite, non-negative and not all zero. Files come
from anywhere, so sizes are checked before memory is spent and nothing is ever unpickled.
"""

from __future__ import annotations

import io
import math
import re
import struct
import warnings
import zlib

import numpy as np
from PIL import Image

from missions.arrays import Array, frozen
from missions.schema import ArrayMap, ImageMap

MAX_FILE_BYTES = 64_000_000
MAX_CELLS = 16_000_000
_UNREADABLE_IMAGE = (OSError, ValueError, SyntaxError, EOFError, IndexError, KeyError, TypeError, OverflowError)
_NPY = re.compile(rb"\x93NUMPY(?:\x01\x00(?P<short>..)|\x02\x00(?P<long>....))", re.DOTALL)
_DESCR = re.compile(r"'descr': *(?:'([^']*)'|\[)")
_ORDER = re.compile(r"'fortran_order': *(True|False)")
_SHAPE = re.compile(r"'shape': *\(([0-9, ]{0,60})\)")


class MapError(ValueError):
    """A file is not a usable information map."""


def read_density(information: ImageMap | ArrayMap, data: bytes, dimension: int) -> Array:
    """Read the file of an information map.

    Args:
        information: the map; says how to read the file.
        data: contents of the file.
        dimension: 2 or 3, of the workspace.

    Returns:
        Read-only density indexed [x, y(, z)].

    Raises:
        MapError: not a PNG or .npy file, too large, of the wrong dimension, negative, not finite, or all zero.
    """
    if len(data) > MAX_FILE_BYTES:
        raise MapError(f"file of more than {MAX_FILE_BYTES} bytes; make the map smaller")
    if isinstance(information, ArrayMap):
        return _checked(_read_array(data, dimension))
    if dimension != 2:
        raise MapError("an image map needs a 2-D workspace; for 3-D use 'type: array'")
    return _checked(_read_image(data, information.invert))


def _read_image(data: bytes, invert: bool) -> Array:
    """Brightness times opacity, 0..1; the image's top row becomes the largest y."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # Pillow only warns of a decompression bomb of up to 179 megapixels
            with Image.open(io.BytesIO(data), formats=("PNG",)) as image:
                _check_cells(image.size)
                image.verify()  # check sums up to the end of the file; Pillow decodes cut and damaged files otherwise
            with Image.open(io.BytesIO(data), formats=("PNG",)) as image:
                _check_cells(image.size)
                brightness, opacity = _gray(image)
    except MapError:
        raise
    except Image.DecompressionBombError:
        raise MapError(f"image of more than {MAX_CELLS} pixels; make the map smaller") from None
    except (*_UNREADABLE_IMAGE, struct.error, zlib.error, Warning) as error:
        raise MapError(f"not a readable PNG image ({_short(error)})") from None
    if invert:
        brightness = 1.0 - brightness
    return np.asarray(brightness * opacity)[::-1].T


def _gray(image: Image.Image) -> tuple[Array, Array | float]:
    """Brightness and opacity, 0..1, one row of pixels a row."""
    if image.mode.startswith("I"):  # 16-bit gray: Pillow's conversion to 8 bits would clip it
        return np.asarray(image, dtype=np.float64) / 65535.0, 1.0
    if image.has_transparency_data:
        gray, opacity = image.convert("RGBA").convert("LA").split()
        return np.asarray(gray, dtype=np.float64) / 255.0, np.asarray(opacity, dtype=np.float64) / 255.0
    return np.asarray(image.convert("L"), dtype=np.float64) / 255.0, 1.0


def _read_array(data: bytes, dimension: int) -> Array:
    """The .npy format 1.0 or 2.0, read here: numpy.load evaluates the header as Python and allocates what it claims."""
    match = _NPY.match(data)
    if not match:
        raise MapError("not a .npy file of format 1.0 or 2.0; write one with numpy.save")
    start = match.end() + int.from_bytes(match["short"] or match["long"], "little")
    header = data[match.end() : start].decode("latin-1")
    descr, order, shape = (pattern.search(header) for pattern in (_DESCR, _ORDER, _SHAPE))
    if not (descr and order and shape):
        raise MapError("a .npy file with an unreadable header")
    if not re.fullmatch(r"[<>|=]?(b1|[iu][1248]|f[248])", descr[1]):
        raise MapError(f"array of type {descr[1][:20]!r}; allowed: real numbers")
    sizes = tuple(int(size) for size in re.findall(r"[0-9]+", shape[1]))
    if len(sizes) != dimension:
        axes = ", ".join("xyz"[:dimension])
        raise MapError(f"array with {len(sizes)} axes; allowed: {dimension}, indexed [{axes}]")
    _check_cells(sizes)
    dtype = np.dtype(descr[1])
    if math.prod(sizes) * dtype.itemsize > len(data) - start:
        raise MapError("file cut short")
    values = np.frombuffer(data, dtype, count=math.prod(sizes), offset=start)
    return values.reshape(sizes, order="F" if order[1] == "True" else "C").astype(np.float64)


def _check_cells(shape: tuple[int, ...]) -> None:
    cells = math.prod(shape)
    if min(shape) < 1 or not 1 <= cells <= MAX_CELLS:
        size = " × ".join(map(str, shape))
        raise MapError(f"map of {size} cells; allowed: 1 to {MAX_CELLS} cells in all")


def _checked(density: Array) -> Array:
    if not np.isfinite(density).all():
        raise MapError("map with NaN or infinite entries; allowed: finite numbers")
    if density.min() < 0.0:
        raise MapError(f"map with negative entries (least {density.min():g}); allowed: at least 0")
    if density.max() == 0.0:
        raise MapError("map without information: every entry is 0")
    if density.max() > 1e300 / density.size:
        raise MapError("map with entries whose sum overflows; scale it down")
    return frozen(density)


def _short(error: BaseException) -> str:
    """First line of a foreign message, bounded: it may quote the file."""
    text = " ".join(str(error).split()) or type(error).__name__
    text = "".join(character for character in text if character.isprintable())
    return text if len(text) <= 120 else text[:117] + "..."
