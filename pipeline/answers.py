"""Answers of ``queries`` as the command line gives them: rows on stdout, images as files."""

import pathlib
import sys
from collections.abc import Sequence

import numpy as np

from pipeline.errors import JobError
from pipeline.files import clear_errors
from pipeline.images import F32, write_exr, write_png
from queries.images import select
from queries.luminance import luminance_of
from queries.regions import parse_region
from queries.run import Run, open_run
from queries.sql import TIME_LIMIT, stream, write


def print_rows(path: pathlib.Path, text: str, format: str, time_limit: float | None = None, define: Sequence[str] = ()) -> None:
    """Run one SQL query, for at most so many seconds, and write its rows to stdout. Raises QueryError.

    ``define``: further regions, as ``name={sphere: …}``.
    """
    with open_run(path, regions=dict(map(parse_region, define))) as run, stream(run, text, time_limit or TIME_LIMIT) as reader:
        write(reader, format, sys.stdout.buffer)
        sys.stdout.buffer.flush()


def print_expression(
    path: pathlib.Path, text: str, out: pathlib.Path | None, dialect: str = "std", define: Sequence[str] = (), filter: str | None = None
) -> None:
    """Say how much light an expression selects, and write its image, by the run's reconstruction filter or another one.

    ``define``: as for ``print_rows``. Raises QueryError and JobError.
    """
    if out is not None and out.suffix not in (".exr", ".png"):
        raise JobError(f"expected an image file that ends in .exr or .png, found `{out}`")
    with open_run(path, regions=dict(map(parse_region, define))) as run:
        expression = run.compile(text, dialect)
        for warning in expression.warnings:
            print(f"warning: {warning}", file=sys.stderr)
        found = select(run, {"selected": expression, "whole": None}, filter=filter)
        if out is not None:
            _write_image(out, found["selected"].image, run, text)
    selected, whole = found["selected"], found["whole"]
    light, all_light = _mean_luminance(selected.image), _mean_luminance(whole.image)
    print(f"{expression}: {expression.describe()}")
    print(f"paths:     {selected.rows:,} of {whole.rows:,}")
    print(f"mean:      {' '.join(f'{value:.6g}' for value in selected.image.mean(axis=(0, 1), dtype=np.float64))} (linear RGB)")
    print(f"luminance: {light:.6g}, {100 * light / all_light if all_light else 0:.2f} % of the image")
    if out is not None:
        print(f"image:     {out}")


def _write_image(path: pathlib.Path, pixels: F32, run: Run, expression: str) -> None:
    with clear_errors("writing the image", path.parent):
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix == ".png":
            write_png(path, pixels)
            return
        settings = run.settings
        known = {"job": run.manifest["name"], "expression": expression, "seed": str(settings["seed"]), "samples": str(settings["passes"])}
        write_exr(path, pixels, known | {"version": run.manifest["versions"]["pathspace"]})


def _mean_luminance(pixels: F32) -> float:
    return float(luminance_of(pixels.mean(axis=(0, 1), dtype=np.float64)))
