"""Sharing of work with other processes, however these were started."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Iterator, Sequence
from typing import Any, Protocol


class Others[P, T](Protocol):
    """Other processes that compute results of type T at places of type P while this process does the same."""

    def share(self, places: Sequence[P]) -> Sequence[P]:
        """Hand places out to the other processes; returns those that this process must compute itself."""

    def come(self) -> Iterator[tuple[P, T]]:
        """Yield each place and result that the other processes have found since the last call."""

    def rest(self, meanwhile: Callable[[], bool]) -> Iterator[tuple[P, T]]:
        """Yield places and results until the other processes have ended, even if some places then have no result.

        Args:
            meanwhile: Called repeatedly while they compute, to do other work in this process; returns whether there
                was any.
        """


class Nobody:
    """No other process."""

    def share[P](self, places: Sequence[P]) -> Sequence[P]:
        """Return all places: this process must compute them itself."""
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
    """Compute the results at places together with other processes.

    Places at which they end without a result are computed by this process last, as they would be without helpers.

    Args:
        places: The places.
        find: Computes the result at a place in this process.
        others: The other processes.
        meanwhile: Called, while they compute, with the places that have no result yet, to do other work in this
            process; returns whether there was any.
        in_order: Whether the results of the other processes are held back to the end and yielded in the order of the
            places, rather than as soon as they arrive.

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
