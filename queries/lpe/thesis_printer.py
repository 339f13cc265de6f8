"""Syntax tree to text, in the thesis's light-first notation: ``parse(show(tree)) == tree`` for every tree that its parser made.

A camera-first tree is printed reversed. ``.`` is printed as ``X``: every interaction of a path, whatever it is.
"""

from itertools import product

from queries.errors import ExpressionError
from queries.lpe.direction import is_light_first
from queries.lpe.limits import Work
from queries.lpe.syntax import EMITTER_TYPES, Chain, Choice, Combination, Node, Repeat, Step, Test, reverse
from queries.lpe.thesis_tokens import is_bare

_INTERACTIONS = frozenset("RTV")
_MAX_ALTERNATIVES = 1_000  # symbols that one step is spelled out to
_SCATTERING_WORDS = {"s": "straight transmission `s`", "x": "`x` (no scattering)"}


def show(tree: Node) -> str:
    """The expression in the thesis's notation; raises ``ExpressionError`` that names what the notation lacks.

    >>> from queries.lpe.parser import parse
    >>> show(parse("C D <TS>+ L").tree)
    'L S^T+ D E'
    """
    _check_names(tree)
    parts = tree.parts if isinstance(tree, Choice) else (tree,)
    return " | ".join(_path(part) for part in parts)


def _check_names(tree: Node) -> None:
    """Refuse a name that stands for an object and for a region: one subscript cannot say which."""
    names: dict[str, set[str]] = {"region": set(), "object": set(), "light": set()}
    pending = [tree]
    while pending:
        node = pending.pop()
        if isinstance(node, Step):
            for test in node.tests:
                names.setdefault(test.field, set()).update(test.names)
        elif isinstance(node, Repeat):
            pending.append(node.part)
        elif isinstance(node, Combination):
            raise _lacking("Boolean combinations (`&`, `-`, `^`)")
        else:
            pending.extend(node.parts)
    both = sorted(names["region"] & (names["object"] | names["light"]))
    if both:
        raise ExpressionError(f"the thesis's notation cannot tell the region `{both[0]}` from the object of this name: rename the region")


def _path(node: Node) -> str:
    """One whole path, light first."""
    written = node if is_light_first(node, Work()) else reverse(node)
    parts = written.parts if isinstance(written, Chain) else (written,)
    if len(parts) < 2:
        raise _lacking("an expression that does not name both a light and the eye")
    return " ".join([_source(parts[0]), *(_inside(part) for part in parts[1:-1]), _eye(parts[-1])])


def _source(node: Node) -> str:
    """The emitters that a path may start from."""
    steps = node.parts if isinstance(node, Choice) else (node,)
    symbols = [symbol for part in steps for symbol in _emitters(part)]
    return symbols[0] if len(symbols) == 1 else f"({'|'.join(symbols)})"


def _emitters(node: Node) -> list[str]:
    if not isinstance(node, Step):
        raise _lacking("an expression whose light stands inside a bracket or is repeated")
    fields = _fields(node, ("type", "light", "region"))
    types = fields["type"][0].names if fields["type"] else frozenset("?")
    if not types <= EMITTER_TYPES:
        raise _lacking("an expression whose last event is not a light (L, O or B)")
    return _spelled(sorted(types, key="LOB".index), [*fields["light"], *fields["region"]])


def _eye(node: Node) -> str:
    if not isinstance(node, Step):
        raise _lacking("an expression whose eye stands inside a bracket or is repeated")
    tests = [test for test in node.tests if test.field != "type"]
    if tests:
        raise _lacking(f"{_construct(tests[0])} on the eye")
    if node.tests and node.tests[0].names != {"C"}:
        raise _lacking("an expression whose first event is not the camera")
    return "E"


def _inside(node: Node) -> str:
    """Interactions, bracketed where they stand beside others."""
    if isinstance(node, Step):
        symbols = _interactions(node)
        return symbols[0] if len(symbols) == 1 else f"({'|'.join(symbols)})"
    if isinstance(node, Choice):
        return f"({'|'.join(_alternative(part) for part in node.parts)})"
    if isinstance(node, Chain):
        return f"({_alternative(node)})"
    assert isinstance(node, Repeat)
    inner = f"({_inside(node.part)})" if isinstance(node.part, Repeat) else _inside(node.part)
    return inner + _times(node.low, node.high)


def _alternative(node: Node) -> str:
    """One alternative of a bracket."""
    if isinstance(node, Step):
        return "|".join(_interactions(node))
    return " ".join(_inside(part) for part in node.parts) if isinstance(node, Chain) else _inside(node)


def _times(low: int, high: int | None) -> str:
    short = {(0, None): "*", (1, None): "+", (0, 1): "?"}.get((low, high))
    if short:
        return short
    return f"{{{low}}}" if low == high else f"{{{low},{'' if high is None else high}}}"


def _interactions(step: Step) -> list[str]:
    """The symbols that together stand for a step."""
    fields = _fields(step, ("type", "scattering", "object", "region"))
    types = fields["type"][0].names if fields["type"] else None
    scatterings = fields["scattering"][0].names if fields["scattering"] else None
    if types is not None and not types <= _INTERACTIONS:
        raise _lacking("a camera or a light amid a path")
    if scatterings is None:
        letters = ["X"] if types is None or types == _INTERACTIONS else [{"R": "X^R", "T": "X^T", "V": "V"}[name] for name in sorted(types)]
    else:
        for name in sorted(scatterings - set("DGS")):
            raise _lacking(_SCATTERING_WORDS[name])
        sides = [""] if types is None or types == _INTERACTIONS else [f"^{name}" for name in sorted(types)]
        if "^V" in sides:
            raise _lacking("a scattering type in volumes")
        letters = [letter + side for letter, side in product(sorted(scatterings), sides)]
    return _spelled(letters, [*fields["object"], *fields["region"]])


def _spelled(letters: list[str], named: list[Test]) -> list[str]:
    """Each letter with each choice of one name for each test."""
    size = len(letters)
    for test in named:
        size *= len(test.names)
    if size > _MAX_ALTERNATIVES:
        raise ExpressionError(f"the thesis's notation would spell one step as {size:,} symbols; at most {_MAX_ALTERNATIVES:,} are written")
    return [letter + _subscripts(names) for letter in letters for names in product(*(sorted(test.names) for test in named))]


def _subscripts(names: tuple[str, ...]) -> str:
    if len(names) == 1 and is_bare(names[0]):
        return f"_{names[0]}"
    escaped = (name.replace("\\", "\\\\").replace("}", "\\}") for name in names)
    return "".join(f"_{{{name}}}" for name in escaped)


def _fields(step: Step, allowed: tuple[str, ...]) -> dict[str, list[Test]]:
    """The tests of a step by field; refuses those that the notation lacks."""
    fields: dict[str, list[Test]] = {field: [] for field in allowed}
    for test in step.tests:
        if test.field not in allowed or test.mode != "in" or not test.names:
            raise _lacking(_construct(test))
        fields[test.field].append(test)
    for field in ("type", "scattering"):
        if len(fields.get(field, [])) > 1:
            raise _lacking(f"two tests of one event's {field}")
    return fields


def _construct(test: Test) -> str:
    """What a test is called in messages."""
    names = ", ".join(sorted(test.names)[:3])
    if test.field == "label":
        return f"labels ('{names}')" if test.names else "labels"
    if test.field in ("type", "scattering"):
        return f"{'a set' if test.mode == 'in' else 'the negation'} of {test.field} letters ({names})"
    return f"`@{'' if test.mode == 'in' else '!'}{test.field}:{names}`"


def _lacking(construct: str) -> ExpressionError:
    return ExpressionError(f"the thesis's notation lacks {construct}")
