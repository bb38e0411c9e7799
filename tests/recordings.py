"""Recordings of real firmware that are kept whole and compressed; see tests/golden/README.md."""

import functools
import gzip
import json
from pathlib import Path

GOLDEN = Path(__file__).parent / "golden"


@functools.cache
def recording(name: str) -> dict:
    """The content of ``golden/<name>.json.gz``; shared, so not to be changed."""
    return json.loads(gzip.decompress((GOLDEN / f"{name}.json.gz").read_bytes()))
