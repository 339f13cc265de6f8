"""The names that a run knows, and what was probably meant by one that it does not."""

import difflib
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from queries.errors import ExpressionError

OBJECT_FIELDS = ("object", "material", "light", "blocker")
REGION_FIELDS = ("region", "crosses")
_SERVES = {"object": ("object",), "blocker": ("object",), "material": ("material",), "light": ("light", "object")}  # kinds that a field may name
_ARTICLE = {"object": "an", "material": "a", "light": "a"}
_COMPARED = 500  # names that are looked through for the nearest one
_LONGEST = 60  # characters of a name that is worth comparing


@dataclass(frozen=True)
class Known:
    """``objects``: the names of objects, materials and lights; ``regions``: of regions. None where they are not known: any name will do.

    ``objects`` may map each name to what it names, any of ``object``, ``material`` and ``light``.
    """

    objects: Collection[str] | None = None
    regions: Collection[str] | None = None

    def check(self, field: str, name: str, column: int) -> None:
        """Raise ``ExpressionError`` where a test of ``field`` (``object``, ``region`` ...) names something that does not exist."""
        names = self.objects if field in OBJECT_FIELDS else self.regions if field in REGION_FIELDS else None
        if names is None:
            return
        if name in names:
            self._check_kind(field, name, column)
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

    def kinds(self, name: str) -> frozenset[str]:
        """What a name names; nothing where that is not known."""
        found = self.objects.get(name) if isinstance(self.objects, Mapping) else None
        return frozenset(found) & {"object", "material", "light"} if isinstance(found, Collection) else frozenset()

    def _check_kind(self, field: str, name: str, column: int) -> None:
        kinds = self.kinds(name) if field in OBJECT_FIELDS else frozenset()
        if kinds and kinds.isdisjoint(_SERVES[field]):
            wanted, found = _SERVES[field][0], sorted(kinds)[0]
            said = f"`{_short(name)}` is no {wanted} but {_ARTICLE[found]} {found}"
            raise ExpressionError(f"{said}: say `@{found}:{_short(name)}` (in the notation `std`)", column)


def kinds_by_name(objects: Iterable[str], materials: Iterable[str], lights: Iterable[str]) -> dict[str, frozenset[str]]:
    """All names, each with what it names, as ``Known.objects`` takes them; empty names are none.

    >>> sorted(kinds_by_name(["lamp"], ["white"], ["lamp"])["lamp"])
    ['light', 'object']
    """
    found: dict[str, set[str]] = {}
    for kind, names in (("object", objects), ("material", materials), ("light", lights)):
        for name in names:
            if name:
                found.setdefault(name, set()).add(kind)
    return {name: frozenset(kinds) for name, kinds in found.items()}


def nearest(name: str, names: Collection[str]) -> str:
    """``; did you mean `…`?``, or nothing where no name is near.

    >>> nearest("florr", ["wall", "floor"])
    '; did you mean `floor`?'
    """
    near = difflib.get_close_matches(name, sorted(names)[:_COMPARED], 1) if len(name) <= _LONGEST else []
    return f"; did you mean `{near[0]}`?" if near else ""


def _short(name: str) -> str:
    return name if len(name) <= _LONGEST else name[: _LONGEST - 1] + "…"
