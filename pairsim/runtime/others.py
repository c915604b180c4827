"""Work that is shared with other processes, whichever way these are started."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Iterator, Sequence
from typing import Any, Protocol


class Others[P, T](Protocol):
    """Other processes, which find results T at places P at the same time as this one."""

    def share(self, places: Sequence[P]) -> Sequence[P]:
        """Give places to them; returns those that are left to this process."""

    def come(self) -> Iterator[tuple[P, T]]:
        """Yield what they have found since this was asked last."""

    def rest(self, meanwhile: Callable[[], bool]) -> Iterator[tuple[P, T]]:
        """Yield what they find until they have ended, whether or not they have found all.

        Args:
            meanwhile: Does something while they are at work; returns whether there was anything to do.
        """


class Nobody:
    """No other process."""

    def share[P](self, places: Sequence[P]) -> Sequence[P]:
        """All places are left to this process."""
        return places

    def come(self) -> Iterator[Any]:
        """Yield nothing."""
        return iter(())

    def rest(self, meanwhile: Callable[[], bool]) -> Iterator[Any]:
        """Yield nothing."""
        return iter(())


NOBODY = Nobody()


def found_by_all[P: Hashable, T](
    places: Sequence[P],
    find: Callable[[P], T],
    others: Others[P, T] = NOBODY,
    meanwhile: Callable[[Collection[P]], bool] = lambda _: False,
    *,
    in_order: bool = False,
) -> Iterator[tuple[P, T]]:
    """Find results at places, as far as other processes do not.

    What they have not found is found at last by this process, as it would be without them.

    Args:
        places: The places.
        find: What this process does at a place.
        others: The other processes.
        meanwhile: Called while they are at work with the places whose results are still to come; returns whether there
            was anything to do.
        in_order: Whether results are wanted in the order of the places; otherwise as soon as they are there.

    Yields:
        Each place with its result.
    """
    later, done = dict[P, T](), set[P]()

    def taken(found: Iterator[tuple[P, T]]) -> Iterator[tuple[P, T]]:
        for place, result in found:
            done.add(place)
            if in_order:
                later[place] = result
            else:
                yield place, result

    for place in others.share(places):
        yield place, find(place)
        done.add(place)
        yield from taken(others.come())
    yield from taken(others.rest(lambda: meanwhile({*places} - done)))
    for place in places:
        if place in later:
            yield place, later[place]
        elif place not in done:
            yield place, find(place)
