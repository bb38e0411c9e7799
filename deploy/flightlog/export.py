"""Topics of a log as tables for other tools: CSV, or Parquet through pyarrow (``pip install 'ergoflie[parquet]'``)."""

from __future__ import annotations

import csv
import fnmatch
import io
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

from deploy.errors import LogFileError
from deploy.files import write_whole
from deploy.flightlog.columns import AXES
from deploy.flightlog.reader import FlightRecord, Series

Format = Literal["csv", "parquet"]
Table = dict[str, list[object]]


def tables(record: FlightRecord, patterns: Sequence[str] = ()) -> dict[str, Table]:
    """Columns by topic; those a pattern (``/cf1/*``) fits, or all that hold figures or texts.

    Vectors are columns ``position.x``, …; ``t`` is the flight clock [s]; what is not known is None.

    Raises:
        LogFileError: a pattern fits no topic of the log.
    """
    names = [name for name, series in record.series.items() if series.columns or series.texts]
    for pattern in patterns:
        if not fnmatch.filter(names, pattern):
            raise LogFileError(f"{record.path}: no topic fits '{pattern}'; topics: {', '.join(names)}")
    chosen = [name for name in names if not patterns or any(fnmatch.fnmatchcase(name, p) for p in patterns)]
    return {name: _table(record.series[name]) for name in chosen}


def export(record: FlightRecord, folder: Path, form: Format, patterns: Sequence[str] = ()) -> list[tuple[Path, int]]:
    """Write one file a topic, e.g. ``cf1_pose.csv``; returns files and their numbers of rows.

    Raises:
        LogFileError: as :func:`tables`; pyarrow is missing; the folder cannot be written.
    """
    encode: Callable[[Table], bytes] = _csv if form == "csv" else _parquet_encoder()
    out = []
    for name, table in tables(record, patterns).items():
        path = folder / f"{name.strip('/').replace('/', '_')}.{form}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            write_whole(path, encode(table))
        except OSError as error:
            raise LogFileError(f"{path}: cannot write the table: {error.strerror or error}") from error
        out.append((path, len(table["t"])))
    return out


def _table(series: Series) -> Table:
    out: Table = {"t": series.t.tolist()}
    axes = {len(names): names for names in AXES.values()}
    for name, column in series.columns.items():
        parts = (
            {name: column}
            if column.ndim == 1
            else {f"{name}.{axis}": column[:, k] for k, axis in enumerate(axes[column.shape[1]])}
        )
        for part, values in parts.items():
            out[part] = [None if value != value else value for value in values.tolist()]
    for name, texts in series.texts.items():
        out[name] = list(texts)
    return out


def _csv(table: Table) -> bytes:
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(table)
    for row in zip(*table.values(), strict=True):
        writer.writerow([json.dumps(cell) if isinstance(cell, list) else cell for cell in row])
    return stream.getvalue().encode()


def _parquet_encoder() -> Callable[[Table], bytes]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise LogFileError("Parquet needs pyarrow: pip install 'ergoflie[parquet]'; or --format csv") from error

    def encode(table: Table) -> bytes:
        sink = pyarrow.BufferOutputStream()
        pyarrow.parquet.write_table(pyarrow.table(table), sink)
        return bytes(sink.getvalue())

    return encode
