"""High-level descriptors: what an artist calls a class of paths, such as direct light, a caustic or a reflection (thesis 9.4.2).

A class is a sequence of letters from the camera outward, event type and scattering type together: ``C RD TS TS L``. Each descriptor is
defined by an expression; together they are a partition: every class has exactly one.
"""

from collections.abc import Sequence
from functools import cache, lru_cache
from typing import NamedTuple

from queries.errors import QueryError
from queries.lpe.class_words import aligned, class_step, describe_class, event_of
from queries.lpe.compile import Expression, compile
from queries.lpe.printer import show

__all__ = ["DESCRIPTORS", "Descriptor", "class_expression", "describe_class", "descriptor", "descriptor_expression"]


class Descriptor(NamedTuple):
    """``expression`` (standard notation) selects the paths of all its classes; ``meaning`` says in words what they have in common."""

    name: str
    expression: str
    meaning: str


# What the rows below are made of. Straight transmission changes nothing that is seen, so it may stand anywhere.
_STRAIGHT = "<[RT]s>*"
_ROUGH = "<[RT][DG]>"
_ANY = "<[RT][DGSs]>*"
_SPECULAR = "<[RT][Ss]>*"
_MIRRORS = "<[RT]s>* <RS> [<RS><[RT]s>]*"  # seen in mirrors only
_GLASS = "[<RS><[RT]s>]* <TS> <[RT][Ss]>*"  # seen through at least one clear surface
_REFLECTIVE = f"{_MIRRORS} [LOB]"
_REFRACTIVE = f"{_GLASS} [LOB]"
_LIT = f"{_ROUGH} ({_STRAIGHT} | {_ANY} {_ROUGH} {_ANY}) [LOB]"  # a surface, and light on it that is no caustic
_CAUSTIC = f"{_ROUGH} {_SPECULAR} <[RT]S> {_SPECULAR} [LOB]"

DESCRIPTORS = (
    Descriptor("emission", f"C {_STRAIGHT} [LO]", "a light or glowing object, seen directly"),
    Descriptor("background", f"C {_STRAIGHT} B", "the background, seen directly"),
    Descriptor("direct", f"C {_STRAIGHT} <[RT]D> {_STRAIGHT} [LOB]", "light that was scattered once, diffusely"),
    Descriptor("direct glossy", f"C {_STRAIGHT} <[RT]G> {_STRAIGHT} [LOB]", "light that was scattered once, by a glossy lobe: blurred highlights"),
    Descriptor("diffuse indirect", f"C {_STRAIGHT} <[RT]D> {_ANY} {_ROUGH} {_ANY} [LOB]", "diffuse surfaces lit by other rough surfaces"),
    Descriptor("glossy indirect", f"C {_STRAIGHT} <[RT]G> {_ANY} {_ROUGH} {_ANY} [LOB]", "glossy surfaces that show other rough surfaces"),
    Descriptor("reflective caustic", f"C {_STRAIGHT} {_ROUGH} {_REFLECTIVE}", "light that mirrors cast on a rough surface"),
    Descriptor("refractive caustic", f"C {_STRAIGHT} {_ROUGH} {_REFRACTIVE}", "light that clear objects cast on a rough surface"),
    Descriptor("reflected emission", f"C {_MIRRORS} [LO]", "lights seen in mirrors: sharp highlights"),
    Descriptor("reflected background", f"C {_MIRRORS} B", "the background seen in mirrors"),
    Descriptor("reflection", f"C {_MIRRORS} {_LIT}", "lit surfaces seen in mirrors"),
    Descriptor("reflected caustic", f"C {_MIRRORS} {_CAUSTIC}", "caustics seen in mirrors"),
    Descriptor("transmitted emission", f"C {_GLASS} [LO]", "lights seen through clear objects"),
    Descriptor("transmitted background", f"C {_GLASS} B", "the background seen through clear objects"),
    Descriptor("transmission", f"C {_GLASS} {_LIT}", "lit surfaces seen through clear objects"),
    Descriptor("transmitted caustic", f"C {_GLASS} {_CAUSTIC}", "caustics seen through clear objects"),
    Descriptor("volume", "C .* V .* [LOB]", "light that was scattered in a volume"),
    Descriptor("other", f"C {_ANY} <[RT][^DGSs]> <[RT].>* [LOB]", "paths with an event of unknown scattering"),
)


def descriptor(letters: Sequence[str]) -> str:
    """The name of the one descriptor of a class.

    ``letters``: ``C``, then event types with scattering types, then ``L``, ``O`` or ``B``. Raises ``QueryError`` for what is no path.

    >>> descriptor(["C", "RD", "TS", "TS", "L"])
    'refractive caustic'
    """
    name = _at_state(_after(tuple(letters)))
    if name is None:
        raise QueryError(
            f"expected the letters of a path (a camera `C`, interactions such as `RD` or `TS`, a light), found {' '.join(letters)[:200]!r}"
        )
    return name


def descriptor_expression(name: str) -> str:
    """The expression that selects the paths of all classes of a descriptor. Raises ``QueryError`` for a name that none has."""
    found = {row.name: row.expression for row in DESCRIPTORS}.get(name)
    if found is None:
        raise QueryError(f"expected one of the descriptors {', '.join(row.name for row in DESCRIPTORS)}, found `{name[:100]}`")
    return found


def class_expression(letters: Sequence[str], objects: Sequence[str | None] | None = None) -> str:
    """The expression, in the standard notation, that selects exactly the paths of a class.

    ``objects``: a name or None (any) for each letter; the camera's is None, the last is the light. Raises ``QueryError`` for what is no class.

    >>> class_expression(["C", "RD", "TS", "L"], [None, "floor", "glass ball", "lamp"])
    "C <RD>@object:floor <TS>@object:'glass ball' L@light:lamp"
    """
    return " ".join([_shown(letter, name) for letter, name in zip(letters, aligned(letters, objects), strict=True)])


@lru_cache(16_384)
def _shown(letter: str, name: str | None) -> str:
    """One letter of a class in the standard notation."""
    return show(class_step(letter, name))


@cache
def _compiled() -> tuple[Expression, ...]:
    return tuple(compile(row.expression) for row in DESCRIPTORS)


@cache
def _symbols(letter: str) -> tuple[int, ...]:
    """The symbol of a letter in each descriptor's alphabet."""
    event = event_of(letter)
    return tuple(int(expression.alphabet.symbols_of([event])[0]) for expression in _compiled())


@cache
def _next(states: tuple[int, ...], letter: str) -> tuple[int, ...]:
    """The states of all the automata after one more letter; few tuples occur, so each step is looked up but once."""
    return tuple(
        int(expression.dfa.transitions[state, symbol]) for expression, state, symbol in zip(_compiled(), states, _symbols(letter), strict=True)
    )


def _after(letters: tuple[str, ...]) -> tuple[int, ...]:
    states = (0,) * len(DESCRIPTORS)
    for letter in letters:
        states = _next(states, letter)
    return states


@cache
def _at_state(states: tuple[int, ...]) -> str | None:
    """The descriptor whose automaton accepts."""
    found = [row.name for row, expression, state in zip(DESCRIPTORS, _compiled(), states, strict=True) if expression.dfa.accepting[state]]
    return found[0] if found else None
