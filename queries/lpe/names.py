"""The names that a run knows, and what was probably meant by one that it does not."""

import difflib
from collections.abc import Collection
from dataclasses import dataclass

from queries.errors import ExpressionError

OBJECT_FIELDS = ("object", "material", "light", "blocker")
REGION_FIELDS = ("region", "crosses")
_COMPARED = 500  # names that are looked through for the nearest one
_LONGEST = 60  # characters of a name that is worth comparing


@dataclass(frozen=True)
class Known:
    """``objects``: the names of objects, materials and lights; ``regions``: of regions. None where they are not known: any name will do."""

    objects: Collection[str] | None = None
    regions: Collection[str] | None = None

    def check(self, field: str, name: str, column: int) -> None:
        """Raise ``ExpressionError`` where a test of ``field`` (``object``, ``region`` ...) names something that does not exist."""
        names = self.objects if field in OBJECT_FIELDS else self.regions if field in REGION_FIELDS else None
        if names is None or name in names:
            return
        if field in OBJECT_FIELDS:
            raise ExpressionError(f"no object, material or light is named `{_short(name)}`{nearest(name, names)}", column)
        glued = [region for region in names if name.startswith(region)]
        if field == "region" and glued:
            longest = max(glued, key=len)
            hint = f": a name runs as far as letters, digits and `_` do; did you mean `@{longest} {_short(name[len(longest) :])}`?"
        else:
            hint = nearest(name, names) if names else ": no region is defined"
        raise ExpressionError(f"no region is named `{_short(name)}`{hint}", column)


def nearest(name: str, names: Collection[str]) -> str:
    """``; did you mean `…`?``, or nothing where no name is near.

    >>> nearest("florr", ["wall", "floor"])
    '; did you mean `floor`?'
    """
    near = difflib.get_close_matches(name, sorted(names)[:_COMPARED], 1) if len(name) <= _LONGEST else []
    return f"; did you mean `{near[0]}`?" if near else ""


def _short(name: str) -> str:
    return name if len(name) <= _LONGEST else name[: _LONGEST - 1] + "…"
