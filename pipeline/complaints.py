"""What is wrong with a job, in words: every complaint names its key, what was expected and what was found."""

import difflib
from collections.abc import Sequence
from typing import Any

from pydantic import ValidationError

from pipeline.errors import JobError
from pipeline.schema import Location, known_keys, meaning


def explained(error: ValidationError, data: Any, place: Any) -> JobError:
    """One message for all the complaints of the schema; each names its key, what was found and the nearest known key."""
    lines: dict[Location, str] = {}
    for item in error.errors(include_url=False):
        location = _location(item["loc"], data, item["type"] == "missing")
        found = _value(data, location)
        name = ".".join(map(str, location)) or "job"
        if item["type"] == "extra_forbidden":
            text = f"unknown key `{name}`{_nearest(str(location[-1]), known_keys(location[:-1]))}"
        elif item["type"] == "missing":
            text = f"`{name}` is missing: {meaning(location) or 'expected one value more'}"
        else:
            text = f"`{name}`: {_expectation(item)}, found {_shown(found)}"
        lines[location] = f"{lines[location]}; or {text.split(': ', 1)[1]}" if location in lines else text
    # What a key could be instead says less than what is wrong inside of it.
    first, *rest = [outer for outer in lines if not any(outer == inner[: len(outer)] for inner in lines if len(inner) > len(outer))]
    message = lines[first] + "".join(f"\n{place(location)}: {lines[location]}" for location in rest)
    return JobError(message, place(first))


def _location(steps: Sequence[str | int], data: Any, missing: bool = False) -> Location:
    """The part of pydantic's location that names keys of the data (it also names members of unions, and ``[key]``).

    ``missing``: its end is a key that the data lack.
    """
    kept: list[str | int] = []
    for i, step in enumerate(steps):
        if isinstance(data, dict):
            if step == "[key]":
                break
            if step not in data and not (missing and i == len(steps) - 1):
                continue
            kept.append(step)
            data = data.get(step)
        elif isinstance(data, (list, tuple)) and isinstance(step, int):
            kept.append(step)
            data = data[step] if step < len(data) else None
    return tuple(kept)


def _value(data: Any, location: Location) -> Any:
    for step in location:
        if isinstance(data, dict):
            data = data.get(step)
        elif isinstance(data, list) and isinstance(step, int) and step < len(data):
            data = data[step]
        else:
            return None
    return data


_EXPECTATIONS = {
    "string_pattern_mismatch": "expected letters, digits, `_`, `.` and `-`, a letter or digit first",
    "greater_than_equal": "expected {ge} or more",
    "less_than_equal": "expected at most {le}",
    "less_than": "expected less than {lt}",
    "too_long": "expected at most {max_length} values",
    "too_short": "expected at least {min_length} values",
    "tuple_type": "expected a list of two whole numbers",
    "dict_type": "expected a section of keys and values",
    "model_type": "expected a section of keys and values",
    "string_too_short": "expected a text that is not empty",
    "string_too_long": "expected at most {max_length} characters",
    "string_type": "expected a text",
    "int_type": "expected a whole number",
    "bool_type": "expected true or false",
    "float_type": "expected a number",
    "list_type": "expected a list",
    "invalid_key": "expected keys that are texts",
}


def _expectation(item: Any) -> str:
    """What the schema expected, in our words where we have them."""
    if item["type"] in _EXPECTATIONS:
        return _EXPECTATIONS[item["type"]].format(**item.get("ctx", {}))
    message = str(item["msg"]).removeprefix("Value error, ").replace("Input should be", "expected")
    return message[0].lower() + message[1:]


def _shown(value: Any) -> str:
    if value is None:
        return "nothing"
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}…"


def _nearest(key: str, known: list[str]) -> str:
    close = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    return f": did you mean `{close[0]}`?" if close else f": known keys are {', '.join(f'`{k}`' for k in known)}"
