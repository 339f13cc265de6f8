"""What a trace is asked to do: the estimator's settings, checked and complete."""

from dataclasses import dataclass, field

TEXTURE_FILTERS = ("point", "ewa")
UNBOUNDED_DEPTH = 255  # depths are stored in a byte; `max_depth: -1` means this


@dataclass(frozen=True)
class TraceSettings:
    """Settings of one estimator over one scene. Sizes are in pixels, depths in path segments (Mitsuba's meaning)."""

    method: str  # "path" or "light"
    width: int
    height: int
    passes: int  # samples of each pixel
    max_depth: int  # 1 … 255
    rr_depth: int  # Russian roulette from this depth on
    seed: int
    sampler: str = "independent"  # or "sobol"
    replicates: int = 4  # independent scramblings that Sobol passes take in turn
    filter: str = "box"
    keep: float = 1.0  # share of the walks that are recorded, chosen by a hash of their ids; 0 records nothing
    columns: frozenset[str] = field(default_factory=frozenset)  # optional columns to record: primitive, u, v
    occluded: bool = False  # record blocked connections too
    texture_filter: str = "point"  # or "ewa": how bitmaps are read where the camera sees them
    texture_layout: str | None = None  # with "ewa", the display whose subpixel filters are folded in

    def __post_init__(self) -> None:
        """Check that the texture's filter goes with the rest. Raises ValueError."""
        if self.texture_filter not in TEXTURE_FILTERS:
            raise ValueError(f"unknown texture filter {self.texture_filter!r}; known: {', '.join(TEXTURE_FILTERS)}")
        if self.texture_filter == "point":
            if self.texture_layout is not None:
                raise ValueError(f"the texture layout {self.texture_layout!r} is for the texture filter 'ewa'; the filter is 'point'")
            return
        if self.method != "path":
            raise ValueError(f"the texture filter 'ewa' is for camera walks, method 'path'; the method is {self.method!r}")
        if self.filter != "box":
            raise ValueError(
                f"the texture filter 'ewa' needs the film's filter 'box', but that is {self.filter!r}: all samples of a pixel have the pixel's "
                "filtered color already, so any wider filter would blur it a second time"
            )

    @property
    def walks_per_pass(self) -> int:
        """Walk ids are pass-major: ``pass * walks_per_pass + i``; i is the pixel of a camera walk."""
        return self.width * self.height

    @property
    def walks(self) -> int:
        """Number of walks of the whole render."""
        return self.passes * self.walks_per_pass
