"""Tables to answers: views, light path expressions, resolved images."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from queries.run import Run, open_run

__all__ = ["Run", "open_run"]


def __getattr__(name: str) -> Any:
    """``open_run`` and ``Run``, imported when they are used: expressions and errors need no DuckDB."""
    if name in __all__:
        from queries import run

        return getattr(run, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
