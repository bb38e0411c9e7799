"""mission.yaml to Mission.

Text becomes nodes (:mod:`missions.yamltree`), nodes become records (:mod:`missions.records`), records are checked
against each other (:mod:`missions.validate`), and the files they name are read (:mod:`missions.maps`,
:mod:`missions.meshes`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

from missions.arrays import Array
from missions.assignment import assigned
from missions.errors import MissionError
from missions.files import read_map_file, read_text
from missions.information import SingleMap, single_maps, with_maps
from missions.mappings import FrozenMapping
from missions.maps import MapError, read_density
from missions.meshes import MeshError, read_mesh
from missions.placing import with_object
from missions.records import RecordReader
from missions.schema import ArrayMap, ImageMap, Mission, MissionSource
from missions.validate import validate
from missions.validate_information import check_sizes
from missions.yamltree import MappingNode, Node, ScalarNode, parse_yaml

SCHEMA_VERSION = "1"


def load_mission(path: str | Path) -> Mission:
    """Read a mission file and the files it names.

    Args:
        path: the mission file; file names in it are relative to its folder.

    Raises:
        MissionError: anything wrong, in one line: ``file:line: path in the file: what, got, allowed``.
    """
    path = Path(path)
    return parse_mission(read_text(path), path=str(path), read_file=lambda name: read_map_file(path.parent, name))


def parse_mission(text: str, *, path: str, read_file: Callable[[str], bytes]) -> Mission:
    """Read a mission from its text, e.g. as embedded in a plan file.

    Args:
        text: the mission file's text.
        path: what to call the file in messages and in ``Mission.source``.
        read_file: contents of a file the mission names, by the name written there, e.g.
            ``source.files.__getitem__``. May raise MissionError, KeyError or OSError.

    Raises:
        MissionError: as :func:`load_mission`.
    """
    root = parse_yaml(text, file=path)
    reader = RecordReader(path)
    _check_version(root, reader)
    mission = reader.read_record(root, Mission)
    validate(mission, reader.error)
    if mission.flight.assignment != "fixed":
        mission = assigned(mission)
        validate(mission, reader.error)
    mission, files = _with_density(mission, read_file, reader)
    mission = _with_object(mission, read_file, reader, files)
    return dataclasses.replace(mission, source=MissionSource(path, text, FrozenMapping(files)))


def _check_version(root: Node, reader: RecordReader) -> None:
    """First of all: in a file of another version every other complaint would mislead."""
    version = root.items.get("schema_version") if isinstance(root, MappingNode) else None
    if isinstance(version, ScalarNode) and version.text != SCHEMA_VERSION:
        reader.lines["schema_version"] = version.line
        raise reader.error(f"got {version.text[:40]!r}; allowed: {SCHEMA_VERSION}", "schema_version")


def _with_density(
    mission: Mission, read_file: Callable[[str], bytes], reader: RecordReader
) -> tuple[Mission, dict[str, bytes]]:
    """The mission with the files of its maps read, and every file that was read."""
    files: dict[str, bytes] = {}
    maps: list[SingleMap] = []
    for where, single in single_maps(mission.information):
        if isinstance(single, ImageMap | ArrayMap):
            files[single.file], density = _read_map(
                single, mission.information_axes, f"{where}.file", read_file, reader
            )
            single = dataclasses.replace(single, density=density)
        maps.append(single)
    mission = dataclasses.replace(mission, information=with_maps(mission.information, tuple(maps)))
    check_sizes(mission, reader.error)
    return mission, files


def _with_object(
    mission: Mission, read_file: Callable[[str], bytes], reader: RecordReader, files: dict[str, bytes]
) -> Mission:
    """The mission with its object read and placed; its file joins the files."""
    item, where = mission.object, "object.file"
    if item is None:
        return mission
    files[item.file] = _read(item.file, where, read_file, reader)
    try:
        mesh = read_mesh(item.file, files[item.file])
    except MeshError as error:
        raise reader.error(f"{item.file!r}: {error}", where) from None
    return with_object(mission, item, mesh, looks="trajectory.yaw" not in reader.lines, error=reader.error)


def _read_map(
    single: ImageMap | ArrayMap, dimension: int, where: str, read_file: Callable[[str], bytes], reader: RecordReader
) -> tuple[bytes, Array]:
    """Contents of a map's file, and the density they are."""
    data = _read(single.file, where, read_file, reader)
    try:
        return data, read_density(single, data, dimension)
    except MapError as error:
        raise reader.error(f"{single.file!r}: {error}", where) from None


def _read(name: str, where: str, read_file: Callable[[str], bytes], reader: RecordReader) -> bytes:
    """Contents of a file the mission names."""
    try:
        return read_file(name)
    except MissionError as error:
        raise reader.error(error.reason, where) from None
    except KeyError:
        raise reader.error(f"{name!r} is not among the mission's files", where) from None
    except OSError as error:
        raise reader.error(f"cannot read {name!r}: {error.strerror or error}", where) from None
