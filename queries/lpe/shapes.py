"""Short phrases to syntax trees and back: which trees have the shape of a common effect."""

from typing import NamedTuple

from queries.errors import ExpressionError
from queries.lpe.direction import camera_first
from queries.lpe.effects import EFFECTS, Effect, Item, Phrase, Source, Surface, View
from queries.lpe.limits import Work
from queries.lpe.parser import combines
from queries.lpe.syntax import Chain, Node, Repeat, Step, Test, sequence, step

_INTERACTIONS = frozenset("RTV")
_MAX_ATOMS = 1_100  # interactions, repetitions written out, of an expression that a phrase may describe


class _Atom(NamedTuple):
    """One interaction as phrases know it; ``types`` and ``scattering`` are sorted letters, empty where they are not tested."""

    types: str
    scattering: str
    object: str | None = None
    region: str | None = None
    star: bool = False  # comes any number of times, else once


# --- phrase to tree -----------------------------------------------------------------------------------------------


def parts(phrase: Phrase) -> list[Node]:
    """The parts of the expression, from the camera outward."""
    found: list[Node] = [step(Test("type", frozenset("C")))]
    if phrase.view:
        found.append(Repeat(_step(phrase.view.type, "S", phrase.view.object, None), 1, None))
    for item in phrase.effect.shape:
        if item.seen and phrase.surface:
            found.append(_step(item.type, phrase.surface.scattering, phrase.surface.object, phrase.surface.region))
            continue
        one = _step(item.type, item.scattering, phrase.names.get(item.slot), None)
        low, more = phrase.times if item.times == "#" else (int(item.times != "*"), item.times != "")
        found.append(one if (low, more) == (1, False) else Repeat(one, low, None if more else low))
    light = None if phrase.source.name is None else Test("light", frozenset({phrase.source.name}))
    return [*found, step(Test("type", frozenset(phrase.source.types)), light)]


def tree_of(phrase: Phrase) -> Node:
    """The expression of a phrase."""
    return sequence(parts(phrase))


def _step(types: str, scattering: str, name: str | None, region: str | None) -> Step:
    tests = [
        Test("type", frozenset(types) if types else _INTERACTIONS) if types or not scattering else None,
        Test("scattering", frozenset(scattering)) if scattering else None,
        Test("object", frozenset({name})) if name is not None else None,
        Test("region", frozenset({region})) if region is not None else None,
    ]
    return step(*tests)


# --- tree to phrase -----------------------------------------------------------------------------------------------


def recognize(tree: Node) -> Phrase | None:
    """The first common effect that selects exactly the paths that a tree does; None where there is none."""
    whole = _chain(tree)
    if whole is None:
        return None
    inside, source = whole
    for effect in EFFECTS:
        phrase = _as_effect(effect, inside, source)
        if phrase:
            return phrase
    return None


def _chain(tree: Node) -> tuple[list[_Atom], Source] | None:
    """The interactions and the emitter of an expression that is one plain chain from the camera."""
    if combines(tree):
        return None
    try:
        tree = camera_first(tree, Work())
    except ExpressionError:  # too large: no common effect
        return None
    nodes = tree.parts if isinstance(tree, Chain) else (tree,)
    camera, last = nodes[0], nodes[-1]
    if len(nodes) < 2 or camera != step(Test("type", frozenset("C"))) or not isinstance(last, Step):
        return None
    source = _source(last)
    inside = _atoms(nodes[1:-1])
    return None if source is None or inside is None else (inside, source)


def _source(last: Step) -> Source | None:
    tests = {test.field: test for test in last.tests if test.mode == "in"}
    kind, light = tests.get("type"), tests.get("light")
    if len(tests) < len(last.tests) or not tests.keys() <= {"type", "light"} or kind is None or (light and len(light.names) > 1):
        return None
    types = "".join(sorted(kind.names))
    return Source(types, next(iter(light.names)) if light else None) if types in ("L", "B", "O", "BLO") else None


def _atoms(nodes: tuple[Node, ...]) -> list[_Atom] | None:
    """Interactions with repetitions written out, what must come before what may: ``D+`` is ``D D*``, and ``D* D`` too."""
    found: list[_Atom] = []
    for node in nodes:
        one, low, high = (node.part, node.low, node.high) if isinstance(node, Repeat) else (node, 1, 1)
        atom = _atom(one) if isinstance(one, Step) else None
        if atom is None or high not in (None, low) or len(found) + low > _MAX_ATOMS:
            return None
        starred = bool(found) and found[-1] == atom._replace(star=True)
        if starred:
            found.pop()
        found += [atom] * low
        if starred or high is None:
            found.append(atom._replace(star=True))
    return found


def _atom(one: Step) -> _Atom | None:
    """A step as phrases know it; None where it tests something else."""
    tests = {test.field: test for test in one.tests if test.mode == "in"}
    if len(tests) < len(one.tests) or not tests.keys() <= {"type", "scattering", "object", "region"}:
        return None
    if any(len(tests[field].names) != 1 for field in ("object", "region") if field in tests):
        return None
    types = tests["type"].names if "type" in tests else _INTERACTIONS
    scattering = tests["scattering"].names if "scattering" in tests else frozenset[str]()
    name, region = (next(iter(tests[field].names)) if field in tests else None for field in ("object", "region"))
    return _Atom("" if types >= _INTERACTIONS else "".join(sorted(types)), "".join(sorted(scattering)), name, region)


def _as_effect(effect: Effect, inside: list[_Atom], source: Source) -> Phrase | None:
    """The phrase that says the interactions with this effect; None where they have another shape."""
    plain = _match(effect, inside)
    if plain:
        return Phrase(effect, plain.names, source, plain.surface, None, plain.times)
    # What is seen by way of a mirror or glass: its interactions come before those of the effect.
    if effect.seen is None or len(inside) < 2:
        return None
    first, more = inside[0], inside[1]
    if first.types not in ("R", "T") or first.scattering != "S" or first.region is not None or more != first._replace(star=True):
        return None
    behind = _match(effect, inside[2:])
    return Phrase(effect, behind.names, source, behind.surface, View(first.types, first.object), behind.times) if behind else None


class _Match(NamedTuple):
    names: dict[str, str]
    surface: Surface | None
    times: tuple[int, bool]


def _match(effect: Effect, inside: list[_Atom]) -> _Match | None:
    """How the interactions fill the slots of an effect's shape."""
    names: dict[str, str] = {}
    surface, times, at = None, (1, True), 0
    for item in effect.shape:
        if item.times == "*":
            if inside[at : at + 1] != [_Atom(item.type, item.scattering, star=True)]:
                return None
            at += 1
            continue
        if at == len(inside) or not _fits(item, inside[at]):
            return None
        atom = inside[at]
        at += 1
        if item.seen:
            surface = Surface(atom.scattering, atom.object, atom.region)
        elif atom.object is not None:
            names[item.slot] = atom.object
        if item.times == "+" and inside[at : at + 1] != [atom._replace(star=True)]:
            return None
        at += item.times == "+"
        if item.times == "#":
            count = 1
            while inside[at : at + 1] == [atom]:
                count, at = count + 1, at + 1
            more = inside[at : at + 1] == [atom._replace(star=True)]
            times, at = (count, more), at + more
    return _Match(names, surface, times) if at == len(inside) else None


def _fits(item: Item, atom: _Atom) -> bool:
    """Whether an interaction may stand where a shape has this item."""
    if atom.star or atom.types != item.type:
        return False
    if item.seen:
        return atom.scattering == "G" if item.scattering == "G" else atom.scattering in ("", "D", "G")
    return atom.scattering == item.scattering and atom.region is None and (atom.object is not None) == bool(item.slot)
