"""What the renderer says of bad input."""


class SceneError(ValueError):
    """A scene that cannot be rendered. The message says what was expected, what was found, where, and what to do.

    ``place`` is ``file:line`` (or ``file:line:column``) where it is known, else empty.
    """

    def __init__(self, message: str, place: str = "") -> None:
        super().__init__(f"{place}: {message}" if place else message)
        self.place = place
