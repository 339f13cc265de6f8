"""Light-first to camera-first: an expression that starts at a light (``L…E``) is turned round.

Each operand of a whole expression is looked at by itself, so ``LS+DE | CDL`` is fine.
"""

from queries.lpe.limits import Work
from queries.lpe.nfa import build
from queries.lpe.syntax import EMITTER_TYPES, Choice, Combination, Node, Step, reverse


def camera_first(node: Node, work: Work) -> Node:
    """The tree with every operand that is written light first reversed."""
    if isinstance(node, Choice):
        return Choice(tuple(camera_first(part, work) for part in node.parts))
    if isinstance(node, Combination):
        return Combination(camera_first(node.first, work), tuple((operator, camera_first(operand, work)) for operator, operand in node.rest))
    return reverse(node) if is_light_first(node, work) else node


def is_light_first(node: Node, work: Work) -> bool:
    """Whether all words begin at a light, or all end at the camera without beginning there."""
    nfa = build(node, work)
    first, last = nfa.steps(nfa.first), nfa.steps(nfa.last)
    camera = frozenset("C")
    if _all_of(first, camera):
        return False
    return _all_of(first, EMITTER_TYPES) or _all_of(last, camera)


def _all_of(steps: list[Step], types: frozenset[str]) -> bool:
    """Whether every step accepts events of these types only."""
    return bool(steps) and all(any(test.field == "type" and test.mode == "in" and test.names <= types for test in step.tests) for step in steps)
