"""What a benchmark finds: rows of the goal table, and the figures behind them."""

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Row:
    """One row of the goal table. ``passed`` is None where nothing could be judged; ``measured`` then says why."""

    what: str
    goal: str
    measured: str
    passed: bool | None = None

    @property
    def verdict(self) -> str:
        """In one word."""
        return {True: "pass", False: "FAIL", None: "—"}[self.passed]


@dataclass
class SectionResult:
    """One section's rows, its figures as plain values, and paragraphs or tables (Markdown) that explain them."""

    rows: list[Row] = field(default_factory=list)
    figures: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def markdown_table(header: list[str], rows: list[list[str]]) -> str:
    """A Markdown table.

    >>> print(markdown_table(["a", "b"], [["1", "2"]]))
    | a | b |
    |---|---|
    | 1 | 2 |
    """
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])
