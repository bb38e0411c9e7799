"""Parameter values, their writing rules and their persistent storage (firmware param_logic.c)."""

from __future__ import annotations

from collections.abc import Collection, MutableMapping

from deploy.radio.simulated.toc import EXTENDED, PARAM_STRUCTS, READ_ONLY, Toc

_CONTROLLERS = 6  # the firmware falls back to its default for values from here on
_DEFAULT_CONTROLLER = 1  # PID


class Parameters:
    """All parameters of one drone, by index and by name.

    Attributes:
        version: rises with every write.

    Args:
        toc: the table of contents with the defaults.
        storage: persistent values by name; survives a reboot because its owner does.
    """

    def __init__(self, toc: Toc, storage: MutableMapping[str, bytes]) -> None:
        self.toc = toc
        self.version = 0
        self._storage = storage
        self._structs = [PARAM_STRUCTS[entry.type & 0x0F] for entry in toc.entries]
        self._raw = [storage.get(entry.full_name, entry.default) for entry in toc.entries]
        self._values: dict[str, float] = {
            entry.full_name: self._structs[i].unpack(self._raw[i])[0] for i, entry in enumerate(toc.entries)
        }

    def __getitem__(self, name: str) -> float:
        """The present value of ``group.name``."""
        return self._values[name]

    def __len__(self) -> int:
        return len(self._raw)

    def get(self, name: str, default: float) -> float:
        """The present value, or ``default`` in builds without that parameter."""
        return self._values.get(name, default)

    def changed(self, groups: Collection[str]) -> dict[str, float]:
        """The values of these groups that are not the defaults, by full name."""
        return {
            entry.full_name: self._values[entry.full_name]
            for entry, raw in zip(self.toc.entries, self._raw, strict=True)
            if raw != entry.default and entry.group in groups
        }

    def set(self, name: str, value: float) -> None:
        """The firmware's own change of a value."""
        index = self.toc.index[name]
        self._store(index, self._structs[index].pack(value))

    def raw(self, index: int) -> bytes:
        """The value as it travels."""
        return self._raw[index]

    def is_writable(self, index: int) -> bool:
        """Whether clients may write it."""
        return not self.toc.entries[index].type & READ_ONLY

    def is_persistent(self, index: int) -> bool:
        """Whether it can be stored (all extended parameters of the firmware can)."""
        return bool(self.toc.entries[index].type & EXTENDED)

    def write(self, index: int, data: bytes) -> bool:
        """A client's write; surplus bytes are ignored. False if there are too few."""
        size = self._structs[index].size
        if len(data) < size:
            return False
        self._store(index, data[:size])
        return True

    def default(self, index: int) -> bytes:
        """The value after a boot with empty storage."""
        return self.toc.entries[index].default

    def stored(self, index: int) -> bytes | None:
        """The stored value, if there is one."""
        return self._storage.get(self.toc.entries[index].full_name)

    def store(self, index: int) -> None:
        """Keep the present value over reboots."""
        self._storage[self.toc.entries[index].full_name] = self._raw[index]

    def clear(self, index: int) -> None:
        """Forget the stored value; the present one stays."""
        self._storage.pop(self.toc.entries[index].full_name, None)

    def _store(self, index: int, raw: bytes) -> None:
        name = self.toc.entries[index].full_name
        value = self._structs[index].unpack(raw)[0]
        if name == "stabilizer.controller" and not 0 < value < _CONTROLLERS:
            value, raw = _DEFAULT_CONTROLLER, self._structs[index].pack(_DEFAULT_CONTROLLER)
        self._raw[index], self._values[name] = raw, value
        self.version += 1
