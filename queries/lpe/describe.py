"""Syntax tree to plain words, for people who do not read the notation."""

from collections.abc import Sequence

from queries.lpe.phrases import phrase_of
from queries.lpe.syntax import NAMED_FIELDS, NUMBERED_FIELDS, Chain, Choice, Node, Repeat, Step, Test

_TYPES = {
    "C": "the camera",
    "R": "reflection",
    "T": "transmission",
    "V": "volume scattering",
    "L": "a light",
    "O": "a glowing object",
    "B": "the background",
}
_SCATTERING = {"D": "diffuse", "G": "glossy", "S": "specular", "s": "straight", "x": "unscattered"}
_OPERATORS = {"&": "and also", "-": "but not", "^": "or, but not both,"}
_TECHNIQUES = {
    "hit": "a walk that hit it",
    "sample": "an emitter sample",
    "lens": "a lens sample",
    "connection": "a connection of two walks",
    "merge": "a merge of two walks",
}
# What stands after `@`, and what must not be: words around the names.
_FIELDS = {
    "object": ("on {}", "not on {}"),
    "material": ("of material {}", "not of material {}"),
    "light": ("named {}", "not named {}"),
    "medium": ("in medium {}", "not in medium {}"),
    "blocker": ("blocked by {}", "not blocked by {}"),
    "technique": ("found by {}", "not found by {}"),
    "region": ("in {}", "not in {}"),
    "crosses": ("reached across {}", "not reached across {}"),
    "depth": ("at depth {}", "not at depth {}"),
    "s": ("with s = {} (vertices sampled from the light)", "not with s = {} (vertices sampled from the light)"),
    "t": ("with t = {} (vertices sampled from the camera)", "not with t = {} (vertices sampled from the camera)"),
}
_PREFIXES = {
    "unoccluded": "as if nothing cast a shadow",
    "shadows": "blocked connections alone, the light that is missing in shadows",
    "noclamp": "without clamping",
    "nothruput": "without the walk's throughput up to the last interaction",
}
_ORDINALS = ("first", "second", "third")


def explain(node: Node, prefixes: Sequence[str] = ()) -> str:
    """The expression in words, a short phrase first where there is one that says exactly the same, and last what its prefixes mean.

    >>> from queries.lpe.parser import parse
    >>> explain(parse("C D <TS>+ L").tree)
    'refractive caustic (the camera, then diffuse scattering, then specular transmission once or more, then a light)'
    """
    phrase = phrase_of(node)
    said = f"{phrase} ({describe(node)})" if phrase else describe(node)
    return "; ".join([said, *(_PREFIXES[prefix] for prefix in prefixes)])


def describe(node: Node) -> str:
    """The expression in words, event by event.

    >>> from queries.lpe.parser import parse
    >>> describe(parse("C<RD><TS>{2}L").tree)
    'the camera, then diffuse reflection, then specular transmission 2 times, then a light'
    """
    if isinstance(node, Step):
        return describe_step(node)
    if isinstance(node, Chain):
        return ", then ".join(_bracketed(part) for part in node.parts)
    if isinstance(node, Choice):
        return " or ".join(_bracketed(part) for part in node.parts)
    if isinstance(node, Repeat):
        return f"{_bracketed(node.part)} {_times(node.low, node.high)}"
    shown = [_bracketed(node.first)]
    for operator, operand in node.rest:
        shown.append(f"{_OPERATORS[operator]} {_bracketed(operand)}")
    return " ".join(shown)


def _bracketed(node: Node) -> str:
    return describe(node) if isinstance(node, (Step, Repeat)) else f"({describe(node)})"


def _times(low: int, high: int | None) -> str:
    if (low, high) == (0, 1):
        return "at most once"
    if high is None:
        return "any number of times" if low == 0 else "once or more" if low == 1 else f"{low} times or more"
    return f"{low} times" if low == high else f"{low} to {high} times"


def describe_step(step: Step) -> str:
    """One event in words.

    >>> from queries.lpe.syntax import Test
    >>> describe_step(Step((Test("scattering", frozenset("D")), Test("object", frozenset({"floor"})), Test("region", frozenset({"p"})))))
    'diffuse scattering on floor in p'
    """
    types = [test for test in step.tests if test.field == "type"]
    scatterings = [test for test in step.tests if test.field == "scattering"]
    further = [test for test in step.tests if test.field not in ("type", "scattering")]
    noun = " and ".join(_listed(test, _TYPES) for test in types)
    untyped = any(test.mode == "in" and test.names == {"x"} for test in scatterings)
    adjective = "" if untyped else " and ".join(_listed(test, _SCATTERING) for test in scatterings)
    words = [word for word in (adjective, noun or ("scattering" if adjective else "any event")) if word]
    words += ["without a scattering type"] * untyped
    return " ".join(words + [_label(test) if test.field == "label" else _condition(test) for test in further])


def _listed(test: Test, words: dict[str, str]) -> str:
    if test.field == "type" and test.mode == "in" and test.names == frozenset("RTV"):
        return "any interaction"
    if test.mode == "other":
        # letters of the other field exclude nothing
        excluded = " or ".join(words[name] for name in sorted(test.names & words.keys()))
        return f"anything but {excluded}" if excluded else "any"
    return " or ".join(words.get(name, f"no such {'event' if test.field == 'type' else 'kind of'} ({name})") for name in sorted(test.names))


def _label(test: Test) -> str:
    names = " or ".join(sorted(test.names))
    if test.position is not None and test.mode == "in":
        return f"whose {ordinal(test.position)} label is {names}"
    if test.mode == "in":
        return f"labeled {names}"
    if test.mode == "without":
        return f"not labeled {names}"
    label = "a label" if test.position is None else f"a {ordinal(test.position)} label"
    if not names:
        return f"with {label}"
    return f"with {label}, but not {names}" if test.position is None else f"with {label} other than {names}"


def ordinal(position: int) -> str:
    """The place of a label, from 0, in words."""
    return _ORDINALS[position] if position < len(_ORDINALS) else f"{position + 1}th"


def _condition(test: Test) -> str:
    """What stands after an `@`."""
    assert test.field in NAMED_FIELDS + NUMBERED_FIELDS
    if test.field == "technique":
        names = [_TECHNIQUES.get(name, name) for name in sorted(test.names)]
    elif test.field in NUMBERED_FIELDS:
        names = [_range(name) for name in sorted(test.names)]
    else:
        names = sorted(test.names)
    holds, lacks = _FIELDS[test.field]
    return (holds if test.mode == "in" else lacks).format(" or ".join(names))


def _range(text: str) -> str:
    """A range of numbers in words."""
    low, dots, high = text.partition("..")
    if not dots or low == high:
        return low
    if not low:
        return f"at most {high}"
    return f"{low} to {high}" if high else f"{low} or more"
