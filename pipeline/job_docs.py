"""``docs/jobs.md``, generated from the schema: ``python -m pipeline.job_docs > docs/jobs.md``."""

import json
import re
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel

from pipeline.config import Job, Render
from pipeline.schema import inner_types
from viz.tools.base import Tool

_TOOL = "views.NAME.TOOL"
_NOT_OF_A_SCENE = ("texture_layout",)  # keys of `render` that a scene says nothing about
_EXAMPLE = """\
name: cornell
scene: scenes/cornell.yaml          # or a Mitsuba 3 .xml
render:
  method: path                      # or light
  resolution: [256, 256]            # default: the scene's film
  samples: 64
  max_depth: 8                      # Mitsuba's meaning; -1 is unbounded
  rr_depth: 5
  seed: 7
  sampler: sobol                    # or independent
  filter: box
record: {keep: all}
regions:
  bleeding: {sphere: {center: [520, 0, 200], radius: 60}}  # on the floor, beside the red wall
aovs:
  direct: "C D L"
  indirect: "C D .+ L"
  bleeding: "C D@bleeding X@object:left_wall .* L"
rank:
  bleeding: {region: bleeding, with_objects: true, top: 20}
inspection: {samples: 16}  # light walks beside the camera's, for what measures light
views:
  bleeding: {bundles: {expression: "C D D@object:left_wall L", most: 1500, color: chrominance}}
  irradiance: {irradiance: {}}
report: {}
"""


def job_docs() -> str:
    """The page, as Markdown."""
    parts = [
        "# Jobs",
        "<!-- Generated from pipeline/config.py by `python -m pipeline.job_docs > docs/jobs.md`; a test compares the two. -->",
        "A job is a YAML file. `pathspace run JOB` renders it, `pathspace validate JOB` checks it and estimates its size. Unknown keys are errors, "
        "values are never converted silently, and every error names the file and the line. `--set render.samples=16` changes one key for one run: "
        "dotted keys, values in YAML.",
        f"```yaml\n{_EXAMPLE}```",
        _table("The job", Job, ""),
    ]
    for name, section in sections(Job):
        if name == "views.NAME.bundles":
            parts.append(_table(f"`{_TOOL}`: keys of every tool", Tool, f"{_TOOL}."))
        parts.append(_table(f"`{name}`", section, f"{name}."))
    parts += [
        "## Rules",
        "- Paths are relative to the job's file. `--out DIR` says where one run is written, whatever the job says.\n"
        "- What makes a run the same run is its scene and its `render` and `record` settings: `--resume` goes on with it, also with other\n"
        "  `regions`, `aovs`, `rank`, `views`, `inspection` and `report`: what is there already, and asked for in the same words, is kept.\n"
        "- PNG images are for looking: linear values are multiplied by 2^exposure, clipped to 0 … 1 and given the sRGB curve. EXR images are linear.",
    ]
    return "\n\n".join(parts) + "\n"


def sections(model: type[BaseModel], prefix: str = "", seen: set[type[BaseModel]] | None = None) -> Iterator[tuple[str, type[BaseModel]]]:
    """Every section of a schema, once, and its dotted name, outer ones first; ``NAME`` stands for any name, ``N`` for a place in a list."""
    seen = set() if seen is None else seen
    for key, field in model.model_fields.items():
        for step, kind in inner_types(field.annotation):
            if isinstance(kind, type) and issubclass(kind, BaseModel) and kind not in seen:
                seen.add(kind)
                name = f"{prefix}{key}{step}"
                yield name, kind
                yield from sections(kind, f"{name}.", seen)


def _table(title: str, model: type[BaseModel], prefix: str) -> str:
    """One section's keys as a table."""
    described = (model.__doc__ or "").strip()
    lines = [f"## {title}", "", described, "", "| key | values | default | meaning |", "|---|---|---|---|"]
    definitions = model.model_json_schema().get("$defs", {})
    shared = Tool.model_fields if issubclass(model, Tool) and model is not Tool else {}
    for name, schema in model.model_json_schema()["properties"].items():
        if name not in shared:
            default, values = _default(model, name), values_of(schema, definitions)
            lines.append(f"| `{prefix}{name}` | {_cell(values)} | {_cell(default)} | {_cell(model.model_fields[name].description or '')} |")
    if shared:
        lines.append(f"\nBeside these, the keys of every tool: `{_TOOL}`.")
    return "\n".join(lines)


def _default(model: type[BaseModel], name: str) -> str:
    """What holds where a key is left out."""
    field = model.model_fields[name]
    if field.is_required():
        return "required"
    if isinstance(field.default, BaseModel):
        return "see below"
    if model is Job and name == "out":
        return "`runs/<name>`"
    if field.default is None:
        return "the scene's" if model is Render and name not in _NOT_OF_A_SCENE else "none"
    return f"`{json.dumps(field.default)}`"


def values_of(schema: dict[str, Any], definitions: dict[str, Any]) -> str:
    """What a JSON schema allows, in words."""
    if "$ref" in schema:
        return values_of(definitions[schema["$ref"].split("/")[-1]], definitions)
    if "anyOf" in schema:
        return " or ".join(values_of(choice, definitions) for choice in schema["anyOf"] if choice.get("type") != "null")
    if "enum" in schema:
        return ", ".join(f"`{value}`" for value in schema["enum"])
    if "const" in schema:
        return f"`{schema['const']}`"
    kind = schema.get("type")
    if kind == "array":
        if "prefixItems" in schema:
            return "a list of " + str(len(schema["prefixItems"])) + f": {values_of(schema['prefixItems'][0], definitions)}"
        return f"a list of {values_of(schema['items'], definitions)}"
    if kind == "object":
        inner = next(iter(schema.get("patternProperties", {}).values()), schema.get("additionalProperties"))
        return f"name: {values_of(inner, definitions)}" if isinstance(inner, dict) else "a section"
    words = {"integer": "whole number", "number": "number", "string": "text", "boolean": "`true` or `false`"}
    return words[str(kind)] + _bounds(schema)


def _bounds(schema: dict[str, Any]) -> str:
    low, high = schema.get("minimum"), schema.get("maximum")
    if low is not None and high is not None:
        return f" {_number(low)} … {_number(high)}"
    if low is not None:
        below = schema.get("exclusiveMaximum")
        return f" {_number(low)} or more" + (f", below {_number(below)}" if below is not None else "")
    if "pattern" in schema:
        return f" of at most {schema['maxLength']} characters: letters, digits, `_`, `.`, `-`"
    return ""


def _number(value: float) -> str:
    """A bound, with powers of two from 2^20 on written as such."""
    whole = int(value)
    for offset, text in ((0, ""), (1, " - 1")):
        power = (whole + offset).bit_length() - 1
        if whole + offset == 2**power and power >= 20:
            return f"2^{power}{text}"
    return f"{whole}"


def _cell(text: str) -> str:
    return re.sub(r"(?<!\\)\|", r"\\|", text)


if __name__ == "__main__":
    print(job_docs(), end="")
