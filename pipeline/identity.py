"""What makes two runs the same run: the settings of the trace and the compiled scene, down to the last bit."""

import functools
import hashlib
import importlib.metadata
import json
import platform
from dataclasses import MISSING, asdict, fields
from typing import Any

import llvmlite.binding  # type: ignore[import-untyped]
import numpy as np

from pipeline.config import Job
from pipeline.errors import JobError
from renderer.kernel import cache_folder
from renderer.scene.arrays import Scene
from renderer.settings import UNBOUNDED_DEPTH, TraceSettings

MAX_WALKS = 2**40
_PACKAGES = ("pathspace", "numpy", "numba", "llvmlite", "embreex", "trimesh", "OpenImageIO", "pyarrow", "duckdb", "scipy")
_DEFAULTS: dict[str, Any] = {field.name: field.default for field in fields(TraceSettings) if field.default is not MISSING}


def trace_settings(job: Job, scene: Scene) -> TraceSettings:
    """The complete settings of a job: what it leaves out comes from the scene. Raises JobError."""
    render, defaults = job.render, scene.defaults
    width, height = render.resolution or (defaults.width, defaults.height)
    depth = defaults.max_depth if render.max_depth is None else render.max_depth
    try:
        settings = TraceSettings(
            method=render.method or defaults.method,
            width=width,
            height=height,
            passes=render.samples or defaults.samples,
            max_depth=UNBOUNDED_DEPTH if depth < 0 else min(depth, UNBOUNDED_DEPTH),
            rr_depth=min(render.rr_depth or defaults.rr_depth, UNBOUNDED_DEPTH + 1),  # no walk is deeper, so never
            seed=defaults.seed if render.seed is None else render.seed,
            sampler=render.sampler or defaults.sampler,
            replicates=render.replicates,
            filter=render.filter or defaults.filter,
            keep=job.record.share,
            columns=frozenset(job.record.columns),
            occluded=job.record.occluded,
            texture_filter=render.texture_filter,
            texture_layout=render.texture_layout,
        )
    except ValueError as error:
        raise JobError(f"render: {error}") from None
    if settings.walks > MAX_WALKS:
        raise JobError(f"{settings.walks} walks are more than a run can hold ({MAX_WALKS}): lower render.samples or render.resolution")
    return settings


def settings_as_json(settings: TraceSettings) -> dict[str, Any]:
    """The settings as plain values, the same text each time."""
    return {**asdict(settings), "columns": sorted(settings.columns)}


def scene_digest(scene: Scene) -> str:
    """SHA-256, in hexadecimal, of all that the scene gives to kernels and catalogues (not of file names or formatting)."""
    digest = hashlib.sha256()
    *arrays, ewa = scene.arrays
    _add(digest, arrays)
    if ewa is not None:
        _add(digest, [value for name, value in ewa._asdict().items() if name != "pyramid"])  # smaller versions of what is in already
    _add(digest, [asdict(item) for item in scene.objects])
    _add(digest, [asdict(item) for item in scene.emitters])
    _add(digest, (scene.vertices, scene.triangles))
    return digest.hexdigest()


def _add(digest: Any, value: Any) -> None:
    """Feed a tree of named tuples, lists, dictionaries, arrays and plain values into a digest, with its structure."""
    if isinstance(value, np.ndarray):
        digest.update(f"{value.dtype}{value.shape}".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, (tuple, list)):
        digest.update(f"({len(value)}".encode())
        for item in value:
            _add(digest, item)
    elif isinstance(value, dict):
        _add(digest, sorted(value.items()))
    else:
        digest.update(f"{type(value).__name__}:{value!r};".encode())


def fingerprint(settings: TraceSettings, scene: Scene) -> dict[str, Any]:
    """What must be equal for a run to be gone on with."""
    return {"settings": settings_as_json(settings), "scene": scene_digest(scene)}


@functools.cache
def renderer_version() -> str:
    """A hash of the renderer's sources and compilers: equal versions give equal bits."""
    return cache_folder().name.removeprefix("kernels-")


def processor() -> str:
    """The processor that kernels are compiled for: another one may have other instructions, and so other last bits."""
    return str(llvmlite.binding.get_host_cpu_name())


def differences(old: dict[str, Any], new: dict[str, Any]) -> str:
    """In words, how two fingerprints differ; empty where they do not. A setting that an older program did not have stands for its default."""
    before, after = {**_DEFAULTS, **old.get("settings", {})}, new["settings"]
    parts = [f"{key} {before.get(key)!r} -> {after.get(key)!r}" for key in after if before.get(key) != after.get(key)]
    if old.get("scene") != new["scene"]:
        parts.append("the scene")
    return ", ".join(parts)


def versions() -> dict[str, str]:
    """Versions of everything that a pixel depends on."""
    found = {name: importlib.metadata.version(name) for name in _PACKAGES}
    return {"python": platform.python_version(), "machine": platform.machine(), "processor": processor(), "renderer": renderer_version(), **found}


def camera(scene: Scene) -> dict[str, Any]:
    """The sensor as plain values: matrices by row, angles as tangents, lengths in world units."""
    plain = {name: None if value is None else np.asarray(value).tolist() for name, value in scene.arrays.sensor._asdict().items()}
    return dict(json.loads(json.dumps(plain)))
