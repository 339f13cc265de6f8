"""Light path expressions: regular expressions over the events of light paths, compiled to automata and to SQL."""

from queries.lpe.compile import Expression, compile

__all__ = ["Expression", "compile"]
