"""Value prefixes, as in ``unoccluded;noclamp;CDL``: what is summed of the paths that the expression matches."""

import re

from queries.errors import ExpressionError
from queries.lpe.names import nearest
from queries.lpe.syntax import PREFIXES

_PREFIX = re.compile(r"\s*([A-Za-z_][A-Za-z0-9_]*)\s*;")


def read_prefixes(text: str) -> tuple[tuple[str, ...], int]:
    """The prefixes, in the order of ``PREFIXES``, and where the expression begins (from 0). A name is a prefix only where a ``;`` follows it.

    >>> read_prefixes("noclamp; unoccluded;CDL")
    (('unoccluded', 'noclamp'), 20)
    """
    found: set[str] = set()
    at = 0
    while match := _PREFIX.match(text, at):
        name, column = match.group(1), match.start(1) + 1
        if name not in PREFIXES:
            raise ExpressionError(f"expected one of the prefixes {', '.join(PREFIXES)}, found `{name[:60]}`{nearest(name, PREFIXES)}", column)
        found.add(name)
        if {"unoccluded", "shadows"} <= found:
            raise ExpressionError(
                "`unoccluded;` adds blocked connections to visible ones and `shadows;` selects blocked ones alone: an expression has one of them",
                column,
            )
        at = match.end()
    return tuple(name for name in PREFIXES if name in found), at
