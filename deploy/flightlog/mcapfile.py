"""Writes MCAP files a chunk at a time: chunked, compressed, indexed, every byte under a checksum.

The library's writer takes one message at a time through four objects each, which costs more than encoding it. Here a
chunk's messages are packed at once; everything else is written by the library's own records (https://mcap.dev/spec).
Schemas and channels lie outside the chunks: a damaged chunk costs its messages only.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import PurePosixPath
from typing import BinaryIO

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from deploy.flightlog.container import MAGIC
from deploy.flightlog.schema import Topic, json_schema

_MESSAGE = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time
_FIXED = _MESSAGE.size - 9  # bytes of a message's content before its data
_FOOTER = struct.Struct("<BQQQ")  # what the summary's checksum covers of the footer
_MEDIA_TYPES = {".yaml": "application/yaml", ".json": "application/json", ".png": "image/png"}


class McapFile:
    """An MCAP file being written. Not thread-safe.

    Args:
        stream: at its beginning; only ever appended to. profile: of the header.

    Raises:
        OSError: from any method: the disk refused. What was written before is still readable.
    """

    def __init__(self, stream: BinaryIO, profile: str) -> None:
        self._stream = stream
        self._at = self._crc = 0
        self._schemas: dict[str, Schema] = {}
        self._channels: list[Channel] = []
        self._counts: Counter[int] = Counter()
        self._first, self._last = 1 << 64, 0
        self._chunks: list[ChunkIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._compressor = zstandard.ZstdCompressor(level=1)
        self._put(MAGIC)
        self._record(Header(profile, "ergoflie"))

    @property
    def written(self) -> int:
        """Messages so far."""
        return self._counts.total()

    def attach(self, name: str, data: bytes, time: int = 0) -> None:
        """Embed a file; ``time`` [ns] is its own."""
        offset, media_type = self._at, _MEDIA_TYPES.get(PurePosixPath(name).suffix, "application/octet-stream")
        length = self._record(Attachment(time, time, name, media_type, data))
        self._attachments.append(AttachmentIndex(offset, length, time, time, len(data), name, media_type))

    def describe(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record, keys sorted."""
        offset = self._at
        length = self._record(Metadata(name=name, metadata=dict(sorted(values.items()))))
        self._metadata.append(MetadataIndex(offset=offset, length=length, name=name))

    def channel(self, name: str, topic: Topic, robot: str = "") -> int:
        """Declare a JSON channel of a row of the table of topics; returns its number."""
        about = {"frame": topic.frame, "clock": topic.clock, "rate": topic.rate, "doc": topic.doc, "robot": robot}
        return self.declare(name, topic.schema, json_schema(topic).encode(), about)

    def declare(self, name: str, schema: str, text: bytes, about: Mapping[str, str]) -> int:
        """Declare any JSON channel; returns its number."""
        if schema not in self._schemas:
            self._schemas[schema] = Schema(len(self._schemas) + 1, text, "jsonschema", schema)
            self._record(self._schemas[schema])
        number = len(self._channels) + 1
        self._channels.append(Channel(number, name, "json", dict(about), self._schemas[schema].id))
        self._record(self._channels[-1])
        return number

    def chunk(self, messages: Sequence[tuple[int, int, bytes]]) -> None:
        """Write (time [ns], channel, data) of messages as one chunk; nothing if there are none."""
        if not messages:
            return
        counts, pack = self._counts, _MESSAGE.pack
        parts: list[bytes] = []
        places: dict[int, list[int]] = {}  # by channel: time and offset of one message after the other
        offset = 0
        for time, channel, data in messages:
            places.setdefault(channel, []).extend((time, offset))
            parts.append(pack(5, _FIXED + len(data), channel, counts[channel], time, time))
            parts.append(data)
            counts[channel] += 1
            offset += _MESSAGE.size + len(data)
        times = [message[0] for message in messages]
        first, last = min(times), max(times)
        self._first, self._last = min(self._first, first), max(self._last, last)
        self._write_chunk(b"".join(parts), first, last, places)

    def finish(self) -> None:
        """Write indexes and footer; the stream stays open."""
        self._record(DataEnd(self._crc))
        start = self._at
        builder, offsets = RecordBuilder(), []
        groups: tuple[tuple[Opcode, Sequence[McapRecord]], ...] = (
            (Opcode.SCHEMA, list(self._schemas.values())),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, self._attachments),
            (Opcode.METADATA_INDEX, self._metadata),
        )
        for opcode, records in groups:
            begin = builder.count
            for record in records:
                record.write(builder)
            if records:
                offsets.append(SummaryOffset(opcode, group_start=start + begin, group_length=builder.count - begin))
        offset_start = start + builder.count
        for item in offsets:
            item.write(builder)
        summary: bytes = builder.end()  # type: ignore[no-untyped-call]
        crc = zlib.crc32(_FOOTER.pack(Opcode.FOOTER, 20, start, offset_start), zlib.crc32(summary))
        self._put(summary)
        self._record(Footer(start, offset_start, crc))
        self._put(MAGIC)

    # ------------------------------------------------------------------------------------------------ inside

    def _write_chunk(self, data: bytes, first: int, last: int, places: Mapping[int, list[int]]) -> None:
        packed = self._compressor.compress(data)
        begin = self._at
        length = self._record(Chunk("zstd", packed, last, first, zlib.crc32(data), len(data)))
        indexes = self._at
        offsets: dict[int, int] = {}
        for channel, entries in places.items():
            offsets[channel] = self._at
            size = 8 * len(entries)
            self._put(struct.pack(f"<BQHI{len(entries)}Q", Opcode.MESSAGE_INDEX, 6 + size, channel, size, *entries))
        self._chunks.append(
            ChunkIndex(length, begin, "zstd", len(packed), last, self._at - indexes, offsets, first, len(data))
        )

    def _statistics(self) -> Statistics:
        written = self._counts.total()
        return Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunks),
            message_count=written,
            message_end_time=self._last,
            message_start_time=self._first if written else 0,
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )

    def _record(self, record: McapRecord) -> int:
        """Write a record; returns its length."""
        builder = RecordBuilder()
        record.write(builder)
        data: bytes = builder.end()  # type: ignore[no-untyped-call]
        self._put(data)
        return len(data)

    def _put(self, data: bytes) -> None:
        self._stream.write(data)
        self._crc = zlib.crc32(data, self._crc)
        self._at += len(data)
