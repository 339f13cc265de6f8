"""One class of paths in a few words, from the light to the eye: "caustic through glass_ball onto floor from lamp"."""

from collections.abc import Sequence
from functools import lru_cache
from itertools import groupby
from typing import NamedTuple

from queries.errors import QueryError
from queries.lpe.describe import describe_step
from queries.lpe.effects import Source, View
from queries.lpe.phrases import name_words, source_words, view_words
from queries.lpe.syntax import EMITTER_TYPES, EVENT_TYPES, SCATTERING_TYPES, PathEvent, Step, Test, step

_MAX_STOPS = 4  # objects on the way that short words list; past it, the long form


class _Stop(NamedTuple):
    """Interactions one after another at one object, as a unit: ``type`` T if light passes through it."""

    type: str
    scattering: str
    object: str | None


@lru_cache(1024)
def event_of(letter: str) -> PathEvent:
    """The event that a letter such as ``RD``, ``L`` or ``V`` stands for; raises ``QueryError`` for what is none."""
    if not 1 <= len(letter) <= 2 or letter[0] not in EVENT_TYPES or (len(letter) == 2 and letter[1] not in SCATTERING_TYPES):
        raise QueryError(f"expected an event type (C R T V L O B) and perhaps a scattering type (D G S s x), found {letter[:20]!r}")
    return PathEvent(letter[0], None if letter[1:] in ("", "x") else letter[1:])


@lru_cache(16_384)
def class_step(letter: str, name: str | None) -> Step:
    """The step of one letter; ``name``: of its object or, of the last letter, of the light; None is any."""
    event = event_of(letter)
    field = "light" if event.type in EMITTER_TYPES else "object"
    scattering = Test("scattering", frozenset(event.scattering or "x")) if event.type in "RTV" else None
    return step(Test("type", frozenset(event.type)), scattering, None if name is None else Test(field, frozenset({name})))


def aligned(letters: Sequence[str], objects: Sequence[str | None] | None) -> Sequence[str | None]:
    """The objects of a class, one for each letter. Raises ``QueryError`` for letters that are no path, and for other numbers of objects."""
    types = "".join([event_of(letter).type for letter in letters])
    if len(types) < 2 or types[0] != "C" or types[-1] not in EMITTER_TYPES or types[1:-1].strip("RTV"):
        raise QueryError(
            f"expected the letters of a path (a camera `C`, interactions such as `RD` or `TS`, a light), found {' '.join(letters)[:200]!r}"
        )
    if objects is not None and len(objects) != len(letters):
        raise QueryError(f"expected an object or None for each of the {len(letters)} letters, found {len(objects)}")
    return [None] * len(letters) if objects is None else objects


def describe_class(letters: Sequence[str], objects: Sequence[str | None] | None = None) -> str:
    """Short words for a class of paths, with the names of its objects; the long form where the way is long or leads through a volume.

    ``objects``: a name or None for each letter (the camera's is None, the last is the light). Raises ``QueryError`` for what is no class.

    >>> describe_class(["C", "RD", "TS", "TS", "L"], [None, "floor", "glass_ball", "glass_ball", "lamp"])
    'caustic through glass_ball onto floor from lamp'
    """
    names = aligned(letters, objects)
    events = [event_of(letter) for letter in letters]
    source = Source(events[-1].type, names[-1])
    bounces = [_Stop(event.type, event.scattering or "x", name) for event, name in zip(events[1:-1], names[1:-1], strict=True)]
    seen_by_way = [bounce for bounce in bounces if bounce.scattering != "s"]
    if any(stop.type == "V" or stop.scattering == "x" for stop in seen_by_way):
        return _long(letters, names)

    # The specular start of the way from the camera, the surface that it shows, and how light gets there.
    rough = next((i for i, stop in enumerate(seen_by_way) if stop.scattering != "S"), len(seen_by_way))
    view, surface, way = _stops(seen_by_way[:rough]), seen_by_way[rough : rough + 1], _stops(seen_by_way[rough + 1 :])
    if len(view) > _MAX_STOPS or len(way) > _MAX_STOPS:
        return _long(letters, names)
    seen = ", then".join(view_words(View(stop.type, stop.object)) for stop in reversed(view))
    if not surface:
        return source_words(source) + (seen or " seen directly")
    onto = f" onto {name_words(surface[0].object)}" if surface[0].object else ""
    return _effect(surface[0], way) + onto + _from(source) + seen


def _long(letters: Sequence[str], names: Sequence[str | None]) -> str:
    """The class event by event."""
    return ", then ".join([_letter_words(letter, name) for letter, name in zip(letters, names, strict=True)])


@lru_cache(16_384)
def _letter_words(letter: str, name: str | None) -> str:
    return describe_step(class_step(letter, name))


def _stops(bounces: Sequence[_Stop]) -> list[_Stop]:
    """Specular interactions at the same object as one: a path into, around inside and out of glass goes through it."""
    found: list[_Stop] = []
    for (name, scattering), run in groupby(bounces, key=lambda stop: (stop.object, stop.scattering)):
        same = list(run)
        if scattering == "S":
            found.append(_Stop("T" if any(stop.type == "T" for stop in same) else "R", scattering, name))
        else:
            found.extend(same)
    return found


def _effect(surface: _Stop, way: Sequence[_Stop]) -> str:
    """What light does at the surface that is seen, and which way it came."""
    glossy = surface.scattering == "G"
    if not way:
        return "direct glossy light" if glossy else "direct light"
    caustic = all(stop.scattering == "S" for stop in way)
    named = all(stop.object is not None for stop in way)
    by_way = ", then".join(
        f" {'through' if stop.type == 'T' else 'off'} {name_words(stop.object)}" for stop in reversed(way) if stop.object is not None
    )
    if caustic:
        kind = "" if named else "refractive " if any(stop.type == "T" for stop in way) else "reflective "
        return f"{kind}caustic{by_way if named else ''}{' onto gloss' if glossy and not surface.object else ''}"
    kind = "glossy indirect light" if glossy else "diffuse indirect light"
    return kind + (by_way if named else f" of {len(way) + 1} bounces")


def _from(source: Source) -> str:
    if source == Source():
        return ""
    return f" from {name_words(source.name) if source.types == 'L' and source.name is not None else source_words(source)}"
