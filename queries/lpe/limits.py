"""Bounds on the size of an expression and of its automata: any text is compiled or refused in bounded time and memory.

All bounds count work, not seconds, so that the same text has the same fate on every machine.
"""

from queries.errors import ExpressionError

MAX_TEXT = 20_000  # characters
MAX_NESTING = 60  # brackets inside brackets
MAX_REPEAT = 1_000  # the n and m of {n,m}; a path has at most 255 segments
MAX_NUMBER = 1_000  # the numbers of ranges such as depth:2..4
MAX_NAME = 500  # characters of a name after `@`
MAX_POSITIONS = 3_000  # symbols after repetitions are written out
MAX_CELLS = 50_000  # combinations of fields (event type, scattering type, labels, objects ...) that an expression tells apart
MAX_STATES = 6_000  # states of one automaton
MAX_TRANSITIONS = 60_000  # states times symbols of one automaton
MAX_STEPS = 2_000_000  # elementary set operations of one compilation


class Work:
    """Counts the elementary set operations of one compilation and refuses to go on past ``most`` of them."""

    def __init__(self, most: int = MAX_STEPS) -> None:
        self.steps = 0
        self.most = most

    def spend(self, steps: int) -> None:
        """Count ``steps`` more operations; raises ``ExpressionError`` past the bound."""
        self.steps += steps
        if self.steps > self.most:
            raise ExpressionError(f"the expression takes more than {self.most:,} steps to compile: use fewer or smaller repetitions and alternatives")


def check_automaton(states: int, symbols: int) -> None:
    """Refuse an automaton of too many states or transitions."""
    if states > MAX_STATES or states * symbols > MAX_TRANSITIONS:
        raise ExpressionError(
            f"the expression's automaton needs more than {MAX_STATES:,} states or {MAX_TRANSITIONS:,} transitions: "
            "use smaller repetitions, or fewer symbols and labels"
        )
