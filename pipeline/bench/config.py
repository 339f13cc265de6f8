"""What a benchmark file may say: which job, which contenders, which sections, how often."""

import difflib
import json
import pathlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import yaml
from pydantic import Field, ValidationError, model_validator

from pipeline.config import NAME_PATTERN, Section
from pipeline.errors import JobError

SectionName = Literal["rates", "size", "memory", "error", "start", "features", "questions", "pictures", "subpixel"]
_NO_QUESTIONS = ("aovs={}", "rank={}", "views={}", "inspection=null", "report=null", "analysis={}")
ContenderName = Literal["independent", "sobol", "recorded", "recorded_sobol", "mitsuba_llvm", "mitsuba_scalar"]


class Memory(Section):
    """Peak memory: a recorded run in a process of its own, at each of these sample counts."""

    samples: list[int] = Field(default=[64, 512], min_length=1, description="Samples for each pixel.")


class Error(Section):
    """Error against time: renders at each sample count, against a converged reference."""

    contenders: list[ContenderName] = Field(default=["independent", "sobol", "mitsuba_llvm"], min_length=1, description="Who renders.")
    samples: list[int] = Field(default=[4, 8, 16, 32, 64, 128, 256], min_length=2, description="Samples for each pixel, rising.")
    rounds: int = Field(default=3, ge=1, description="Renders of each, with seeds of their own.")
    reference_samples: int = Field(default=8192, ge=1, description="Samples for each pixel of either half of the reference.")


class Features(Section):
    """The cost of features that a scene lacks: the same trace by three builds of the kernels."""

    rounds: int = Field(default=9, ge=1, description="Renders of each build.")
    samples: int = Field(default=32, ge=1, description="Samples for each pixel.")


class Question(Section):
    """One question of a recorded run: an expression whose image is made, or a ranking."""

    what: str = Field(min_length=1, description="What the question shows, for the table.")
    expression: str | None = Field(default=None, description="A light path expression.")
    rank: dict[str, Any] | None = Field(default=None, description="A ranking, as in a job's `rank`.")
    most_seconds: float = Field(gt=0, description="The goal: seconds for the whole answer.")

    @model_validator(mode="after")
    def _one(self) -> "Question":
        if (self.expression is None) == (self.rank is None):
            raise ValueError("expected either `expression` or `rank`")
        return self


class Questions(Section):
    """Questions of a run of the job that records every path."""

    ask: list[Question] = Field(default=[], description="What is asked.")
    regex: str | None = Field(
        default=None,
        description="The first expression as a regular expression in Python, over words such as `CRDRSL`: the camera, two letters "
        "for each interaction, the light.",
    )
    memory_samples: int = Field(default=0, ge=0, description="Samples for each pixel of a longer run, for the questions' peak memory; 0: none.")


class Pictures(Section):
    """Bundling and drawing paths of a run of the job that records every path."""

    paths: int = Field(default=100_000, ge=1, le=10_000_000, description="Paths that are chosen, bundled and drawn.")
    points: int = Field(default=24, ge=3, le=256, description="Points of each curve.")
    size: Annotated[tuple[int, int], Field(strict=False)] = Field(default=(1920, 1080), description="Width and height of the picture, pixels.")
    most_bundling_seconds: float = Field(default=2.0, gt=0, description="The goal for bundling, seconds.")
    most_drawing_seconds: float = Field(default=15.0, gt=0, description="The goal for drawing, seconds.")


class Subpixel(Section):
    """Images for the subpixels of displays, from a run of the job that records every path."""

    layouts: list[str] = Field(default=["rgb_stripe", "rgbg", "rgbw"], min_length=1, description="The displays; the goal is for the first.")
    methods: list[str] = Field(
        default=["pixel_box", "pixel_mitchell", "none", "box", "mitchell", "optimal", "kernels"], description="How images are filtered."
    )
    most_ratio: float = Field(default=3.0, gt=0, description="The goal: `optimal` on the first display, in times of the run's box image.")
    most_derivation_seconds: float = Field(default=2.0, gt=0, description="The goal for deriving and fitting the filters of all layouts, seconds.")


class Benchmark(Section):
    """A benchmark file. Paths in it are relative to the file."""

    name: str = Field(min_length=1, max_length=100, pattern=NAME_PATTERN, description="Name of the benchmark, and of its folder.")
    job: str = Field(min_length=1, description="The job that is measured.")
    settings: dict[str, Any] = Field(default={}, description="Changes to the job: dotted key -> value, as `pathspace run --set` takes them.")
    threads: int = Field(default=2, ge=1, le=4096, description="Worker threads, ours and Mitsuba's.")
    rounds: int = Field(default=5, ge=1, description="Timed renders of each contender; the order alternates from round to round.")
    contenders: list[ContenderName] = Field(
        default=["independent", "sobol", "recorded", "recorded_sobol", "mitsuba_llvm", "mitsuba_scalar"],
        description="Whose rates are measured: `independent` and `sobol` record nothing, `recorded…` write every path to disk.",
    )
    sections: list[SectionName] = Field(default=["rates", "size", "memory", "error", "start", "features"], description="What is measured, in order.")
    memory: Memory = Field(default=Memory(), description="Peak memory.")
    error: Error = Field(default=Error(), description="Error against time.")
    features: Features = Field(default=Features(), description="The cost of absent features.")
    questions: Questions = Field(default=Questions(), description="Questions of a recorded run.")
    pictures: Pictures = Field(default=Pictures(), description="Pictures of bundled paths.")
    subpixel: Subpixel = Field(default=Subpixel(), description="Subpixel filters.")
    out: str | None = Field(
        default=None, min_length=1, description="The folder of the results. Default: `runs/bench-<name>` where the command is run."
    )


@dataclass(frozen=True)
class LoadedBenchmark:
    """A benchmark and the file it came from."""

    benchmark: Benchmark
    file: pathlib.Path

    @property
    def job(self) -> pathlib.Path:
        """The job's file."""
        return self.file.parent / self.benchmark.job

    @property
    def overrides(self) -> list[str]:
        """The changes to the job as ``key=value``, what it asks of the render left out: that is no part of it."""
        return [*(f"{key}={json.dumps(value)}" for key, value in self.benchmark.settings.items()), *_NO_QUESTIONS]

    def folder(self, out: pathlib.Path | None) -> pathlib.Path:
        """Where the results go: the argument, else the file's ``out``, else ``runs/bench-<name>`` here."""
        if out is not None:
            return out
        return self.file.parent / self.benchmark.out if self.benchmark.out else pathlib.Path("runs") / f"bench-{self.benchmark.name}"


def load_benchmark(path: pathlib.Path, settings: Sequence[str] = ()) -> LoadedBenchmark:
    """Read a benchmark file and apply ``key=value`` settings in order. Raises JobError."""
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise JobError("there is no such benchmark file", str(path)) from None
    except (OSError, UnicodeDecodeError) as error:
        raise JobError(f"the benchmark file cannot be read: {error}", str(path)) from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        raise JobError(f"not valid YAML: {getattr(error, 'problem', error)}", f"{path}:{mark.line + 1}" if mark else str(path)) from None
    if not isinstance(data, dict):
        raise JobError("expected a benchmark, that is keys such as `name:` and `job:`", str(path))
    for setting in settings:
        _apply(data, setting)
    try:
        benchmark = Benchmark.model_validate(data)
    except ValidationError as error:
        raise JobError(_explained(error), str(path)) from None
    loaded = LoadedBenchmark(benchmark, path)
    if not loaded.job.is_file():
        raise JobError(f"there is no job file `{loaded.job}`: `job` is relative to the benchmark's file", str(path))
    return loaded


def _apply(data: dict[Any, Any], setting: str) -> None:
    """Put one ``dotted.key=value`` into the data; the value is read as YAML."""
    key, equals, text = setting.partition("=")
    *sections, last = key.strip().split(".")
    if not equals or not last:
        raise JobError("expected key=value with a dotted key, such as error.rounds=1", f"--set {setting}")
    if sections[:1] == ["settings"]:  # the keys of a job's settings have dots of their own
        sections, last = ["settings"], ".".join([*sections[1:], last])
    for section in sections:
        inner = data.setdefault(section, {})
        if not isinstance(inner, dict):
            raise JobError(f"`{section}` is not a section", f"--set {setting}")
        data = inner
    try:
        data[last] = yaml.safe_load(text)
    except yaml.YAMLError:
        raise JobError("the value is not valid YAML", f"--set {setting}") from None


def _explained(error: ValidationError) -> str:
    """All complaints of the schema, one after the other."""
    lines = []
    for item in error.errors(include_url=False):
        name = ".".join(map(str, item["loc"]))
        if item["type"] == "extra_forbidden":
            near = difflib.get_close_matches(str(item["loc"][-1]), [*Benchmark.model_fields, *Error.model_fields], n=1)
            lines.append(
                f"unknown key `{name}`" + (f": did you mean `{near[0]}`?" if near else f": known keys are {', '.join(Benchmark.model_fields)}")
            )
        elif item["type"] == "missing":
            lines.append(f"`{name}` is missing: expected {Benchmark.model_fields[name].description}")
        else:
            message = str(item["msg"]).replace("Input should be", "expected")
            lines.append(f"`{name}`: {message}, found {item['input']!r:.80}")
    return "; ".join(lines)
