"""What classes of paths are called: the expression that selects each, and its description in words."""

import re
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from queries.classes import PathClasses
from queries.lpe.descriptors import DESCRIPTORS, class_expression, describe_class, descriptor
from queries.lpe.syntax import NAMED_FIELDS, NUMBERED_FIELDS
from queries.shards import Piece

I32 = npt.NDArray[np.int32]


class Label(NamedTuple):
    """What one kind of paths is called: the expression (standard notation) that selects it, words for it, its high-level descriptor."""

    expression: str
    description: str
    descriptor: str


class Labels(Protocol):
    """Numbered kinds of paths and their names."""

    def __len__(self) -> int:
        """How many kinds there are."""

    def of(self, piece: Piece) -> I32:
        """The kind of each path: int32 (rows)."""

    def label(self, number: int) -> Label:
        """What a kind is called."""


class ClassLabels:
    """One kind for each class."""

    def __init__(self, classes: PathClasses) -> None:
        self._classes = classes

    def __len__(self) -> int:
        """How many classes there are."""
        return len(self._classes)

    def of(self, piece: Piece) -> I32:
        """The class of each path: int32 (rows)."""
        return self._classes.of(piece)

    def label(self, number: int) -> Label:
        """The expression of the class, words such as "caustic through glass_ball", and the descriptor that it falls under."""
        letters, objects = self._classes.letters(number), self._classes.objects(number)
        return Label(class_expression(letters, objects), describe_class(letters, objects), descriptor(letters))


class DescriptorLabels:
    """One kind for each high-level descriptor: similar classes merged (thesis 9.4.2)."""

    def __init__(self, classes: PathClasses) -> None:
        self._classes = classes
        names = [row.name for row in DESCRIPTORS]
        self._kind = np.array([names.index(descriptor(classes.letters(i))) for i in range(len(classes))], np.int32)

    def __len__(self) -> int:
        """How many descriptors there are."""
        return len(DESCRIPTORS)

    def of(self, piece: Piece) -> I32:
        """The descriptor of each path: int32 (rows)."""
        return self._kind[self._classes.of(piece)]

    def label(self, number: int) -> Label:
        """The expression that selects all classes of a descriptor, what they have in common, and the descriptor's name."""
        row = DESCRIPTORS[number]
        return Label(row.expression, row.meaning, row.name)


def selection(expression: str, region: str, at: str) -> str:
    """The expression of those paths of a kind that lie in a named region."""
    name = region if re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", region) and region not in (*NAMED_FIELDS, *NUMBERED_FIELDS) else f"'{region}'"
    place = f"C X@{name} .*" if at == "seen" else f"C .* X@{name} .*"
    return f"({expression}) & ({place})"
