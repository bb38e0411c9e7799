"""MCAP at the level of its bytes: what is certainly intact, and what can be saved of a damaged file.

The library's readers check chunks and, on request, the data section; nobody checks attachments, and of an unfinished
file they return nothing at all. Here a file is a sequence of records, opcode (1 byte), length (8), content
(https://mcap.dev/spec), walked over without trusting any number in it.
"""

from __future__ import annotations

import struct
import zlib
from array import array
from collections.abc import Iterator
from io import BytesIO

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, Chunk, Metadata
from mcap.stream_reader import get_chunk_data_stream

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK = 0x01, 0x02, 0x03, 0x04, 0x05, 0x06
ATTACHMENT, METADATA, DATA_END = 0x09, 0x0C, 0x0F
CHUNK_LIMIT = 1 << 28  # bytes of a decompressed chunk; ours are about 1 MB

_HEAD = struct.Struct("<BQ")
_FOOTER = struct.Struct("<BQQQI")  # opcode, length, summary start, summary offset start, CRC
_DATA_END = struct.Struct("<BQI")  # opcode, length, CRC
_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
_WHOLE_MESSAGE = struct.Struct("<BQHIQQ")  # with opcode and length


class DamagedError(ValueError):
    """Bytes that are no intact MCAP file; str() says what is wrong."""


class Messages:
    """The messages of a topic, in file order: half a million Python objects less than one each.

    Attributes:
        times: log times [ns]. data: their JSON texts, each followed by a comma.
    """

    def __init__(self) -> None:
        self.times = array("Q")
        self.data = bytearray()


def check_intact(data: bytes) -> None:
    """Check every byte of a finished file against its checksums.

    The data section's CRC covers everything up to the DataEnd record, the summary's everything from there to the
    footer; what is left (those two records' own heads, the end magic) has only one possible value. So no edit of up
    to 32 adjacent bits, in particular of one byte anywhere, goes unseen.

    Raises:
        DamagedError: the file is cut or edited, or is no MCAP file, or was written without checksums.
    """
    if not data.startswith(MAGIC):
        raise DamagedError("not an MCAP file")
    footer = len(data) - len(MAGIC) - _FOOTER.size
    if footer < len(MAGIC) or not data.endswith(MAGIC):
        raise DamagedError("the file is cut off")
    opcode, length, summary, _, summary_crc = _FOOTER.unpack_from(data, footer)
    end = summary - _DATA_END.size
    if (opcode, length) != (FOOTER, _FOOTER.size - _HEAD.size) or not len(MAGIC) <= end < footer:
        raise DamagedError("the footer is damaged")
    if summary_crc != zlib.crc32(data[summary : footer + _FOOTER.size - 4]):
        raise DamagedError("the summary does not match its checksum")
    opcode, length, data_crc = _DATA_END.unpack_from(data, end)
    if (opcode, length) != (DATA_END, 4) or data_crc != zlib.crc32(data[:end]):
        raise DamagedError("the contents do not match their checksum")


def records(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Opcode and content of every whole record after the magic; ends quietly where the file does.

    Raises:
        DamagedError: the file does not start as MCAP files do.
    """
    if not data.startswith(MAGIC):
        raise DamagedError("not an MCAP file")
    at = len(MAGIC)
    while at + _HEAD.size <= len(data):
        opcode, length = _HEAD.unpack_from(data, at)
        at += _HEAD.size
        if opcode == 0 or length > len(data) - at:
            return
        yield opcode, data[at : at + length]
        at += length


class Contents:
    """What can be read of a file: attachments, metadata, messages by topic.

    Attributes:
        profile: the header's profile.
        attachments, metadata: by name.
        messages: by topic, in file order.
        finished: whether the data section was properly ended.
        problems: chunks and records that had to be given up, one line each.
    """

    def __init__(self, data: bytes) -> None:
        self.profile = ""
        self.attachments: dict[str, bytes] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self.messages: dict[str, Messages] = {}
        self.finished = False
        self.problems: list[str] = []
        self._topics: dict[int, Messages] = {}
        damaged = 0
        for opcode, content in records(data):
            if opcode == DATA_END:
                self.finished = True
                break
            try:
                self._take(opcode, content)
            except UNREADABLE:
                damaged += 1
        if damaged:
            self.problems.append(f"{damaged} damaged blocks were left out")
        if not self.finished:
            self.problems.append("the file ends early: it was not closed")

    def _take(self, opcode: int, content: bytes) -> None:
        if opcode == CHUNK:
            self._take_chunk(chunk_records(content))
        elif opcode == MESSAGE:
            channel, _, time, _ = _MESSAGE.unpack_from(content)
            self._topics[channel].times.append(time)
            self._topics[channel].data += content[_MESSAGE.size :] + b","
        elif opcode == CHANNEL:
            record = Channel.read(stream_of(content))
            self._topics[record.id] = self.messages.setdefault(record.topic, Messages())
        elif opcode == HEADER:
            self.profile = stream_of(content).read_prefixed_string()
        elif opcode == METADATA:
            metadata = Metadata.read(stream_of(content))
            self.metadata[metadata.name] = metadata.metadata
        elif opcode == ATTACHMENT:
            self._take_attachment(content)

    def _take_chunk(self, data: bytes) -> None:
        """Records of a chunk; a flight has half a million, most of them messages."""
        topics, unpack, size = self._topics, _WHOLE_MESSAGE.unpack_from, _WHOLE_MESSAGE.size
        at, end = 0, len(data)
        data += bytes(size)  # so that every record is as long as the head of a message
        while at < end:
            opcode, length, channel, _, time, _ = unpack(data, at)
            begin, at = at, at + _HEAD.size + length
            if at > end:
                raise DamagedError("a chunk's last record is cut")
            if opcode == MESSAGE:
                topic = topics[channel]
                topic.times.append(time)
                topic.data += data[begin + size : at]
                topic.data += b","
            else:
                self._take(opcode, data[begin + _HEAD.size : at])

    def _take_attachment(self, content: bytes) -> None:
        attachment = intact_attachment(content)
        self.attachments[attachment.name] = attachment.data


def intact_attachment(content: bytes) -> Attachment:
    """An attachment whose checksum fits.

    Raises:
        DamagedError: it does not. Or another of ``UNREADABLE``.
    """
    (crc,) = struct.unpack("<I", content[-4:])
    if crc != zlib.crc32(content[:-4]):
        raise DamagedError("an attachment does not match its checksum")
    attachment: Attachment = Attachment.read(stream_of(content))
    return attachment


def chunk_records(content: bytes) -> bytes:
    """A chunk's records, checked against their checksum: all of them or none.

    Raises:
        One of ``UNREADABLE``: the chunk is damaged.
    """
    chunk = Chunk.read(stream_of(content))
    if chunk.uncompressed_size > CHUNK_LIMIT:
        raise DamagedError("a chunk claims an absurd size")
    stream, size = get_chunk_data_stream(chunk, validate_crc=True)
    return stream.read(size)


def stream_of(content: bytes) -> ReadDataStream:
    """What the library's records are read from."""
    return ReadDataStream(BytesIO(content))


# What damaged bytes make the decoders raise. lz4 reports damage as RuntimeError; KeyError is a message whose channel
# was lost with its chunk.
UNREADABLE = (ValueError, KeyError, struct.error, McapError, zstandard.ZstdError, RuntimeError, MemoryError)
