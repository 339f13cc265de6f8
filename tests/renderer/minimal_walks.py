"""What the minimal path tracer finds, run as plain Python: a program, because the JIT is switched off for a whole process.

``python minimal_walks.py FOLDER`` reads the compiled scenes of ``FOLDER/cases.pickle`` (compiling one takes long without the JIT) and
writes ``FOLDER/walks.npz``: for each case, the radiance of its walks.
"""

import os
import pathlib
import pickle
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from rendering import settings_of, with_all_features
from scenes.catalogue import diffuse_box, plastics, textured_surfaces, thin_lens
from scenes.mixed import mixed

from renderer.integrators.minimal import MinimalPathTracer
from renderer.scene.arrays import Scene
from renderer.scene.load import load_scene
from renderer.settings import TraceSettings

WALKS = 500
Folder = pathlib.Path


def lit_by_sky_only(folder: Folder) -> dict[str, Any]:
    """The mixed scene without its own lights."""
    return {name: part for name, part in mixed().items() if name not in ("lamp", "ball", "bulb")}


CASES: dict[str, tuple[Callable[[Folder], dict[str, Any]], dict[str, Any]]] = {
    "diffuse box": (diffuse_box, {}),
    "mixed": (lambda _: mixed(), {}),
    "mixed with early roulette": (lambda _: mixed(), {"rr_depth": 1}),
    "direct light only": (lambda _: mixed(), {"max_depth": 2}),
    "sky": (lit_by_sky_only, {}),
    "thin lens": (thin_lens, {}),
    "plastics": (plastics, {}),
    "textures": (textured_surfaces, {}),
}


def case(name: str, folder: Folder) -> tuple[Scene, TraceSettings, np.ndarray]:
    """Scene, settings and walks of a case."""
    make, changes = CASES[name]
    scene = load_scene(make(folder))
    if name not in ("diffuse box", "thin lens"):  # which have specializations of their own
        scene = with_all_features(scene)
    settings = settings_of(scene, 8, **changes)
    return scene, settings, np.sort(np.random.default_rng(5).choice(settings.walks, WALKS, replace=False)).astype(np.uint64)


def run(folder: Folder) -> dict[str, np.ndarray]:
    """The radiance (walks, 3) of each case, found by this program in a process without the JIT."""
    (folder / "cases.pickle").write_bytes(pickle.dumps({name: case(name, folder) for name in CASES}))
    paths = [str(Folder(__file__).parent), str(Folder(__file__).parent.parent), *sys.path]
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": os.pathsep.join(filter(None, paths))}
    subprocess.run([sys.executable, __file__, str(folder)], env=environment, check=True, timeout=300)
    return dict(np.load(folder / "walks.npz"))


def main(folder: Folder) -> None:
    np.seterr(all="ignore")  # hashes overflow on purpose, and kernels divide as numpy does
    found = {}
    for name, (scene, settings, walks) in pickle.loads((folder / "cases.pickle").read_bytes()).items():
        twin = MinimalPathTracer(scene, settings)
        found[name] = np.array([twin.radiance(int(walk)) for walk in walks])
    np.savez(folder / "walks.npz", **found)


if __name__ == "__main__":
    main(Folder(sys.argv[1]))
