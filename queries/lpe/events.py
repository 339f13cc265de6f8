"""Events of paths as callers write them: ``(type, scattering or None, labels, facts)``."""

from collections.abc import Iterable, Sequence

from queries.lpe.syntax import NAMED_FIELDS, NUMBERED_FIELDS, PathEvent

_SHAPE = "an event (type, scattering or None, labels, facts)"


def path_event(event: Sequence[object]) -> PathEvent:
    """One event; labels and facts may be left out or None. ``facts``: pairs ``("object", "floor")`` or texts ``"object:floor"``.

    Raises ``TypeError`` for another shape.
    """
    if isinstance(event, PathEvent):
        return event
    if isinstance(event, str) or not 1 <= len(event) <= 4 or not isinstance(event[0], str):
        raise TypeError(f"expected {_SHAPE}, found {event!r}")
    scattering = event[1] if len(event) > 1 else None
    labels = event[2] if len(event) > 2 and event[2] is not None else ()
    facts = event[3] if len(event) > 3 else None
    if not (scattering is None or isinstance(scattering, str)) or isinstance(labels, str) or not isinstance(labels, Iterable):
        raise TypeError(f"expected {_SHAPE}, found {event!r}")
    if isinstance(facts, str) or not (facts is None or isinstance(facts, Iterable)):
        raise TypeError(f"expected {_SHAPE}, found {event!r}")
    known = None if facts is None else frozenset(_fact(fact) for fact in facts)
    # a set has no order of its own: sorted, so that dialects that count places give the same answer each time
    listed = sorted(map(str, labels)) if isinstance(labels, (set, frozenset)) else map(str, labels)
    return PathEvent(event[0], scattering, tuple(listed), known)


def _fact(fact: object) -> tuple[str, str]:
    """One fact as a pair."""
    pair = tuple(fact.split(":", 1)) if isinstance(fact, str) else fact
    if not isinstance(pair, tuple) or len(pair) != 2 or pair[0] not in (*NAMED_FIELDS, *NUMBERED_FIELDS):
        raise TypeError(f"expected a fact such as ('object', 'floor') or 'object:floor', found {fact!r}")
    field, value = pair[0], str(pair[1])
    if field in NUMBERED_FIELDS and not (value.isascii() and value.isdigit()):
        raise TypeError(f"expected a number of {field}, found {fact!r}")
    return field, value
