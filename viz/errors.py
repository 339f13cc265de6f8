"""What pictures say of a machine that cannot draw."""

from queries.errors import QueryError


class DrawingError(QueryError):
    """No picture can be drawn here. The message names what is missing and how to install it."""
