"""Messages: texts whose quantities keep their kinds until it is known in which units to print them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NoReturn, Protocol

from pairsim.runtime.plain import Plain

PLACE = "{}"


class InUnits(Protocol):
    """An object that may fill a place of a message, such as a quantity: `str` gives its dimensionless text.

    `in_units` gives its text in units. `scales` is a `pairsim.quantities.scales.Scales`, or None for no units; it is
    typed as Any because this package may not import that one.
    """

    def in_units(self, scales: Any) -> str: ...


class Message:
    """A text with quantities in it: `Message("no steady state below d = {}", LENGTH(0.19))`.

    Messages are composed by `+`, by `joined`, or by filling a place of another message. In an f-string they raise a
    TypeError, since their quantities would silently become dimensionless text.

    Args:
        template: The text, with {} for each place.
        places: The contents of the places, in order: quantities, messages, texts or whole numbers.

    Raises:
        ValueError: The number of places in the template differs from that of their contents.
    """

    def __init__(self, template: str, *places: InUnits | str | int) -> None:
        texts = template.split(PLACE)
        if len(texts) != len(places) + 1:
            raise ValueError(f"{len(places)} values for {len(texts) - 1} places in {template!r}")
        parts: list[str | InUnits] = [texts[0]]
        for place, text in zip(places, texts[1:], strict=True):
            parts += place.parts if isinstance(place, Message) else [str(place) if isinstance(place, int) else place]
            parts.append(text)
        self.parts: tuple[str | InUnits, ...] = tuple(part for part in parts if part != "")

    @classmethod
    def joined(cls, between: str, texts: Iterable[Text]) -> Message:
        """Join texts into one message, with the text `between` from one to the next, as `str.join` does."""
        each = [*texts]
        return cls(between.join([PLACE] * len(each)), *each)

    def __str__(self) -> str:
        """The text without units, in which quantities are dimensionless."""
        return "".join(map(str, self.parts))

    def in_units(self, scales: Any) -> str:
        """The text with its quantities in units, or without units if `scales` is None."""
        return "".join(part if isinstance(part, str) else part.in_units(scales) for part in self.parts)

    def __add__(self, text: Text) -> Message:
        return Message(PLACE + PLACE, self, text)

    def __radd__(self, text: str) -> Message:
        return Message(PLACE + PLACE, text, self)

    def __bool__(self) -> bool:
        return bool(self.parts)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Message) and self.parts == other.parts

    def __hash__(self) -> int:
        return hash(self.parts)

    def __repr__(self) -> str:
        return f"Message({str(self)!r})"

    def __format__(self, _: str) -> NoReturn:
        raise TypeError(
            f"{self!r} would lose its quantities in an f-string; give it a place in a Message, or use str()"
        )


Text = str | Message
type Said = Plain | Message | Sequence[Said] | Mapping[str, Said]
"""Plain data in which texts may be messages: an entry of a record before its units are known."""


def in_units(text: Text, scales: Any) -> str:
    """A text, with the quantities of a message in units; see `Message.in_units`."""
    return text if isinstance(text, str) else text.in_units(scales)


def entries_in_units(entry: Any, scales: Any) -> Any:
    """An entry of a record, such as a list or a mapping, with all messages in it as texts in units."""
    if isinstance(entry, Message):
        return entry.in_units(scales)
    if isinstance(entry, dict):
        return {key: entries_in_units(value, scales) for key, value in entry.items()}
    if isinstance(entry, list | tuple):
        return [entries_in_units(value, scales) for value in entry]
    return entry
