"""Tests of events as SQL conditions, and events' signatures: a character for each step, 1 where the event passes it."""

from collections.abc import Sequence

from queries.lpe.predicates import TECHNIQUES
from queries.lpe.syntax import NUMBERED_FIELDS, Step, Test
from renderer.tables import EMITTER_HIT, EMITTER_SAMPLE, LENS_SAMPLE


def _named(*names: str) -> str:
    """The list of those names that there are."""
    return f"list_filter([{', '.join(names)}], lambda name: name <> '')"


# What is known of a walk's interactions: SQL over words, events and objects.
OF_INTERACTIONS = {
    "type": "type",
    "scattering": "coalesce(scattering, 'x')",
    "label": _named("objects.name", "objects.material", "events.lobe"),
    "object": "objects.name",
    "material": "objects.material",
}
# What is known of a path's last event: SQL over emitters, the objects that they are, the rows p of paths, and what blocked them.
OF_EMISSION = {
    "type": "emitters.symbol",
    "scattering": "'x'",
    "label": _named("emitters.name", "objects.name", "objects.material"),
    "object": "objects.name",
    "material": "objects.material",
    "light": _named("emitters.name", "objects.name"),
    "blocker": "blockers.name",
    "technique": "p.technique",
    "s": f"CASE p.technique WHEN {EMITTER_HIT} THEN 0 WHEN {EMITTER_SAMPLE} THEN 1 ELSE p.light_depth + 1 END",
    "t": f"CASE p.technique WHEN {LENS_SAMPLE} THEN 1 ELSE p.camera_depth + 1 END",
}
ROW_COLUMNS = {"technique": ("technique",), "s": ("technique", "light_depth"), "t": ("technique", "camera_depth"), "blocker": ("blocker",)}
"""The columns of a path's row that each field depends on, where it is more than the emitter."""


def signature(steps: Sequence[Step], known: dict[str, str]) -> str:
    """The signature of an event. ``known``: the SQL of each field; a field that is not there has no value."""
    return " || ".join(f"CASE WHEN {_condition(step, known)} THEN '1' ELSE '0' END" for step in steps)


def _condition(step: Step, known: dict[str, str]) -> str:
    return " AND ".join(_test(test, known) for test in step.tests) or "true"


def _test(test: Test, known: dict[str, str]) -> str:
    """One test; never NULL."""
    if test.field not in known:
        return "false" if test.mode == "in" else "true"
    value, names = known[test.field], [quote(name) for name in sorted(test.names)]
    if test.field in NUMBERED_FIELDS:
        held = f"coalesce({' OR '.join(_range(value, name) for name in sorted(test.names))}, false)"
    elif test.field == "technique":
        held = _among(value, [str(TECHNIQUES.index(name)) for name in sorted(test.names) if name in TECHNIQUES])
    elif test.field == "label" and test.position is not None:
        there = f"len({value}) > {test.position}"
        held = _among(f"{value}[{test.position + 1}]", names)
        return f"({there} AND {held})" if test.mode == "in" else f"({there} AND NOT {held})"
    elif test.field in ("label", "light"):
        held = f"list_has_any({value}, [{', '.join(names)}])" if names else "false"
    else:
        held = _among(value, names)
    some = f" AND len({value}) > 0" if test.field == "label" and test.mode == "other" else ""
    return held if test.mode == "in" else f"(NOT {held}{some})"


def _among(value: str, names: list[str]) -> str:
    return f"coalesce({value} IN ({', '.join(names)}), false)" if names else "false"


def _range(value: str, text: str) -> str:
    """Whether a number lies in a range such as ``2..4``."""
    low, dots, high = text.partition("..")
    if not dots:
        return f"{value} = {low}"
    return "(" + " AND ".join([*([f"{value} >= {low}"] if low else []), *([f"{value} <= {high}"] if high else [])]) + ")"


def quote(text: str) -> str:
    """A string literal."""
    return "'" + text.replace("'", "''") + "'"
