"""From a YAML file to a checked job: every complaint names the file, the line, and the nearest key that exists."""

import pathlib
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from pipeline.complaints import explained
from pipeline.config import Analysis, Job, Name
from pipeline.errors import JobError
from pipeline.schema import Location
from queries.subpixel.description import SubpixelDescription
from viz.description import View

MAX_BYTES = 16 << 20
MAX_NODES = 200_000
MAX_NESTING = 64

Part = TypeVar("Part", bound=BaseModel)


class _Loader(yaml.SafeLoader):
    """YAML's safe subset, with numbers such as ``1e-3`` as everybody means them."""


_Loader.yaml_implicit_resolvers = {k: list(v) for k, v in yaml.SafeLoader.yaml_implicit_resolvers.items()}
_Loader.add_implicit_resolver("tag:yaml.org,2002:float", re.compile(r"^[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$"), list("-+.0123456789"))


@dataclass(frozen=True)
class LoadedJob:
    """A job and where it came from. Places are ``file:line``, of the scene, and of each AOV, region, ranking and view by name.

    ``overrides``: the ``key=value`` settings that changed it.
    """

    job: Job
    file: pathlib.Path
    scene_place: str
    aov_places: dict[str, str]
    region_places: dict[str, str] = field(default_factory=dict)
    rank_places: dict[str, str] = field(default_factory=dict)
    view_places: dict[str, str] = field(default_factory=dict)
    overrides: tuple[str, ...] = ()

    @property
    def folder(self) -> pathlib.Path:
        """The folder that paths in the job are relative to."""
        return self.file.parent

    @property
    def scene(self) -> str | dict[str, Any]:
        """The scene's path, or its dictionary."""
        return self.job.scene if isinstance(self.job.scene, dict) else str(self.folder / self.job.scene)

    def run_folder(self, out: pathlib.Path | None = None) -> pathlib.Path:
        """Where the run is written: the argument, else the job's ``out``, else ``runs/<name>`` here."""
        if out is not None:
            return out
        return self.folder / self.job.out if self.job.out else pathlib.Path("runs") / self.job.name


def load_job(path: pathlib.Path, settings: Sequence[str] = ()) -> LoadedJob:
    """Read a job file, apply ``key=value`` settings in order, and check it. Raises JobError."""
    root = _compose(_read(path), str(path))
    if not isinstance(root, yaml.MappingNode):
        found = "an empty file" if root is None else f"a {_kind(root)}"
        raise JobError(f"expected a job, that is keys such as `name:` and `scene:`, found {found}", f"{path}:{_line(root)}")
    data = _construct(root, str(path))
    places: dict[Location, str] = {}
    for setting in settings:
        places[_apply(data, setting)] = f"--set {setting}"

    def place(location: Location) -> str:
        for key, text in reversed(places.items()):
            if location[: len(key)] == key or key[: len(location)] == location:
                return text
        return f"{path}:{_line(_find(root, location))}"

    try:
        job = Job.model_validate(data)
    except ValidationError as error:
        raise explained(error, data, place) from None
    sections = ("aovs", "regions", "rank", "views")
    aovs, regions, rank, views = ({name: place((section, name)) for name in getattr(job, section)} for section in sections)
    loaded = LoadedJob(job, path, place(("scene",)), aovs, regions, rank, views, tuple(settings))
    if isinstance(job.scene, str) and not (path.parent / job.scene).is_file():
        raise JobError(f"there is no scene file `{path.parent / job.scene}`: paths are relative to the job's file", loaded.scene_place)
    return loaded


class _Views(BaseModel):
    """The views of a job alone."""

    views: dict[Name, View]


class _Analysis(BaseModel):
    """The analysis of a job alone."""

    analysis: Analysis


def checked_view(name: str, given: dict[str, Any], settings: Sequence[str] = ()) -> View:
    """A view that is described outside of a job, with ``key=value`` settings of its own keys. Raises JobError."""
    return _checked(_Views, {"views": {name: dict(given)}}, f"views.{name}", settings, f"view {name}").views[name]


def checked_subpixel(given: dict[str, Any], settings: Sequence[str] = ()) -> SubpixelDescription:
    """An analysis of subpixel filters that is described outside of a job, likewise. Raises JobError."""
    found = _checked(_Analysis, {"analysis": {"subpixel": dict(given)}}, "analysis.subpixel", settings, "subpixel").analysis.subpixel
    assert found is not None
    return found


def _checked(model: type[Part], data: dict[Any, Any], prefix: str, settings: Sequence[str], place: str) -> Part:
    """A part of a job alone, with settings of the keys below ``prefix``; complaints are placed at ``place``."""
    for setting in settings:
        _apply(data, f"{prefix}.{setting}" if "=" in setting else setting)
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise explained(error, data, lambda _: place) from None


def _read(path: pathlib.Path) -> str:
    try:
        if path.is_dir():
            raise JobError("expected a job file, found a folder", str(path))
        if path.stat().st_size > MAX_BYTES:
            raise JobError(f"a job file of more than {MAX_BYTES >> 20} MiB: expected a short YAML file", str(path))
        return path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise JobError("there is no such job file", str(path)) from None
    except UnicodeDecodeError as error:
        raise JobError(f"expected a YAML file in UTF-8, found other bytes at offset {error.start}", str(path)) from None
    except OSError as error:
        raise JobError(f"the job file cannot be read: {error.strerror}", str(path)) from None


# --- YAML as nodes, which know their lines ------------------------------------------------------------------------


def _compose(text: str, name: str) -> yaml.Node | None:
    """The document's tree, checked for size, depth, cycles and repeated keys before anything is built from it."""
    loader: _Loader | None = None
    try:
        loader = _Loader(text)
        root = loader.get_single_node()
        if root is not None:
            _check(root, name, [], {})
        return root
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        raise JobError(f"not valid YAML: {error.problem or error.context}", f"{name}:{mark.line + 1 if mark else 1}") from None
    except yaml.YAMLError as error:
        line = text.count("\n", 0, getattr(error, "position", 0)) + 1
        raise JobError(f"not valid YAML: {getattr(error, 'reason', error)}", f"{name}:{line}") from None
    except RecursionError:
        raise JobError(f"nested too deeply: expected at most {MAX_NESTING} levels", f"{name}:1") from None
    finally:
        if loader is not None:
            loader.dispose()


def _check(node: yaml.Node, name: str, above: list[int], sizes: dict[int, int]) -> int:
    """Number of nodes that ``node`` expands to; shared (aliased) nodes count each time but are visited once."""
    place = f"{name}:{_line(node)}"
    if id(node) in above:
        raise JobError("a value contains itself (a cyclic alias)", place)
    if id(node) in sizes:
        return sizes[id(node)]
    if len(above) >= MAX_NESTING:
        raise JobError(f"nested too deeply: expected at most {MAX_NESTING} levels", place)
    above.append(id(node))
    size = 1
    if isinstance(node, yaml.MappingNode):
        seen: set[str] = set()
        for key, value in node.value:
            if isinstance(key, yaml.ScalarNode):
                if key.value in seen and key.tag != "tag:yaml.org,2002:merge":
                    raise JobError(f"the key `{key.value}` is given twice", f"{name}:{_line(key)}")
                seen.add(key.value)
            size += 1 + _check(value, name, above, sizes)
    elif isinstance(node, yaml.SequenceNode):
        size += sum(_check(value, name, above, sizes) for value in node.value)
    if size > MAX_NODES:
        raise JobError(f"more than {MAX_NODES} values: expected a short job file (large data belongs in files of its own)", place)
    above.pop()
    sizes[id(node)] = size
    return size


def _construct(root: yaml.MappingNode, name: str) -> dict[Any, Any]:
    """Plain Python values of a checked tree."""
    loader = _Loader("")
    try:
        return dict(loader.construct_document(root))
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        raise JobError(f"not valid YAML: {error.problem}", f"{name}:{mark.line + 1 if mark else 1}") from None
    except (ValueError, OverflowError) as error:
        raise JobError(f"a value cannot be read: {error}", f"{name}:{_line(root)}") from None
    finally:
        loader.dispose()


def _find(node: yaml.Node | None, location: Location) -> yaml.Node | None:
    """The deepest node on the way to ``location``; a mapping's entry is found at its key's line."""
    if node is None or not location:
        return node
    step, rest = location[0], location[1:]
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if getattr(key, "value", None) == str(step):
                return _find(value, rest) if rest and isinstance(value, yaml.CollectionNode) else key
    if isinstance(node, yaml.SequenceNode) and isinstance(step, int) and step < len(node.value):
        return _find(node.value[step], rest)
    return node


def _line(node: yaml.Node | None) -> int:
    return node.start_mark.line + 1 if node is not None and node.start_mark else 1


def _kind(node: Any) -> str:
    return {"ScalarNode": "single value", "SequenceNode": "list", "MappingNode": "mapping"}.get(type(node).__name__, "value")


# --- --set key=value ----------------------------------------------------------------------------------------------


def _apply(data: dict[Any, Any], setting: str) -> Location:
    """Put one ``dotted.key=value`` into the job's data; returns where it went. The value is read as YAML."""
    key, equals, text = setting.partition("=")
    steps = key.strip().split(".")
    if not equals or not all(steps):
        raise JobError("expected key=value with a dotted key, such as render.samples=16", f"--set {setting}")
    root = _compose(text, f"--set {key}")
    value = None if root is None else _construct(_wrapped(root), f"--set {key}")["value"]
    section = data
    for step in steps[:-1]:
        inner = section.setdefault(step, {})
        if not isinstance(inner, dict):
            raise JobError(f"`{step}` is a single value here, and has no key `{steps[-1]}`", f"--set {setting}")
        section[step] = section = dict(inner)
    section[steps[-1]] = value
    return tuple(steps)


def _wrapped(node: yaml.Node) -> yaml.MappingNode:
    key = yaml.ScalarNode("tag:yaml.org,2002:str", "value", node.start_mark, node.end_mark)
    return yaml.MappingNode("tag:yaml.org,2002:map", [(key, node)], node.start_mark, node.end_mark)
