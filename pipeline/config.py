"""The job: what a YAML file may say, as a strict schema. ``docs/jobs.md`` is generated from it."""

import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

from queries.regions import RegionDescription, RegionName
from queries.subpixel.description import LayoutName, SubpixelDescription
from renderer.scene.sensors import LARGEST_FILM
from renderer.settings import UNBOUNDED_DEPTH
from viz.cameras import JOB_CAMERA, CameraDescription
from viz.description import View

NAME_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"

RESERVED_IMAGES = {"beauty": "the whole image", "layers": "the image of all layers"}

Name = Annotated[str, Field(pattern=NAME_PATTERN, max_length=100)]
Pixels = Annotated[int, Field(ge=1, le=LARGEST_FILM)]


class Section(BaseModel):
    """A section of a job: unknown keys are errors, and no value is converted silently."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class Render(Section):
    """How light is simulated. A key that is left out takes the value that the scene's film, sampler and integrator ask for."""

    method: Literal["path", "light"] | None = Field(
        default=None, description="The estimator: `path` traces walks from the camera, `light` from the emitters."
    )
    resolution: Annotated[tuple[Pixels, Pixels], Field(strict=False)] | None = Field(
        default=None, description="Width and height of the film, in pixels."
    )
    samples: int | None = Field(
        default=None, ge=1, le=2**31, description="Walks for each pixel (for `light`: as many light walks as there are pixels, so many times)."
    )
    max_depth: int | None = Field(
        default=None,
        ge=-1,
        le=UNBOUNDED_DEPTH,
        description="Longest path, in segments (Mitsuba's meaning: 1 is emitters alone, 2 adds direct light); -1 is unbounded, up to 255.",
    )
    rr_depth: int | None = Field(default=None, ge=1, le=2**16 - 1, description="Depth from which on Russian roulette may end a walk, in segments.")
    seed: int | None = Field(
        default=None,
        ge=0,
        lt=2**63,
        description="Seed of all random numbers: the same job and seed give the same bits. A scene whose sampler names none asks for 0.",
    )
    sampler: Literal["independent", "sobol"] | None = Field(
        default=None,
        description="`sobol` (Owen-scrambled points, less noise) or `independent` random numbers. "
        "A scene whose sampler is not `independent` asks for `sobol`.",
    )
    replicates: int = Field(
        default=4, ge=1, le=1024, description="Independent scramblings that Sobol passes take in turn, so that standard errors can be computed."
    )
    filter: Literal["box", "tent", "gaussian", "mitchell", "catmullrom", "lanczos"] | None = Field(
        default=None, description="Reconstruction filter of the film."
    )
    texture_filter: Literal["point", "ewa"] = Field(
        default="point",
        description="How bitmaps are read where the camera sees them: at a `point`, or averaged over the pixel's footprint (`ewa`, elliptical "
        "weighted average). `ewa` needs `filter: box`.",
    )
    texture_layout: LayoutName | None = Field(
        default=None,
        description="With `ewa`: fold the subpixel filter of this display into the footprint, so that the image's R, G and B are the drive of the "
        "subpixels. The display has one R, G and B in each pixel, as `rgb_stripe` and `bgr_stripe` have.",
    )

    @field_validator("max_depth")
    @classmethod
    def _no_zero_depth(cls, value: int | None) -> int | None:
        if value == 0:
            raise ValueError("a path has at least one segment: give 1 or more, or -1 for no bound")
        return value


class Record(Section):
    """What is kept of the walks that were traced."""

    keep: Literal["all", "none"] | float = Field(
        default="all", description="`all` walks, `none`, or the share of walks to record (above 0, at most 1), chosen by a hash of their ids."
    )
    columns: list[Literal["primitive", "u", "v"]] = Field(
        default=[], description="Optional columns of the vertex tables, which rebuild exact shading points."
    )
    occluded: bool = Field(default=False, description="Also record connections that were blocked, in the table `occluded`.")

    @field_validator("keep", mode="before")
    @classmethod
    def _share(cls, value: Any) -> Any:
        if isinstance(value, bool) or not isinstance(value, (int, float, str)):
            raise ValueError("expected `all`, `none`, or a number above 0 and at most 1")
        if isinstance(value, str):
            if value not in ("all", "none"):
                raise ValueError("expected `all`, `none`, or a number above 0 and at most 1")
            return value
        if not (math.isfinite(value) and 0 < value <= 1):
            raise ValueError("expected `all`, `none`, or a number above 0 and at most 1")
        return float(value)

    @property
    def share(self) -> float:
        """The share of walks that is recorded, 0 … 1."""
        return {"all": 1.0, "none": 0.0}[self.keep] if isinstance(self.keep, str) else self.keep


class Rank(Section):
    """One ranking of the classes of paths in a region (thesis 9.4.2), written into the run folder as `rankings/<name>.csv` and `.arrow`."""

    region: str | None = Field(default=None, description="A name of `regions`; without one, the whole image is ranked, by contribution alone.")
    by: Literal["contribution", "discrimination", "ratio", "literal"] = Field(
        default="contribution",
        description="`contribution`: by flux. `discrimination`: by how special a class is to the region, that is the lower confidence bound of its "
        "share inside over its share in the surrounding ring. `ratio`: plain flux inside over flux in the outer region; `literal`: the inverse, "
        "as the thesis has it.",
    )
    with_objects: bool = Field(default=False, description="Tell classes apart by the objects that their paths meet, too.")
    merge: bool = Field(default=False, description="Merge classes into high-level descriptors: direct, diffuse indirect, caustic, …")
    at: Literal["seen", "any"] = Field(
        default="seen", description="Which vertex must lie in the region: the one `seen` by the camera, or `any` interaction of the path."
    )
    outer: float = Field(default=1.5, gt=1, le=1000, description="Size of the outer region, in sizes of the region.")
    top: int | None = Field(default=None, ge=1, description="How many classes are listed. Default: all.")


class Inspection(Section):
    """Light walks beside a run of camera walks, in its folder `inspection/`: what irradiance, probes, fluence and flow are estimated from."""

    samples: int = Field(default=16, ge=1, le=2**31, description="Light walks for each pixel of the film, as `render.samples` counts them.")


class Report(Section):
    """The offline report: one folder, `report/` in the run folder, that any browser opens; it needs no network."""

    top: int = Field(default=3, ge=0, le=20, description="For how many classes of each ranking a picture of bundled paths is drawn.")
    paths: int = Field(default=600, ge=0, le=20_000, description="Paths in the three-dimensional view that a person can turn; 0 leaves it out.")


class Analysis(Section):
    """What is computed from the tables after rendering, beside images and rankings."""

    subpixel: SubpixelDescription | None = Field(default=None, description="Subpixel filters for displays. Default: none.")


class Images(Section):
    """How the pictures beside the linear images are made."""

    exposure: float = Field(default=0.0, ge=-64, le=64, description="Exposure of the PNG images, in stops: values are multiplied by 2 to this power.")


class Job(Section):
    """A job file. Paths in it are relative to the file."""

    name: str = Field(min_length=1, max_length=100, pattern=NAME_PATTERN, description="Name of the job, and of its run folder.")
    scene: str | dict[str, Any] = Field(description="A Mitsuba 3 scene: path of an `.xml` or `.yaml` file, or the dictionary itself.")
    parameters: dict[str, str | int | float | bool] = Field(default={}, description="Values of the scene's `$parameters`.")
    render: Render = Field(default=Render(), description="How light is simulated.")
    record: Record = Field(default=Record(), description="What is kept.")
    regions: dict[RegionName, RegionDescription] = Field(default={}, description="Named regions, for expressions (`X@name`) and rankings.")
    dialect: Literal["std", "osl", "thesis"] = Field(default="std", description="The notation of the expressions in `aovs`.")
    aovs: dict[Name, Annotated[str, Field(min_length=1, max_length=10_000)]] = Field(
        default={}, description="Images of some of the light: name -> light path expression, computed from the tables after rendering."
    )
    rank: dict[Name, Rank] = Field(default={}, description="Rankings of the classes of paths in a region: name -> what is ranked, and how.")
    cameras: dict[Name, CameraDescription] = Field(default={}, description="Named cameras for `views`.")
    views: dict[Name, View] = Field(default={}, description="Pictures of what light does: name -> what is drawn, and how it is shown.")
    inspection: Inspection | None = Field(default=None, description="Light walks for the tools that measure light. Default: none are traced.")
    analysis: Analysis = Field(default=Analysis(), description="Further analysis of the run.")
    report: Report | None = Field(default=None, description="The offline report. Default: none is written; `report: {}` writes one.")
    images: Images = Field(default=Images(), description="How pictures are made.")
    out: str | None = Field(default=None, min_length=1, description="The run folder. Default: `runs/<name>` in the folder where the command is run.")

    @field_validator("scene", mode="before")
    @classmethod
    def _scene(cls, value: Any) -> Any:
        if not isinstance(value, (str, dict)) or not value:
            raise ValueError("expected the path of a scene file, or a dictionary that describes the scene")
        return value

    @field_validator("cameras")
    @classmethod
    def _no_job_camera(cls, value: dict[str, CameraDescription]) -> dict[str, CameraDescription]:
        if JOB_CAMERA in value:
            raise ValueError(f"`{JOB_CAMERA}` is the name of the scene's own camera: choose another name")
        return value

    @field_validator("aovs")
    @classmethod
    def _no_beauty(cls, value: dict[str, str]) -> dict[str, str]:
        for name, meaning in RESERVED_IMAGES.items():
            if name in value:
                raise ValueError(f"`{name}` is the name of {meaning}: choose another name")
        return value
