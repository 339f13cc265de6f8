"""Syntax tree to text, in OSL's notation. What OSL cannot say is refused, by name.

Alternatives are printed as a list ``[…]``, which is one item wherever it stands. A text that would begin with a group is put in
brackets as a whole, because OSL drops all that follows a group at the start.
"""

from queries.errors import ExpressionError
from queries.lpe.syntax import EVENT_TYPES, SCATTERING_TYPES, Chain, Choice, Node, Repeat, Step, Test

_ORDER = EVENT_TYPES + SCATTERING_TYPES
_KNOWN = {"type": frozenset(EVENT_TYPES), "scattering": frozenset(SCATTERING_TYPES) - {"x"}}


def show(node: Node) -> str:
    """The expression in OSL's notation; raises ``ExpressionError`` that names what OSL cannot say.

    >>> from queries.lpe.parser import parse
    >>> show(parse("C D? (<TS> S)* [L B] | C O").tree)
    '[(CD{0,1}(<TS>S)*[LB])(CO)]'
    """
    text = _show(node)
    return f"({text})" if text.startswith("(") else text


def _show(node: Node) -> str:
    if isinstance(node, Step):
        return show_step(node)
    if isinstance(node, Chain):
        return "".join(_item(part) for part in node.parts)
    if isinstance(node, Choice):
        return f"[{''.join(_item(part) for part in node.parts)}]"
    if isinstance(node, Repeat):
        part = f"({_show(node.part)})" if isinstance(node.part, Repeat) else _item(node.part)
        return part + _times(node.low, node.high)
    raise _lacking(f"Boolean combinations (`{node.rest[0][0]}`)")


def _item(part: Node) -> str:
    return f"({_show(part)})" if isinstance(part, Chain) else _show(part)


def _times(low: int, high: int | None) -> str:
    if high is None:
        return {0: "*", 1: "+"}.get(low, f"{{{low},}}")
    return f"{{{low}}}" if low == high else f"{{{low},{high}}}"


def _lacking(construct: str) -> ExpressionError:
    return ExpressionError(f"OSL's notation has no {construct}: write the expression in the standard dialect (`std`)")


# --- steps --------------------------------------------------------------------------------------------------------


def show_step(step: Step) -> str:
    """One step: a bare symbol where it tests one field by names that say which, else a group ``<type scattering labels>``."""
    if not step.tests:
        return "."
    fields: dict[str | int, str] = {}
    for test in step.tests:
        _check(test)
        place = (test.position or 0) if test.field == "label" else test.field
        if place in fields:
            raise _lacking("two tests of one label")
        fields[place] = _names(test)
    only = step.tests[0]
    if len(step.tests) == 1 and (only.names <= _KNOWN[only.field] if only.field in _KNOWN else only.names and not only.position):
        return _names(only)
    labels = range(1 + max((place for place in fields if isinstance(place, int)), default=-1))
    shown = [fields.get(place, ".") for place in ("type", "scattering", *labels)]
    # Fields that are left out at the end may be anything, labels aside, whose `.` asks for one.
    if not labels and shown[1] == ".":
        del shown[1]
    return f"<{''.join(shown)}>"


def _check(test: Test) -> None:
    """Refuse a test that OSL cannot make."""
    if test.field not in ("type", "scattering", "label"):
        raise _lacking(f"predicates after a symbol (`@{'' if test.field == 'region' else test.field + ':'}{min(test.names)}`)")
    if test.field != "label":
        if test.mode == "other" and "x" in test.names:
            raise _lacking("`x` in a negated list (`[^x]`)")
        return
    if test.mode == "without":
        raise _lacking(f"test for labels that are absent (`!'{min(test.names)}'`)")
    if test.position is None and test.names:
        raise _lacking(f"label at any place in the event's list, and counts places instead: `'{min(test.names)}'`")
    for name in test.names:
        if "'" in name:
            raise _lacking(f"escapes, and the label `{name}` holds a quote")


def _names(test: Test) -> str:
    """One test as it stands in a group: ``D``, ``[DG]``, ``[^D]``, ``'a'``."""
    if not test.names:
        return "."
    if test.field == "label":
        names = [f"'{name}'" for name in sorted(test.names)]
    else:
        names = sorted(test.names, key=_ORDER.index)
    if test.mode == "other":
        return f"[^{''.join(names)}]"
    return names[0] if len(names) == 1 else f"[{''.join(names)}]"
