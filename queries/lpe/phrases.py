"""Short phrases for common expressions, and back: "caustic through glass seen in p" is ``C D@p <TS>@object:glass+ L`` (thesis 9.4.1).

A phrase is an effect (``queries.lpe.effects``), then what is known of it, in this order, each part where it applies:

    [ "once" | "twice" | "3 times" | "3 times or more" ]   of a caustic's specular events
    [ "onto" ( floor | "any surface" | "any surface of" floor | "gloss" | "gloss of" floor | … ) ]
    [ "from" ( lamp | "the background" | "the background" sky | "every glowing object" | "every source" | … ) ]
    [ "seen in" p ]                                        a region
    [ "mirrored in" mirror | "seen in mirrors" | "seen through" glass | "seen through clear objects" ]

Names with spaces, and those that could be taken for other words, are quoted. A phrase speaks of diffuse surfaces unless it says "any
surface" (any interaction) or "gloss" (glossy scattering).
"""

import re

from queries.errors import QueryError
from queries.lpe.effects import EFFECTS, Effect, Phrase, Source, Surface, View
from queries.lpe.limits import MAX_REPEAT
from queries.lpe.printer import show
from queries.lpe.shapes import parts, recognize
from queries.lpe.syntax import Node

_MAX_PHRASE = 2_000  # characters
_EMITTERS = {"L": "every emitter", "B": "the background", "O": "every glowing object", "BLO": "every source"}
_NAMED_EMITTERS = {"L": "the emitter", "B": "the background", "O": "the glowing object", "BLO": "the source"}
_SURFACES = {"": "any surface", "G": "gloss", "D": "diffuse surfaces"}  # how the surface scatters
_NEVER_BARE = ("the", "every", "any", "gloss", "diffuse", "mirrors", "clear")  # names that could be taken for other words


def expression_of(phrase: str) -> str:
    """The expression, in the standard notation, that a phrase stands for. Raises ``QueryError`` that lists the phrases that are understood.

    >>> expression_of("caustic through glass_ball seen in p")
    'C D@p <TS>@object:glass_ball+ L'
    >>> expression_of("direct light onto floor from 'desk lamp'")
    "C D@object:floor L@light:'desk lamp'"
    """
    return " ".join(show(part) for part in parts(read(phrase)))


def phrase_of(tree: Node) -> str | None:
    """The short phrase that says exactly what an expression says; None where there is none."""
    found = recognize(tree)
    return None if found is None else words(found)


# --- phrase to words and back -------------------------------------------------------------------------------------


def words(phrase: Phrase) -> str:
    """The phrase in words."""
    said = phrase.effect.words.format(source=source_words(phrase.source), **{slot: name_words(name) for slot, name in phrase.names.items()})
    said += _times_words(*phrase.times) if phrase.effect.counted else ""
    surface = phrase.surface
    if surface and (surface.object is not None or surface.scattering != _seen_scattering(phrase.effect)):
        said += " onto " + surface_words(surface, _seen_scattering(phrase.effect))
    if "{source}" not in phrase.effect.words and phrase.source != Source():
        said += f" from {name_words(phrase.source.name) if phrase.source.types == 'L' and phrase.source.name else source_words(phrase.source)}"
    if surface and surface.region is not None:
        said += f" seen in {name_words(surface.region)}"
    return said + (view_words(phrase.view) if phrase.view else "")


def name_words(name: str) -> str:
    """A name as phrases write it."""
    if re.fullmatch(r"[^\s'\\]+", name) and name.lower() not in _NEVER_BARE:
        return name
    escaped = name.replace("\\", "\\\\").replace("'", "\\'")
    return f"'{escaped}'"


def source_words(source: Source) -> str:
    """An emitter as a noun.

    >>> source_words(Source("L", "lamp")), source_words(Source("B"))
    ('the emitter lamp', 'the background')
    """
    return _EMITTERS[source.types] if source.name is None else f"{_NAMED_EMITTERS[source.types]} {name_words(source.name)}"


def surface_words(surface: Surface, usual: str = "D") -> str:
    """A surface as a noun; ``usual`` is the scattering that need not be said."""
    kind = _SURFACES[surface.scattering] if surface.scattering != usual else ""
    name = name_words(surface.object) if surface.object is not None else ""
    return f"{kind} of {name}" if kind and name else kind or name


def view_words(view: View) -> str:
    """By way of what it is seen; begins with a space."""
    if view.object is None:
        return " seen in mirrors" if view.type == "R" else " seen through clear objects"
    return f" {'mirrored in' if view.type == 'R' else 'seen through'} {name_words(view.object)}"


def _times_words(low: int, more: bool) -> str:
    if more:
        return "" if low == 1 else f" {low} times or more"
    return {1: " once", 2: " twice"}.get(low, f" {low} times")


def _seen_scattering(effect: Effect) -> str:
    return effect.seen.scattering if effect.seen else ""


_NAME = rf"'(?:[^'\\]|\\.)+'|(?!(?i:{'|'.join(_NEVER_BARE)})(?!\S))[^\s'\\]+"


def _name_pattern(slot: str) -> str:
    return f"(?P<{slot}>{_NAME})"


def _fixed(text: str) -> str:
    """Fixed words, in any case."""
    return f"(?i:{re.escape(text)})"


def _source_pattern(prefix: str) -> str:
    bare = "|".join(f"(?P<{prefix}_{types}>{_fixed(noun)})" for types, noun in _EMITTERS.items())
    named = "|".join(f"{_fixed(noun)} {_name_pattern(f'{prefix}_{types}_name')}" for types, noun in _NAMED_EMITTERS.items())
    return f"(?:{named}|{bare})"


def _pattern(effect: Effect) -> re.Pattern[str]:
    """The words of an effect and all that may follow them."""
    slots = {"{source}": _source_pattern("source"), "{a}": _name_pattern("a"), "{b}": _name_pattern("b")}
    text = "".join(slots.get(part, _fixed(part)) for part in re.split(r"(\{\w+\})", effect.words) if part)
    if effect.counted:
        text += "(?: (?:(?P<once>(?i:once))|(?P<twice>(?i:twice))|(?P<times>[0-9]{1,4}) (?i:times)(?P<more> (?i:or more))?))?"
    if effect.seen:
        kinds = "|".join(f"(?P<onto_{scattering or 'X'}>{_fixed(noun)})" for scattering, noun in _SURFACES.items())
        kind = f"(?:{kinds})(?: (?i:of) {_name_pattern('kind_object')})?|" if effect.seen.scattering != "G" else ""
        text += f"(?: (?i:onto) (?:{kind}{_name_pattern('onto')}))?"
    if "{source}" not in effect.words:
        text += f"(?: (?i:from) (?:{_source_pattern('from')}|{_name_pattern('lamp')}))?"
    if effect.seen:
        text += f"(?: (?i:seen in) {_name_pattern('region')})?"
        views = [f"(?i:mirrored in) {_name_pattern('mirror')}", "(?P<mirrors>(?i:seen in mirrors))"]
        views += [f"(?i:seen through) {_name_pattern('glass')}", "(?P<clear>(?i:seen through clear objects))"]
        text += f"(?: (?:{'|'.join(views)}))?"
    return re.compile(text)


_PATTERNS = tuple((effect, _pattern(effect)) for effect in EFFECTS)


def read(text: str) -> Phrase:
    """What a phrase says; raises ``QueryError`` that lists the phrases that are understood."""
    if len(text) <= _MAX_PHRASE:
        # White space counts as one space, except inside quotes.
        plain = "".join(part if part.startswith("'") else re.sub(r"\s+", " ", part) for part in re.split(r"('(?:[^'\\]|\\.)*')", text)).strip()
        for effect, pattern in _PATTERNS:
            match = pattern.fullmatch(plain)
            if match:
                return _phrase(effect, {slot: found for slot, found in match.groupdict().items() if found is not None})
    forms = "; ".join(effect.words.format(source="the emitter NAME", a="NAME", b="NAME") for effect in EFFECTS)
    modifiers = "onto NAME, from NAME, seen in REGION, mirrored in NAME, seen through NAME"
    raise QueryError(f"expected one of the phrases: {forms}; most may go on with {modifiers}; found {text[:100]!r}")


def _phrase(effect: Effect, found: dict[str, str]) -> Phrase:
    names = {slot: _unquoted(name) for slot, name in found.items() if slot in ("a", "b")}
    times = (
        (1, False) if "once" in found else (2, False) if "twice" in found else (int(found.get("times", "1")), "times" not in found or "more" in found)
    )
    if not 1 <= times[0] <= MAX_REPEAT:
        raise QueryError(f"expected a count from 1 to {MAX_REPEAT:,}, found {times[0]}")
    surface = None
    if effect.seen:
        kind = next((scattering for scattering in _SURFACES if f"onto_{scattering or 'X'}" in found), effect.seen.scattering)
        surface = Surface(kind, _name(found, "onto") or _name(found, "kind_object"), _name(found, "region"))
    view = None
    if {"mirror", "mirrors"} & found.keys():
        view = View("R", _name(found, "mirror"))
    elif {"glass", "clear"} & found.keys():
        view = View("T", _name(found, "glass"))
    return Phrase(effect, names, _source(found), surface, view, times)


def _source(found: dict[str, str]) -> Source:
    if "lamp" in found:
        return Source("L", _name(found, "lamp"))
    for prefix in ("source", "from"):
        for types in _EMITTERS:
            if f"{prefix}_{types}" in found or f"{prefix}_{types}_name" in found:
                return Source(types, _name(found, f"{prefix}_{types}_name"))
    return Source()


def _name(found: dict[str, str], slot: str) -> str | None:
    return _unquoted(found[slot]) if slot in found else None


def _unquoted(text: str) -> str:
    """The name itself; raises ``QueryError`` for characters that expressions refuse."""
    name = re.sub(r"\\(.)", r"\1", text[1:-1], flags=re.DOTALL) if text.startswith("'") else text
    for character in name:
        if character == "\0" or 0xD800 <= ord(character) < 0xE000:
            raise QueryError(f"expected a name, found a character that no name can have, U+{ord(character):04X}")
    return name
