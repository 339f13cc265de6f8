"""The estimators by name: which kernels a method runs, with what."""

import numpy as np
import numpy.typing as npt

from renderer.integrators.base import Estimator
from renderer.integrators.buffers import Counters, TileBuffers
from renderer.integrators.light import interact_light, start_light_walks
from renderer.integrators.path import interact, start_camera_walks
from renderer.samples import primary_samples
from renderer.scene.arrays import Scene
from renderer.settings import TraceSettings


class PathTracer:
    """Camera walks with next-event estimation."""

    def __init__(self, scene: Scene, settings: TraceSettings) -> None:
        self.arrays = scene.arrays
        self.settings = settings
        self.samples = primary_samples(settings)

    def start(self, buffers: TileBuffers, n: int, recording: bool) -> Counters:
        """Camera rays of the first n lanes."""
        start_camera_walks(self.arrays.sensor, self.samples, buffers.lanes, buffers.rays, buffers.t, n)
        return Counters(n, 0, 0, 0, 0)

    def interact(
        self, buffers: TileBuffers, t: npt.NDArray[np.float32], primitives: npt.NDArray[np.int32], depth: int, recording: bool, counters: Counters
    ) -> Counters:
        """Emission, one emitter sample, scattering."""
        return interact(  # type: ignore[no-any-return]
            self.arrays, self.samples, buffers.lanes, buffers.rays, t, primitives, depth, self.settings.max_depth, self.settings.rr_depth,
            recording, buffers.next_rays, buffers.shadow, buffers.vertices, buffers.paths, buffers.words, counters,
        )  # fmt: skip


class LightTracer:
    """Light walks connected to the lens."""

    def __init__(self, scene: Scene, settings: TraceSettings) -> None:
        self.arrays = scene.arrays
        self.settings = settings
        self.samples = primary_samples(settings)

    def start(self, buffers: TileBuffers, n: int, recording: bool) -> Counters:
        """Rays of light that leave the emitters, each emitter's point connected to the lens."""
        return start_light_walks(  # type: ignore[no-any-return]
            self.arrays, self.samples, buffers.lanes, buffers.rays, buffers.t, n, self.settings.max_depth, recording, buffers.shadow,
            buffers.vertices, buffers.paths,
        )  # fmt: skip

    def interact(
        self, buffers: TileBuffers, t: npt.NDArray[np.float32], primitives: npt.NDArray[np.int32], depth: int, recording: bool, counters: Counters
    ) -> Counters:
        """One connection to the lens, scattering by the adjoint."""
        return interact_light(  # type: ignore[no-any-return]
            self.arrays, self.samples, buffers.lanes, buffers.rays, t, primitives, depth, self.settings.max_depth, self.settings.rr_depth,
            recording, buffers.next_rays, buffers.shadow, buffers.vertices, buffers.paths, buffers.words, counters,
        )  # fmt: skip


ESTIMATORS: dict[str, type[PathTracer] | type[LightTracer]] = {"path": PathTracer, "light": LightTracer}
"""All estimators by the name that jobs use."""


def estimator(scene: Scene, settings: TraceSettings) -> Estimator:
    """The estimator of ``settings.method`` for the scene. Raises ValueError with the known names."""
    if settings.method not in ESTIMATORS:
        raise ValueError(f"unknown method {settings.method!r}; known: {', '.join(ESTIMATORS)}")
    return ESTIMATORS[settings.method](scene, settings)
