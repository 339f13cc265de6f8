"""What a trace is asked to do: the estimator's settings, checked and complete."""

from dataclasses import dataclass, field

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

    @property
    def walks_per_pass(self) -> int:
        """Walk ids are pass-major: ``pass * walks_per_pass + i``; i is the pixel of a camera walk."""
        return self.width * self.height

    @property
    def walks(self) -> int:
        """Number of walks of the whole render."""
        return self.passes * self.walks_per_pass
