"""A Puck's properties in RAM and EEPROM, and the commands SAVE, LOAD and DEF between them."""

from collections.abc import Mapping

ALL = -1
_LOCKED = frozenset({"VERS", "ROLE", "SN", "ID"})


class Memory:
    """Named values.

    Args:
        factory: what DEF restores; EEPROM and RAM start with it.
    """

    def __init__(self, factory: Mapping[str, int]) -> None:
        self._factory = dict(factory)
        self._kept = dict(factory)
        self._present = dict(factory)

    def value(self, name: str) -> int:
        """The value in RAM; 0 for one that nothing was ever stored in."""
        return self._present.get(name, 0)

    def store(self, name: str, value: int, names: Mapping[int, str]) -> None:
        """Obey a SET: of a value, or of one of the three commands.

        Args:
            name: the property.
            value: what it is set to; for a command the id of another property, or `ALL`.
            names: this Puck's properties by id.
        """
        commands = {
            "SAVE": (self._present, self._kept),
            "LOAD": (self._kept, self._present),
            "DEF": (self._factory, self._kept),
        }
        if name in commands:
            source, target = commands[name]
            chosen = names.get(value)
            target.update({k: v for k, v in source.items() if value == ALL or k == chosen})
        elif name not in _LOCKED:
            self._present[name] = value

    def put(self, name: str, value: int) -> None:
        """Change a value from inside."""
        self._present[name] = value

    def restart(self) -> None:
        """Start again with what is kept in EEPROM."""
        self._present = dict(self._kept)
