"""The table of common effects, each as words and as a shape of path; ``phrases`` reads it in both directions.

A shape lists the interactions from the camera outward: event type (or none), scattering (``D G S``, several of them, or ``X`` for any),
then ``@a`` or ``@b`` where the words name an object, ``!`` at the surface that is seen, and how often it comes: once, ``+``, ``*``, or
``#``, once or more, which the words may count.
"""

import re
from dataclasses import dataclass, field
from typing import NamedTuple


class Item(NamedTuple):
    """One interaction of a shape; ``slot``: which name of the words its object has; ``seen``: this surface is the one that is seen."""

    type: str
    scattering: str
    slot: str
    seen: bool
    times: str


class Effect(NamedTuple):
    """``words`` with slots ``{a}``, ``{b}`` for objects and ``{source}`` for the emitter; ``shape`` as the module says."""

    words: str
    shape: tuple[Item, ...]

    @property
    def seen(self) -> Item | None:
        """The surface that is seen: words may say which object, which region, and by way of which mirror or glass."""
        return next((item for item in self.shape if item.seen), None)

    @property
    def counted(self) -> bool:
        """Whether the words may count an interaction."""
        return any(item.times == "#" for item in self.shape)


class Source(NamedTuple):
    """The emitter at the end of a path: its event types, sorted, and its name."""

    types: str = "L"
    name: str | None = None


class Surface(NamedTuple):
    """The surface that is seen: how it scatters (empty: anyhow), its object, the region where it is seen."""

    scattering: str = "D"
    object: str | None = None
    region: str | None = None


class View(NamedTuple):
    """The mirror (R) or glass (T) by way of which it is seen."""

    type: str
    object: str | None = None


@dataclass(frozen=True)
class Phrase:
    """What a short phrase says. ``times``: how often the counted interaction comes, and whether it may come more often."""

    effect: Effect
    names: dict[str, str] = field(default_factory=dict)
    source: Source = field(default_factory=Source)
    surface: Surface | None = None
    view: View | None = None
    times: tuple[int, bool] = (1, True)


_ITEM = re.compile(r"([RT]?)(X|[DGS]+)(?:@([ab]))?(!?)([+*#]?)")


def _effect(words: str, shape: str) -> Effect:
    items = []
    for text in shape.split():
        found = _ITEM.fullmatch(text)
        assert found, text
        items.append(Item(found[1], found[2].replace("X", ""), found[3] or "", bool(found[4]), found[5]))
    return Effect(words, tuple(items))


EFFECTS = (
    _effect("{source} seen directly", ""),
    _effect("{source} seen through {a}", "TS@a+"),
    _effect("mirror reflection of {source}", "RS+"),
    _effect("mirror reflection of {source} in {a}", "RS@a+"),
    _effect("mirror reflection of {b}", "RS+ X@b X*"),
    _effect("mirror reflection of {b} in {a}", "RS@a+ X@b X*"),
    _effect("view of {b} through {a}", "TS@a+ X@b X*"),
    _effect("light seen through {a}", "TS@a+ X*"),
    _effect("light seen through clear objects", "TS+ X*"),
    _effect("light mirrored in {a}", "RS@a+ X*"),
    _effect("light seen in mirrors", "RS+ X*"),
    _effect("direct glossy light", "G!"),
    _effect("glossy indirect light", "G! X+"),
    _effect("direct light", "D!"),
    _effect("color bleeding from {a}", "D! D@a X*"),
    _effect("one-bounce color bleeding from {a}", "D! D@a"),
    _effect("diffuse indirect light", "D! D+"),
    _effect("indirect light", "D! X+"),
    _effect("caustic", "D! S#"),
    _effect("refractive caustic", "D! TS#"),
    _effect("reflective caustic", "D! RS#"),
    _effect("caustic through {a}", "D! TS@a#"),
    _effect("caustic off {a}", "D! RS@a#"),
    _effect("caustic by way of {a}", "D! S@a#"),
    _effect("all diffuse, glossy and specular light", "X! DGS*"),
    _effect("all scattered light", "X! X*"),
    _effect("all light", "X*"),
)
