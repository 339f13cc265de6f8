"""Transforms as descriptions write them: matrices as lists, and named operations with their arguments."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from renderer.errors import SceneError
from renderer.scene import transforms
from renderer.scene.description import listing, nearest
from renderer.scene.transforms import F64

OPERATIONS = ("translate", "scale", "rotate", "lookat", "matrix")


def matrix_of(value: Any, place: str) -> F64:
    """A matrix from 16 numbers in rows (or 9, the linear part), flat or nested."""
    try:
        flat = np.asarray(value, np.float64).reshape(-1)
    except (TypeError, ValueError):
        raise SceneError(f"expected a matrix of 16 numbers, found {value!r:.60}", place) from None
    if flat.size == 9:
        m = np.eye(4)
        m[:3, :3] = flat.reshape(3, 3)
        return m
    if flat.size != 16:
        raise SceneError(f"a matrix has 16 numbers (or 9), not {flat.size}", place)
    return flat.reshape(4, 4)


def three(value: Any, place: str, what: str) -> list[float]:
    """Three numbers."""
    good = isinstance(value, Sequence) and len(value) == 3 and all(isinstance(x, int | float) and not isinstance(x, bool) for x in value)
    if not good:
        raise SceneError(f"{what} needs three numbers, not {value!r:.60}", place)
    return [float(x) for x in value]


def arguments(value: Any, names: Sequence[str], place: str, operation: str) -> list[Any]:
    """The arguments of an operation, in the order of their names."""
    if not isinstance(value, Mapping) or set(value) != set(names):
        raise SceneError(f"{operation} needs exactly {listing(names)}, not {value!r:.80}", place)
    return [value[name] for name in names]


def matrix_of_step(operation: str, value: Any, place: str) -> F64:
    """One operation, as ``{rotate: {axis: [0, 1, 0], angle: 90}}``."""
    if operation == "translate":
        return transforms.translate(three(value, place, operation))
    if operation == "scale":
        factors = [value] * 3 if isinstance(value, int | float) and not isinstance(value, bool) else value
        return transforms.scale(three(factors, place, operation))
    if operation == "rotate":
        axis, angle = arguments(value, ("axis", "angle"), place, operation)
        direction = three(axis, place, "a rotation's axis")
        if not any(direction):
            raise SceneError("a rotation's axis must not be zero", place)
        if isinstance(angle, bool) or not isinstance(angle, int | float):
            raise SceneError(f"a rotation's angle must be a number of degrees, not {angle!r:.60}", place)
        return transforms.rotate(direction, float(angle))
    if operation in ("lookat", "look_at"):
        names = ("origin", "target", "up")
        origin, target, up = (three(v, place, name) for v, name in zip(arguments(value, names, place, operation), names, strict=True))
        m = transforms.look_at(origin, target, up)
        if not np.isfinite(m).all():
            raise SceneError("lookat needs a target away from its origin and an up vector that is not along the view", place)
        return m
    if operation == "matrix":
        return matrix_of(value, place)
    raise SceneError(f"unknown operation {operation!r} of a transform{nearest(operation, OPERATIONS)}; known: {listing(OPERATIONS)}", place)


def matrix_of_steps(steps: Sequence[Mapping[str, Any]], place: str) -> F64:
    """Operations in the order in which they are applied."""
    m = np.eye(4)
    for step in steps:
        if len(step) != 1:
            raise SceneError(f"one operation stands in each item of a transform, not {listing(map(str, step)) or 'none'}", place)
        ((operation, value),) = step.items()
        m = matrix_of_step(str(operation), value, place) @ m
    return m
