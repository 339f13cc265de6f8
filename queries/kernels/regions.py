"""Points and segments against balls, boxes and shapes drawn on the film.

Positions are float32 (n, 3); all arithmetic is float64, so that a point on a border is rounded once only, when it was stored.
Segments are closed: their ends belong to them. Where an answer is written it overwrites, unless the docstring says otherwise.
"""

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
U8 = npt.NDArray[np.uint8]
Bools = npt.NDArray[np.bool_]

TINY = 1e-300

# --- balls and boxes ----------------------------------------------------------------------------------------------


@kernel
def ball_contains(points: F32, center: F64, radius: float, inside: Bools) -> None:
    """``inside`` (n,): points within ``radius`` of ``center`` (3,)."""
    cx, cy, cz = center[0], center[1], center[2]
    for i in range(len(points)):
        x, y, z = points[i, 0] - cx, points[i, 1] - cy, points[i, 2] - cz
        inside[i] = x * x + y * y + z * z <= radius * radius


@kernel
def ball_crosses(start: F32, end: F32, center: F64, radius: float, crosses: Bools) -> None:
    """``crosses`` (n,): segments whose point nearest to the center lies within ``radius``."""
    cx, cy, cz = center[0], center[1], center[2]
    for i in range(len(start)):
        ox, oy, oz = start[i, 0] - cx, start[i, 1] - cy, start[i, 2] - cz
        ex, ey, ez = end[i, 0] - cx, end[i, 1] - cy, end[i, 2] - cz
        dx, dy, dz = ex - ox, ey - oy, ez - oz
        squared_length = dx * dx + dy * dy + dz * dz
        along = min(max(-(ox * dx + oy * dy + oz * dz), 0.0), squared_length)
        t = along / max(squared_length, TINY)
        x, y, z = ox + t * dx, oy + t * dy, oz + t * dz
        crosses[i] = (x * x + y * y + z * z <= radius * radius) | (ex * ex + ey * ey + ez * ez <= radius * radius)


@kernel
def box_contains(points: F32, center: F64, axes: F64, half: F64, inside: Bools) -> None:
    """``inside`` (n,): points of the box with these unit ``axes`` (3, 3), one in each row, and half lengths along them (3,)."""
    cx, cy, cz = center[0], center[1], center[2]
    for i in range(len(points)):
        x, y, z = points[i, 0] - cx, points[i, 1] - cy, points[i, 2] - cz
        a = abs(axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z)
        b = abs(axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z)
        c = abs(axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z)
        inside[i] = (a <= half[0]) & (b <= half[1]) & (c <= half[2])


@kernel
def box_crosses(start: F32, end: F32, center: F64, axes: F64, half: F64, crosses: Bools) -> None:
    """``crosses`` (n,): segments with a point in the box; see ``box_contains``.

    Where there is none, some direction separates the two: one of the box's axes, or one at right angles to such an axis and to the segment.
    An end that lies within is looked at by itself, so that rounding never loses it.
    """
    cx, cy, cz = center[0], center[1], center[2]
    hx, hy, hz = half[0], half[1], half[2]
    for i in range(len(start)):
        x, y, z = start[i, 0] - cx, start[i, 1] - cy, start[i, 2] - cz
        sx = axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z
        sy = axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z
        sz = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
        x, y, z = end[i, 0] - cx, end[i, 1] - cy, end[i, 2] - cz
        ex = axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z
        ey = axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z
        ez = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
        mx, my, mz = 0.5 * (sx + ex), 0.5 * (sy + ey), 0.5 * (sz + ez)
        vx, vy, vz = 0.5 * (ex - sx), 0.5 * (ey - sy), 0.5 * (ez - sz)
        dx, dy, dz = abs(vx), abs(vy), abs(vz)
        along_axes = (abs(mx) <= hx + dx) & (abs(my) <= hy + dy) & (abs(mz) <= hz + dz)
        across_x = abs(my * vz - mz * vy) <= hy * dz + hz * dy
        across_y = abs(mz * vx - mx * vz) <= hz * dx + hx * dz
        across_z = abs(mx * vy - my * vx) <= hx * dy + hy * dx
        start_inside = (abs(sx) <= hx) & (abs(sy) <= hy) & (abs(sz) <= hz)
        end_inside = (abs(ex) <= hx) & (abs(ey) <= hy) & (abs(ez) <= hz)
        crosses[i] = (along_axes & across_x & across_y & across_z) | start_inside | end_inside


# --- the film -----------------------------------------------------------------------------------------------------


@kernel
def project(points: F32, to_camera: F64, film: F64, raster: F64, before: Bools) -> None:
    """Where on the film points are seen, ``raster`` (n, 2) in pixels, and whether they lie before the camera, ``before`` (n,).

    ``to_camera`` (3, 4); ``film`` (8,): tangents of half the angles of view, shifts of the principal point as shares of the film,
    width and height in pixels, near and far clipping distances. In camera space the camera looks along +z, x to the left, y up.
    Points outside of the clipping distances are not before the camera, and their raster positions mean nothing.
    """
    for i in range(len(points)):
        x, y, z = np.float64(points[i, 0]), np.float64(points[i, 1]), np.float64(points[i, 2])
        depth = to_camera[2, 0] * x + to_camera[2, 1] * y + to_camera[2, 2] * z + to_camera[2, 3]
        before[i] = depth > film[6] and depth < film[7]
        left = (to_camera[0, 0] * x + to_camera[0, 1] * y + to_camera[0, 2] * z + to_camera[0, 3]) / depth
        up = (to_camera[1, 0] * x + to_camera[1, 1] * y + to_camera[1, 2] * z + to_camera[1, 3]) / depth
        raster[i, 0] = film[4] * (0.5 * (1.0 - left / film[0]) - film[2])
        raster[i, 1] = film[5] * (0.5 * (1.0 - up / film[1]) - film[3])


@kernel
def within(raster: F64, low_x: float, low_y: float, high_x: float, high_y: float, kept: Bools) -> None:
    """Clear ``kept`` (n,) where the film position lies outside of a rectangle; its sides belong to it."""
    for i in range(len(raster)):
        if not (low_x <= raster[i, 0] <= high_x and low_y <= raster[i, 1] <= high_y):
            kept[i] = False


@kernel
def in_polygon(raster: F64, corners: F64, inside: Bools) -> None:
    """Set ``inside`` (n,) where the film position lies in the polygon with these ``corners`` (m, 2): its sides are crossed an odd number of times."""
    for i in range(len(raster)):
        x, y = raster[i, 0], raster[i, 1]
        odd = False
        previous = len(corners) - 1
        for k in range(len(corners)):
            # A side spans the half-open range of its ends' y, so that each corner counts once.
            if (corners[k, 1] > y) != (corners[previous, 1] > y):
                share = (y - corners[k, 1]) / (corners[previous, 1] - corners[k, 1])
                if x < corners[k, 0] + share * (corners[previous, 0] - corners[k, 0]):
                    odd = not odd
            previous = k
        if odd:
            inside[i] = True


@kernel
def near_polyline(raster: F64, line: F64, radius: float, inside: Bools) -> None:
    """Set ``inside`` (n,) where the film position lies within ``radius`` of the polyline with these corners (m, 2), m at least 1."""
    for i in range(len(raster)):
        for k in range(max(len(line) - 1, 1)):
            last = min(k + 1, len(line) - 1)
            dx, dy = line[last, 0] - line[k, 0], line[last, 1] - line[k, 1]
            x, y = raster[i, 0] - line[k, 0], raster[i, 1] - line[k, 1]
            squared_length = dx * dx + dy * dy
            along = min(max(x * dx + y * dy, 0.0), squared_length)
            if along > 0.0:
                x -= along / squared_length * dx
                y -= along / squared_length * dy
            if x * x + y * y <= radius * radius:
                inside[i] = True
                break


@kernel
def clip_segments(start: F32, end: F32, planes: F64, parts: F64) -> None:
    """``parts`` (n, 2): the part [near, far] of each segment, from 0 to 1, on the inner side of all ``planes`` (m, 4); near > far where none is.

    A plane (a, b, c, d) has its inner side where a x + b y + c z + d >= 0.
    """
    for i in range(len(start)):
        near, far = 0.0, 1.0
        for k in range(len(planes)):
            s = planes[k, 0] * start[i, 0] + planes[k, 1] * start[i, 1] + planes[k, 2] * start[i, 2] + planes[k, 3]
            e = planes[k, 0] * end[i, 0] + planes[k, 1] * end[i, 1] + planes[k, 2] * end[i, 2] + planes[k, 3]
            if s < 0.0 and e < 0.0:
                near, far = 1.0, 0.0
                break
            if s < 0.0:
                near = max(near, s / (s - e))
            elif e < 0.0:
                far = min(far, s / (s - e))
        parts[i, 0] = near
        parts[i, 1] = far


# --- exact spheres, disks and cylinders ---------------------------------------------------------------------------

SPHERE, DISK, CYLINDER = range(3)  # the catalogue's kinds: the unit sphere, the unit disk at z = 0, the open cylinder of radius 1 over z in [0, 1]
Vec3 = tuple[float, float, float]


@kernel
def to_local(m: F64, q: int, x: float, y: float, z: float, w: float) -> Vec3:
    """Matrix ``q`` of (nq, 3, 4) times (x, y, z, w): w is 1 for points, 0 for directions."""
    return (
        m[q, 0, 0] * x + m[q, 0, 1] * y + m[q, 0, 2] * z + m[q, 0, 3] * w,
        m[q, 1, 0] * x + m[q, 1, 1] * y + m[q, 1, 2] * z + m[q, 1, 3] * w,
        m[q, 2, 0] * x + m[q, 2, 1] * y + m[q, 2, 2] * z + m[q, 2, 3] * w,
    )


@kernel
def meet_disk(o: Vec3, d: Vec3) -> float:
    """The t > 0 where a local ray meets the unit disk; inf if none."""
    t = -o[2] / d[2]
    x, y = o[0] + t * d[0], o[1] + t * d[1]
    return float(t if t > 0.0 and x * x + y * y <= 1.0 else np.inf)


@kernel
def meet_round(o: Vec3, d: Vec3, along: float) -> float:
    """The first t > 0 where a local ray meets the unit sphere (``along`` 1) or the open cylinder (``along`` 0); inf if none.

    The line's point nearest to the center or axis comes first, which avoids the cancellation of the textbook discriminant (haines2019).
    """
    a = d[0] * d[0] + d[1] * d[1] + along * d[2] * d[2]
    middle = -(o[0] * d[0] + o[1] * d[1] + along * o[2] * d[2]) / a
    x, y, z = o[0] + middle * d[0], o[1] + middle * d[1], o[2] + middle * d[2]
    squared_distance = x * x + y * y + along * z * z
    if not (squared_distance <= 1.0 and a > 0.0):
        return np.inf
    half = np.sqrt((1.0 - squared_distance) / a)
    for t in (middle - half, middle + half):
        height = o[2] + t * d[2]
        if t > 0.0 and (along == 1.0 or (height >= 0.0 and height <= 1.0)):
            return float(t)
    return np.inf


@kernel
def meet_quadric(kind: U8, to_object: F64, q: int, o: F32, d: F32, i: int) -> float:
    """The first t > 0 where ray ``i`` meets quadric ``q``; inf if none."""
    local_o = to_local(to_object, q, np.float64(o[i, 0]), np.float64(o[i, 1]), np.float64(o[i, 2]), 1.0)
    local_d = to_local(to_object, q, np.float64(d[i, 0]), np.float64(d[i, 1]), np.float64(d[i, 2]), 0.0)
    along = 1.0 if kind[q] == SPHERE else 0.0
    return meet_disk(local_o, local_d) if kind[q] == DISK else meet_round(local_o, local_d, along)


@kernel
def closest_quadric(kind: U8, to_object: F64, first: int, o: F32, d: F32, t: F32, primitive: npt.NDArray[np.int32]) -> None:
    """Lower ``t`` (n,), in units of d, and set ``primitive`` (n,) to ``first`` + row where a ray meets a quadric before t."""
    for i in range(len(o)):
        for q in range(len(kind)):
            distance = np.float32(meet_quadric(kind, to_object, q, o, d, i))
            if distance < t[i]:
                t[i] = distance
                primitive[i] = first + q


@kernel
def blocked_by_quadric(kind: U8, to_object: F64, o: F32, d: F32, far: F32, blocked: Bools) -> None:
    """Set ``blocked`` (n,) where a quadric lies on the ray before ``far``, in units of d."""
    for i in range(len(o)):
        for q in range(len(kind)):
            if not blocked[i] and np.float32(meet_quadric(kind, to_object, q, o, d, i)) < far[i]:
                blocked[i] = True


@kernel
def in_quadric(to_object: F64, points: F32, inside: Bools) -> None:
    """Set ``inside`` (n,) where a point lies in the sphere (in one of the spheres) of these matrices (nq, 3, 4)."""
    for i in range(len(points)):
        for q in range(len(to_object)):
            x, y, z = to_local(to_object, q, np.float64(points[i, 0]), np.float64(points[i, 1]), np.float64(points[i, 2]), 1.0)
            if x * x + y * y + z * z <= 1.0:
                inside[i] = True
