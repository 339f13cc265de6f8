"""The energy of each class of light paths, read off the recorded words: camera words as they stand, light words in reverse."""

import numpy as np
from rendering import F64, Tables, columns

from renderer.scene.arrays import Scene
from renderer.settings import TraceSettings
from renderer.tables import CAMERA_ROOT, EVENTS, LIGHT_ROOT

LETTERS = {event.key: f"{event.type}{event.scattering}" for event in EVENTS if event.scattering}
Energies = dict[str, F64]  # class -> (replicates, 3)


def spellings(tables: Tables, method: str) -> dict[int, tuple[str, ...]]:
    """The events of each word, from the camera to the light."""
    root = CAMERA_ROOT if method == "path" else LIGHT_ROOT
    words = {row["word"]: row for row in tables["words"].to_pylist()}
    known: dict[int, tuple[str, ...]] = {root: ()}

    def spell(word: int) -> tuple[str, ...]:
        if word not in known:
            row = words[word]
            known[word] = (*spell(row["parent"]), LETTERS[row["event"]])
        return known[word]

    return {word: spell(word) if method == "path" else spell(word)[::-1] for word in [root, *words]}


def class_energies(tables: Tables, scene: Scene, settings: TraceSettings, replicates: int) -> tuple[Energies, dict[str, int]]:
    """For each class (its events and its emitter, as "RD TS L:lamp"): mean pixel values (replicates, 3), and the number of rows.

    Replicates are ranges of passes of equal length.
    """
    side = "camera" if settings.method == "path" else "light"
    paths = columns(tables["paths"])
    word, inverse = np.unique(paths[f"{side}_word"], return_inverse=True)
    spelled = spellings(tables, settings.method)
    key = inverse * len(scene.emitters) + paths["emitter"]
    of_key = np.array([" ".join((*spelled[int(w)], f"L:{emitter.name}")) for w in word for emitter in scene.emitters])
    classes, class_of_key = np.unique(of_key, return_inverse=True)
    which = class_of_key[key]
    chunk = paths[f"{side}_walk"].astype(np.int64) // settings.walks_per_pass * replicates // settings.passes
    value = np.stack([paths[f"contribution_{c}"] for c in "rgb"], axis=1).astype(np.float64)
    value /= settings.passes / replicates * settings.walks_per_pass
    energies: Energies = {}
    counts: dict[str, int] = {}
    total = np.bincount(which, minlength=len(classes))
    sums = [np.bincount(which * replicates + chunk, value[:, c], len(classes) * replicates).reshape(-1, replicates) for c in range(3)]
    for k in np.flatnonzero(total):
        energies[str(classes[k])] = np.stack([s[k] for s in sums], axis=1)
        counts[str(classes[k])] = int(total[k])
    return energies, counts
