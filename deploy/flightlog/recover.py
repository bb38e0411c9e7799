"""A finished, indexed log of whatever is intact in one that was cut or damaged; viewers read nothing else."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

from mcap.records import Channel, Message, Metadata, Schema

from deploy.errors import LogFileError
from deploy.files import write_whole
from deploy.flightlog import container
from deploy.flightlog.container import DamagedError, records, stream_of
from deploy.flightlog.mcapfile import McapFile
from deploy.flightlog.reader import RECOVERED, read_log
from deploy.flightlog.recorder import PROFILE


@dataclass(frozen=True)
class Recovery:
    """What was saved: messages, attachments, and what is missing, one line each."""

    messages: int
    attachments: int
    problems: tuple[str, ...]


def recover(source: Path, target: Path) -> Recovery:
    """Write what is intact of a flight log as a new log; the new file appears whole or not at all.

    Args:
        source: a log that was never closed (``.mcap.part``), cut or damaged. It stays as it is.
        target: the new log; must not exist.

    Raises:
        LogFileError: the source is no flight log, or complete; the target exists or cannot be written.
    """
    found = read_log(source)  # says so if it is no flight log at all
    if found.complete:
        raise LogFileError(f"{source}: the log is complete; there is nothing to recover")
    data = source.read_bytes()
    stream = io.BytesIO()
    copy = _Copy(McapFile(stream, PROFILE))
    for opcode, content in records(data):
        if opcode == container.DATA_END:
            break
        try:
            copy.take(opcode, content)
        except container.UNREADABLE:
            continue  # counted among the problems when the log was read
    copy.file.describe(RECOVERED, {"problems": "; ".join(found.problems)})
    copy.file.finish()
    try:
        write_whole(target, stream.getvalue(), replace=False)
    except FileExistsError as error:
        raise LogFileError(f"{target}: exists already; flight logs are never overwritten") from error
    except OSError as error:
        raise LogFileError(f"{target}: cannot write the recovered log: {error.strerror or error}") from error
    return Recovery(copy.file.written, copy.attachments, found.problems)


class _Copy:
    """Takes records of one file into another."""

    def __init__(self, file: McapFile) -> None:
        self.file = file
        self.attachments = 0
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, int] = {}

    def take(self, opcode: int, content: bytes) -> None:
        """Copy one record outside of chunks, or a chunk. Raises one of ``container.UNREADABLE``."""
        if opcode == container.CHUNK:
            self._take_chunk(container.chunk_records(content))
        elif opcode == container.SCHEMA:
            schema = Schema.read(stream_of(content))
            self._schemas[schema.id] = schema
        elif opcode == container.CHANNEL:
            channel = Channel.read(stream_of(content))
            schema = self._schemas[channel.schema_id]
            self._channels[channel.id] = self.file.declare(channel.topic, schema.name, schema.data, channel.metadata)
        elif opcode == container.METADATA:
            metadata = Metadata.read(stream_of(content))
            self.file.describe(metadata.name, metadata.metadata)
        elif opcode == container.ATTACHMENT:
            attachment = container.intact_attachment(content)
            self.file.attach(attachment.name, attachment.data, attachment.log_time)
            self.attachments += 1

    def _take_chunk(self, data: bytes) -> None:
        messages: list[tuple[int, int, bytes]] = []
        for opcode, content in records(container.MAGIC + data):
            if opcode == container.MESSAGE:
                message = Message.read(stream_of(content), len(content))
                if message.channel_id not in self._channels:
                    raise DamagedError("a chunk's channel was lost")
                messages.append((message.log_time, self._channels[message.channel_id], message.data))
            else:
                self.take(opcode, content)
        self.file.chunk(messages)
