"""Which light a picture or a figure is about: an expression, a region and an area of the film, any of which may be left out."""

from dataclasses import dataclass

from queries.errors import QueryError
from queries.lpe import Expression
from queries.regions import Region
from queries.run import Run

FilmArea = tuple[float, float, float, float]


@dataclass(frozen=True)
class Selection:
    """Light that passes all three.

    Of whole paths: ``expression`` matches the path, some interaction of it lies in ``region``, and it falls on the film inside ``film`` (pixels:
    left, top, right, bottom, half open). Of a walk on its way (``queries.arrivals``): the vertex that light arrives at stands for the walk's other
    end, so that `C L` is direct light and `C S+ L` a caustic, wherever it is measured.
    """

    expression: Expression | None = None
    region: Region | None = None
    film: FilmArea | None = None

    @classmethod
    def of(
        cls,
        run: Run,
        expression: str | Expression | None = None,
        region: str | Region | None = None,
        film: FilmArea | None = None,
        dialect: str = "std",
    ) -> "Selection":
        """A selection in the names of a run. Raises ``ExpressionError`` and ``QueryError``, with what is known."""
        if isinstance(expression, str):
            expression = run.compile(expression, dialect)
        if isinstance(region, str):
            if region not in run.regions:
                raise QueryError(f"there is no region `{region}`: expected one of {', '.join(run.regions) or 'the job`s regions, which has none'}")
            region = run.regions[region]
        if film is not None and not (film[0] < film[2] and film[1] < film[3]):
            raise QueryError(f"expected a film area as left, top, right, bottom in pixels, each first below its second, found {list(film)}")
        return cls(expression, region, film)

    def describe(self) -> str:
        """The selection in words, as they follow "light": "selected by `C S+ L`, with an interaction in the ball …"; empty for all light."""
        parts = []
        if self.expression:
            parts.append(f"selected by `{self.expression}`")
        if self.region:
            parts.append(f"with an interaction in {self.region.describe()}")
        if self.film:
            left, top, right, bottom = self.film
            parts.append(f"on the film between ({left:g}, {top:g}) and ({right:g}, {bottom:g}) px")
        return ", ".join(parts)
