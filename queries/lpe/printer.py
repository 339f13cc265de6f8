"""Syntax tree to text, in the standard notation: ``parse(show(tree)) == tree`` for every tree that a parser made."""

from queries.lpe.syntax import EVENT_TYPES, SCATTERING_TYPES, Chain, Choice, Combination, Node, Repeat, Step, Test

_ORDER = EVENT_TYPES + SCATTERING_TYPES


def show(node: Node) -> str:
    """The expression in the standard notation.

    >>> from queries.lpe.parser import parse
    >>> show(parse("C (D | G)* <R.'mirror'> L").tree)
    "C[DG]*<R.'mirror'>L"
    """
    if isinstance(node, Step):
        return show_step(node)
    if isinstance(node, Chain):
        return "".join(_inside(part, Choice, Combination) for part in node.parts)
    if isinstance(node, Choice):
        return "|".join(_inside(part, Choice, *_loose(part, "|")) for part in node.parts)
    if isinstance(node, Repeat):
        return _inside(node.part, Chain, Choice, Repeat, Combination) + _times(node.low, node.high)
    operators = {operator for operator, _ in node.rest}
    tight = "^" if "^" in operators else "&"
    shown = [_inside(node.first, Choice, *_loose(node.first, tight))]
    for operator, operand in node.rest:
        shown.append(operator + _inside(operand, Choice, *_loose(operand, tight)))
    return "".join(shown)


def _loose(part: Node, operator: str) -> tuple[type, ...]:
    """``(Combination,)`` where the part is a combination that binds no tighter than the operator around it."""
    if not isinstance(part, Combination) or operator == "|":
        return ()
    return () if operator == "^" and part.rest[0][0] != "^" else (Combination,)


def _inside(part: Node, *loose: type) -> str:
    return f"({show(part)})" if isinstance(part, loose) else show(part)


def _times(low: int, high: int | None) -> str:
    short = {(0, None): "*", (1, None): "+", (0, 1): "?"}.get((low, high))
    if short:
        return short
    if high is None:
        return f"{{{low},}}"
    return f"{{{low}}}" if low == high else f"{{{low},{high}}}"


def show_step(step: Step) -> str:
    """One step: a bare symbol where it tests one field, else a group ``<type scattering labels>``."""
    if not step.tests:
        return "."
    if len(step.tests) == 1:
        test = step.tests[0]
        bare = test.field == "label" or test.names <= set(EVENT_TYPES if test.field == "type" else SCATTERING_TYPES.replace("x", ""))
        if bare and not (test.field == "label" and not test.names):
            return show_test(test)
    fields = {test.field: test for test in step.tests if test.field != "label"}
    labels = [show_test(test) for test in step.tests if test.field == "label"]
    leading = [show_test(fields[field]) if field in fields else "." for field in ("type", "scattering")]
    return f"<{''.join(leading)}{''.join(labels)}>"


def show_test(test: Test) -> str:
    """One test as it stands in a group: ``D``, ``[DG]``, ``[^D]``, ``'a'``, ``!'a'``."""
    if not test.names:
        return "."
    if test.field == "label":
        names = [_quote(name) for name in sorted(test.names)]
    else:
        names = sorted(test.names, key=_ORDER.index)
    if test.mode == "without":
        return "".join(f"!{name}" for name in names)
    if test.mode == "other":
        return f"[^{''.join(names)}]"
    return names[0] if len(names) == 1 else f"[{''.join(names)}]"


def _quote(name: str) -> str:
    escaped = name.replace("\\", "\\\\").replace("'", "\\'")
    return f"'{escaped}'"
