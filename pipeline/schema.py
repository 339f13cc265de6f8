"""Walking the schema of a job: what stands at a dotted key, and which types it may have."""

from collections.abc import Iterator
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel

from pipeline.config import Job

Location = tuple[str | int, ...]


def known_keys(section: Location) -> list[str]:
    """Keys of the section at ``section``, as the schema knows them."""
    model = model_at(section)
    return list(model.model_fields) if model else []


def meaning(location: Location) -> str | None:
    """What the schema says of a key; None where it knows none."""
    model = model_at(location[:-1])
    field = model.model_fields.get(str(location[-1])) if model else None
    return field.description if field else None


def model_at(section: Location) -> type[BaseModel] | None:
    """The schema of the section at ``section``."""
    annotation: Any = Job
    for step in section:
        annotation = inside(annotation, step)
    return next((kind for kind in types_of(annotation) if isinstance(kind, type) and issubclass(kind, BaseModel)), None)


def inside(annotation: Any, step: str | int) -> Any:
    """The type of what a key, a name or a place in a list leads to."""
    for inner, kind in inner_types(annotation):
        if inner:
            return kind
        if isinstance(kind, type) and issubclass(kind, BaseModel) and step in kind.model_fields:
            return kind.model_fields[str(step)].annotation
    return None


def inner_types(annotation: Any) -> Iterator[tuple[str, Any]]:
    """The members of a type, each with the step that leads to it: none, ``.NAME`` for values of a mapping, ``.N`` for those of a list."""
    for kind in types_of(annotation):
        if get_origin(kind) is dict:
            yield from ((".NAME", member) for member in types_of(get_args(kind)[1]))
        elif get_origin(kind) in (list, tuple):
            yield from ((".N", member) for member in types_of(get_args(kind)[0]))
        else:
            yield "", kind


def types_of(annotation: Any) -> Iterator[Any]:
    """The members of a union, or the type itself; what is annotated is taken bare."""
    if get_origin(annotation) in (Union, UnionType):
        for member in get_args(annotation):
            yield from types_of(member)
    elif get_origin(annotation) is Annotated:
        yield from types_of(get_args(annotation)[0])
    else:
        yield annotation
