"""Meshes and images that test scenes read, made on the spot so that no data is stored."""

import pathlib

import numpy as np
import OpenImageIO as oiio
import trimesh


def write_image(path: pathlib.Path, pixels: np.ndarray) -> str:
    """Write pixels (h, w, 3): as 8 bit values for PNG, as floats for EXR; the path as a string."""
    h, w, c = pixels.shape
    kind = "uint8" if path.suffix == ".png" else "float"
    out = oiio.ImageOutput.create(str(path))
    out.open(str(path), oiio.ImageSpec(w, h, c, kind))
    out.write_image(np.ascontiguousarray(pixels, kind if kind == "uint8" else "float32"))
    out.close()
    return str(path)


def gradient_png(folder: pathlib.Path) -> str:
    """A small image with different structure along both axes, 9 x 6 pixels."""
    y, x = np.mgrid[0:6, 0:9]
    return write_image(folder / "gradient.png", np.stack([40 + 24 * x, 230 - 35 * y, 60 + 130 * ((x + 2 * y) % 3 == 0)], axis=-1))


def sky_exr(folder: pathlib.Path) -> str:
    """An environment of 32 x 16 pixels: a gradient and a soft sun."""
    y, x = np.mgrid[0:16, 0:32]
    sun = 14 * np.exp(-((x - 9) ** 2 + (y - 4) ** 2) / 3.0)
    return write_image(folder / "sky.exr", np.stack([0.2 + 0.01 * x + sun, 0.3 + 0.02 * y + sun, 0.9 - 0.03 * y + 0.7 * sun], axis=-1))


def blob(subdivisions: int = 2) -> trimesh.Trimesh:
    """A bumpy closed surface around the origin, of radius near 1, with vertex normals and texture coordinates."""
    ball = trimesh.creation.icosphere(subdivisions)
    p = ball.vertices
    bumps = 1 + 0.15 * np.sin(4 * p[:, :1]) * np.cos(3 * p[:, 1:2] + 1)
    mesh = trimesh.Trimesh(p * bumps, ball.faces, process=False)
    uv = np.stack([0.5 + 0.5 * p[:, 0], 0.5 + 0.5 * p[:, 1]], axis=1)
    mesh.visual = trimesh.visual.TextureVisuals(uv=uv)
    return mesh


def write_obj(folder: pathlib.Path, normals: bool = True, name: str = "blob.obj") -> str:
    """The blob as OBJ, with or without normals; the path as a string."""
    mesh = blob()
    lines = [f"v {x:.7f} {y:.7f} {z:.7f}" for x, y, z in mesh.vertices]
    lines += [f"vt {u:.7f} {v:.7f}" for u, v in mesh.visual.uv]
    if normals:
        lines += [f"vn {x:.7f} {y:.7f} {z:.7f}" for x, y, z in mesh.vertex_normals]
    corner = "{0}/{0}/{0}" if normals else "{0}/{0}"
    lines += ["f " + " ".join(corner.format(i + 1) for i in face) for face in mesh.faces]
    (folder / name).write_text("\n".join(lines) + "\n")
    return str(folder / name)


def write_ply(folder: pathlib.Path) -> str:
    """The blob as ASCII PLY with normals and texture coordinates (u, v)."""
    mesh = blob()
    columns = np.hstack([mesh.vertices, mesh.vertex_normals, mesh.visual.uv])
    header = ["ply", "format ascii 1.0", f"element vertex {len(columns)}"]
    header += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz", "u", "v")]
    header += [f"element face {len(mesh.faces)}", "property list uchar int vertex_indices", "end_header"]
    rows = [" ".join(f"{x:.7f}" for x in row) for row in columns] + [f"3 {a} {b} {c}" for a, b, c in mesh.faces]
    (folder / "blob.ply").write_text("\n".join([*header, *rows]) + "\n")
    return str(folder / "blob.ply")


def write_mesh(folder: pathlib.Path, suffix: str) -> str:
    """The blob in a format that trimesh writes: stl or glb."""
    path = folder / f"blob.{suffix}"
    mesh = blob(1)
    mesh.export(path)
    return str(path)
