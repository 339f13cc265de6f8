"""Tables to answers: views, light path expressions, resolved images, rankings."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from queries.ranking import rank
    from queries.run import Run, open_run

__all__ = ["Run", "open_run", "rank"]


def __getattr__(name: str) -> Any:
    """What ``__all__`` lists, imported when it is used: expressions and errors need no DuckDB."""
    if name == "rank":
        from queries.ranking import rank

        return rank
    if name in __all__:
        from queries import run

        return getattr(run, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
