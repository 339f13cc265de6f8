"""The stage of a picture: the scene, what a tool adds to it, and pictures of it from any pose, without a screen."""

from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from viz.cameras import Pose
from viz.look import Look
from viz.opengl import new_plotter
from viz.scene.actors import SceneActors

if TYPE_CHECKING:
    from queries.regions.scene import SceneGeometry
    from queries.run import Run

F64 = npt.NDArray[np.float64]
U8 = npt.NDArray[np.uint8]
OVERSAMPLING = 2  # pixels drawn for each of the picture's, in each direction, so that edges are smooth
_HEAVY = 6e12  # points of meshes x pixels of the picture, from which on edges are not smoothed: 6 million points in a picture of a megapixel
_LARGEST = 16384  # pixels that software OpenGL draws side by side
_KEY_LIGHT, _FILL_LIGHT = (0.55, (-0.6, 0.8, 1.0)), (0.5, (0.5, -0.1, 1.0))  # intensity, and from where: right, up, towards the eye


class Stage:
    """A scene to draw on: a context manager. The same calls give the same pixels on one machine.

    ``plotter``: the ``pyvista.Plotter``, off screen; ``size``: width and height of pictures; ``before_picture``: called with the pose before each
    picture, for what depends on the eye; ``oversampling``: pixels drawn for each pixel of the picture, in each direction (none: 2, or 1 where so
    much is drawn that it would take too long). Widths of lines and sizes of points are pixels of the picture. Opaque things are seen through
    translucent surfaces; translucent ones are blended in the order in which they are added, after the scene. Raises ``DrawingError`` where a machine
    cannot draw, ``QueryError`` for objects to hide that the scene lacks, and for a run that does not store its surfaces.
    """

    def __init__(self, run: "Run", look: Look | None = None, size: tuple[int, int] = (960, 720)) -> None:
        self.run = run
        self.look = look or Look()
        self.size = size
        self.oversampling: int | None = None
        self.before_picture: list[Callable[[Pose], None]] = []
        for name in self.look.hide:
            run.geometry.object_id(name)
        self.plotter: Any = new_plotter(size)
        # Else VTK blends what is translucent without regard to order, approximately and slowly
        self.plotter.renderer.SetUseOIT(False)
        self._light()
        self._scene = SceneActors(run, self.look, self.plotter) if self.look.scene != "hidden" else None

    @property
    def geometry(self) -> "SceneGeometry":
        """The scene's surfaces."""
        return self.run.geometry

    @property
    def extent(self) -> float:
        """The diagonal of the bounds of all surfaces and the camera, world units."""
        return self.run.geometry.extent

    @property
    def bounds(self) -> F64:
        """The least and largest coordinates (2, 3) of the scene's surfaces. Raises ``QueryError`` for a run that does not store them."""
        return self.run.geometry.caster.bounds

    def add(self, mesh: Any, **options: Any) -> Any:
        """Add a mesh, with the options of ``pyvista.Plotter.add_mesh``; returns its actor."""
        return self.plotter.add_mesh(mesh, **{"reset_camera": False, "render": False, "show_scalar_bar": False, "copy_mesh": False} | options)

    def show_surfaces(self, shown: bool) -> None:
        """Whether the scene's surfaces are drawn, or, by a tool that draws its own, only edges and outlines."""
        if self._scene is not None:
            self._scene.show_surfaces(shown)

    def picture(self, pose: Pose) -> U8:
        """What is on the stage, seen from a pose: uint8 (height, width, 3), sRGB."""
        factor = self._factor()
        width, height = self.size[0] * factor, self.size[1] * factor
        self._aim(pose)
        for prepare in self.before_picture:
            prepare(pose)
        if self._scene is not None:
            self._scene.prepare(pose)
        self.plotter.renderer.ResetCameraClippingRange()
        if tuple(self.plotter.ren_win.GetSize()) != (width, height):
            self.plotter.ren_win.SetSize(width, height)
        restore = self._scale_lines(factor)
        try:
            self.plotter.ren_win.Render()
            drawn = self._pixels(width, height)
        finally:
            restore()
        image = _shrunk(drawn, factor)
        return np.ascontiguousarray(image[:, ::-1] if pose.mirrored else image)

    def close(self) -> None:
        """Free the plotter and all that was drawn."""
        self._scene = None
        self.before_picture.clear()
        self.plotter.close()

    def __enter__(self) -> "Stage":
        """The stage itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Close."""
        self.close()

    # --- how it is drawn ----------------------------------------------------------------------------------------------

    def _light(self) -> None:
        """Two white lights that move with the camera, so that no side of the scene is ever dark."""
        import pyvista

        self.plotter.set_background(self.look.background_color)
        for intensity, place in (_KEY_LIGHT, _FILL_LIGHT):
            light = pyvista.Light(light_type="camera light", intensity=intensity)
            light.position = place
            self.plotter.add_light(light)

    def _factor(self) -> int:
        """Pixels drawn for each pixel of the picture, in each direction."""
        wanted = self.oversampling
        if wanted is None:
            meshes = [actor.mapper.dataset for actor in self.plotter.renderer.actors.values() if getattr(actor, "mapper", None) is not None]
            points = sum(mesh.n_points for mesh in meshes if mesh is not None)
            wanted = OVERSAMPLING if points * self.size[0] * self.size[1] < _HEAVY else 1
        return max(1, min(wanted, _LARGEST // max(self.size)))

    def _aim(self, pose: Pose) -> None:
        camera = self.plotter.renderer.camera
        camera.SetPosition(pose.position)
        camera.SetFocalPoint(pose.target)
        camera.SetViewUp(pose.up)
        camera.SetViewAngle(2 * float(np.degrees(np.arctan(pose.tangents(self.size)[1]))))
        right, up = pose.center(self.size)
        camera.SetWindowCenter(-right if pose.mirrored else right, up)

    def _scale_lines(self, factor: int) -> Callable[[], None]:
        """Lines and points as many times as wide as pixels are small; returns what undoes it."""
        properties = [actor.GetProperty() for actor in self.plotter.renderer.actors.values() if hasattr(actor, "GetProperty")]
        before = [(p, p.GetLineWidth(), p.GetPointSize()) for p in properties if hasattr(p, "GetLineWidth")]
        for p, line, point in before:
            p.SetLineWidth(line * factor)
            p.SetPointSize(point * factor)

        def restore() -> None:
            for p, line, point in before:
                p.SetLineWidth(line)
                p.SetPointSize(point)

        return restore

    def _pixels(self, width: int, height: int) -> U8:
        from pyvista import convert_array
        from vtkmodules.vtkCommonCore import vtkUnsignedCharArray

        values = vtkUnsignedCharArray()
        self.plotter.ren_win.GetPixelData(0, 0, width - 1, height - 1, 0, values, 0)
        image: U8 = convert_array(values).reshape(height, width, 3)[::-1]
        return image


def _shrunk(image: U8, factor: int) -> U8:
    """The means of squares of pixels, rounded: uint8 (height / factor, width / factor, 3)."""
    if factor == 1:
        return image.copy()
    total = np.zeros((image.shape[0] // factor, image.shape[1] // factor, 3), np.uint16)
    for y in range(factor):
        for x in range(factor):
            total += image[y::factor, x::factor]
    return ((total + factor * factor // 2) // (factor * factor)).astype(np.uint8)
