"""What queries say of bad input: one class for each kind, each a ``ValueError`` whose message stands alone."""


class QueryError(ValueError):
    """A question that cannot be answered as asked. The message says what was expected, what was found and what to do."""


class RunError(QueryError):
    """A folder that is no run, an unfinished run, or one with missing or damaged files."""


class QueryTimeout(QueryError):
    """A query that was stopped at its time limit."""


class ExpressionError(QueryError):
    """A light path expression that cannot be read, or that is too large. ``column`` counts characters from 1; 0 is the whole text."""

    def __init__(self, message: str, column: int = 0) -> None:
        super().__init__(f"column {column}: {message}" if column else message)
        self.column = column
