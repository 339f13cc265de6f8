"""The command line. Everything heavy is imported inside the command that needs it, so that ``--help`` is quick."""

import contextlib
import pathlib
import signal
import sys
from collections.abc import Iterator
from enum import StrEnum
from typing import Annotated, Any

import typer

from pipeline.errors import BAD_INPUT, FAILED, INTERRUPTED, JobError, PipelineError

app = typer.Typer(name="pathspace", no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="rich")

ConfigArgument = Annotated[pathlib.Path, typer.Argument(metavar="CONFIG", help="The job: a YAML file.")]
RunArgument = Annotated[pathlib.Path, typer.Argument(metavar="RUN", help="A run folder.")]
OutOption = Annotated[
    pathlib.Path | None, typer.Option("--out", metavar="DIR", help="The run folder (default: the job's `out`, else `runs/<name>`).")
]
SetOption = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Change a key of the job, such as `render.samples=16`; repeatable.")
]


class Dialect(StrEnum):
    """The notations of light path expressions."""

    std = "std"
    osl = "osl"
    thesis = "thesis"


class By(StrEnum):
    """What classes of paths are ranked by."""

    contribution = "contribution"
    discrimination = "discrimination"
    ratio = "ratio"
    literal = "literal"


class At(StrEnum):
    """Which vertex of a path must lie in a region."""

    seen = "seen"
    any = "any"


class Format(StrEnum):
    """How rows are printed."""

    table = "table"
    csv = "csv"
    json = "json"
    arrow = "arrow"


DefineOption = Annotated[
    list[str] | None,
    typer.Option("--define", metavar="NAME=REGION", help="Define a region, such as 'spot={sphere: {center: [0, 1, 0], radius: 0.2}}'; repeatable."),
]
DialectOption = Annotated[Dialect, typer.Option("--dialect", help="The notation of the expression.")]
FormatOption = Annotated[Format, typer.Option("--format", help="How rows are printed.")]


@app.callback()
def pathspace() -> None:
    """Render scenes in batches, keep every sampled light path as Arrow tables, and ask them about light."""


@app.command()
def run(
    config: ConfigArgument,
    out: OutOption = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with an interrupted run; damaged shards are rendered again.")] = False,
    settings: SetOption = None,
    threads: Annotated[int | None, typer.Option("--threads", min=1, max=4096, help="Worker threads (default: one for each core).")] = None,
) -> None:
    """Render a job into its run folder."""
    with _clear_exit():
        from pipeline.progress import log_to_stderr
        from pipeline.stages import run_job

        log_to_stderr()
        signal.signal(signal.SIGTERM, _interrupt)
        folder = run_job(config, settings or (), out, resume, threads)
        typer.echo(f"image:  {folder.image('beauty', 'exr')}")
        typer.echo(f"tables: {folder.path / 'tables'}")
        if folder.report.exists():
            typer.echo(f"report: {folder.report}")


@app.command()
def validate(config: ConfigArgument, out: OutOption = None, settings: SetOption = None) -> None:
    """Check a job and its scene, and estimate its size on disk; nothing is written."""
    with _clear_exit():
        from pipeline.progress import log_to_stderr
        from pipeline.stages import validate_job

        log_to_stderr()
        prepared, size = validate_job(config, settings or (), out)
        chosen = prepared.settings
        typer.echo(
            f"{config} is a good job: {chosen.width} x {chosen.height} pixels, {chosen.passes} samples, method {chosen.method}; about {size.text()}"
        )


@app.command()
def info(run: RunArgument) -> None:
    """Say what a run folder holds."""
    with _clear_exit():
        from pipeline.summary import print_summary

        print_summary(run)


@app.command()
def sql(
    run: RunArgument,
    query: Annotated[str, typer.Argument(metavar="QUERY", help="SQL, such as \"SELECT count(*) FROM lpe('C D S+ L')\".")],
    format: FormatOption = Format.table,
    time_limit: Annotated[
        int | None, typer.Option("--time-limit", metavar="SECONDS", min=1, max=10**9, help="Stop the query after so long (default: 60).")
    ] = None,
    define: DefineOption = None,
) -> None:
    """Ask a run a question in SQL (DuckDB, read-only); lpe('EXPR') is the table of the paths that an expression matches."""
    with _clear_exit():
        from pipeline.answers import print_rows

        print_rows(run, query, format.value, time_limit, define or ())


@app.command()
def lpe(
    run: RunArgument,
    expression: Annotated[str, typer.Argument(metavar="EXPR", help='A light path expression, such as "C D .* L".')],
    out: Annotated[
        pathlib.Path | None, typer.Option("--out", metavar="IMAGE", help="Write the image of the light that the expression selects (.exr or .png).")
    ] = None,
    dialect: DialectOption = Dialect.std,
    define: DefineOption = None,
    filter: Annotated[
        str | None, typer.Option("--filter", metavar="NAME", help="Reconstruction filter of the image, such as mitchell (default: the run's).")
    ] = None,
) -> None:
    """Select light by a light path expression: its share of the image, and the image itself."""
    with _clear_exit():
        from pipeline.answers import print_expression

        print_expression(run, expression, out, dialect.value, define or (), filter)


@app.command()
def rank(
    run: RunArgument,
    region: Annotated[
        str | None, typer.Option("--region", metavar="NAME", help="A region of the job or of --define (default: the whole image).")
    ] = None,
    by: Annotated[By, typer.Option("--by", help="Flux, or how special a class is to the region.")] = By.contribution,
    with_objects: Annotated[bool, typer.Option("--with-objects", help="Tell classes apart by the objects that paths meet, too.")] = False,
    merge: Annotated[bool, typer.Option("--merge", help="Merge classes into descriptors: direct, diffuse indirect, caustic, …")] = False,
    at: Annotated[At, typer.Option("--at", help="The vertex that must lie in the region: the one seen by the camera, or any.")] = At.seen,
    outer: Annotated[
        float, typer.Option("--outer", metavar="FACTOR", min=1.01, max=1000, help="Size of the outer region, in sizes of the region.")
    ] = 1.5,
    top: Annotated[
        int | None, typer.Option("--top", metavar="N", min=1, help="How many classes are listed (default: 20 in a table, else all).")
    ] = None,
    define: DefineOption = None,
    format: FormatOption = Format.table,
) -> None:
    """Rank the classes of light paths in a region: what light is there, and what is special about it."""
    with _clear_exit():
        from pipeline.config import Rank
        from pipeline.rankings import print_ranking

        asked = Rank(region=region, by=by.value, with_objects=with_objects, merge=merge, at=at.value, outer=outer, top=top)
        print_ranking(run, asked, define or (), format.value)


@app.command()
def diagnose(
    run: Annotated[pathlib.Path | None, typer.Argument(metavar="RUN", help="A run folder.")] = None,
    names: Annotated[list[str] | None, typer.Argument(metavar="[NAME]…", help="Which diagnostics (default: all; --list names them).")] = None,
    list_them: Annotated[bool, typer.Option("--list", help="List the diagnostics.")] = False,
    top: Annotated[int | None, typer.Option("--top", metavar="N", min=1, help="How many rows of each are shown (default: 10 of several).")] = None,
    explain: Annotated[bool, typer.Option("--explain", help="Say what the columns mean.")] = False,
    format: FormatOption = Format.table,
) -> None:
    """Look for what is wrong with a run: fireflies and where they come from, noise by class, convergence, what max_depth cuts."""
    with _clear_exit():
        from pipeline.diagnose import list_diagnostics, print_diagnostics

        if list_them:
            list_diagnostics()
        elif run is None:
            raise JobError("expected a run folder: pathspace diagnose RUN")
        else:
            print_diagnostics(run, names or (), format.value, top, explain)


@app.command()
def view(
    run: RunArgument,
    what: Annotated[str | None, typer.Argument(metavar="[VIEW|TOOL]", help="A view of the job, or a tool (default: list both).")] = None,
    expression: Annotated[str | None, typer.Option("--expression", metavar="EXPR", help="Draw only the light that this expression selects.")] = None,
    dialect: Annotated[Dialect | None, typer.Option("--dialect", help="The notation of the expression (default: the job's).")] = None,
    region: Annotated[str | None, typer.Option("--region", metavar="NAME", help="Only light with an interaction in this region.")] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="A key of the view, such as `bundles.most=500` or `look.scene=cut`; repeatable."),
    ] = None,
    define: DefineOption = None,
    out: Annotated[pathlib.Path | None, typer.Option("--out", metavar="PNG", help="The picture to write (default: `<name>.png` here).")] = None,
) -> None:
    """Draw what light does: bundled paths, irradiance, probes, fluence, flow, time of flight."""
    with _clear_exit():
        from pipeline.views import print_view

        named = {"expression": expression, "dialect": dialect and dialect.value, "region": region}
        print_view(run, what, {key: value for key, value in named.items() if value is not None}, settings or (), define or (), out)


@app.command()
def report(
    run: RunArgument,
    out: Annotated[
        pathlib.Path | None, typer.Option("--out", metavar="DIR", help="The folder to write (default: `report` in the run folder).")
    ] = None,
    top: Annotated[int | None, typer.Option("--top", metavar="N", min=0, max=20, help="Classes of each ranking that get a picture.")] = None,
    paths: Annotated[int | None, typer.Option("--paths", metavar="N", min=0, max=20_000, help="Paths in the three-dimensional view.")] = None,
) -> None:
    """Write a run's offline report: one folder that any browser opens, without a network."""
    with _clear_exit():
        from pipeline.progress import log_to_stderr
        from pipeline.report import print_report

        log_to_stderr()
        print_report(run, out, {key: value for key, value in {"top": top, "paths": paths}.items() if value is not None})


@app.command()
def subpixel(
    target: Annotated[pathlib.Path | None, typer.Argument(metavar="RUN_OR_IMAGE", help="A run folder, or an image file.")] = None,
    layout: Annotated[
        list[str] | None, typer.Option("--layout", metavar="NAME", help="A display (--list names them), or a YAML file with one; repeatable.")
    ] = None,
    method: Annotated[str | None, typer.Option("--method", metavar="NAME", help="How the picture is filtered (default: optimal).")] = None,
    dpi: Annotated[float | None, typer.Option("--dpi", help="Pixels of the display per inch (default: 100).")] = None,
    distance: Annotated[float | None, typer.Option("--distance", metavar="CM", help="Distance of the viewer, centimeters (default: 46).")] = None,
    scale: Annotated[
        float | None, typer.Option("--scale", metavar="N", min=1, max=100, help="Pixels of the image for each of the display's (default: 3).")
    ] = None,
    expression: Annotated[str | None, typer.Option("--expression", metavar="EXPR", help="Show only the light of a run that this selects.")] = None,
    evaluate: Annotated[bool | None, typer.Option("--evaluate/--no-evaluate", help="Compare all methods (default: yes).")] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="A key of `analysis.subpixel`, such as `zeros=3`; repeatable.")
    ] = None,
    define: DefineOption = None,
    out: Annotated[
        pathlib.Path | None,
        typer.Option("--out", metavar="DIR", help="The folder to write (default: `subpixel` in the run folder, `<image>-subpixel` here)."),
    ] = None,
    list_them: Annotated[bool, typer.Option("--list", help="List the displays.")] = False,
) -> None:
    """Filter a run's samples, or an image, for the subpixels of a display, and compare the ways to do so."""
    with _clear_exit():
        from pipeline.progress import log_to_stderr
        from pipeline.subpixel import list_layouts, print_analysis

        log_to_stderr()
        if list_them:
            list_layouts()
        elif target is None:
            raise JobError("expected a run folder or an image: pathspace subpixel RUN_OR_IMAGE --layout rgb_stripe")
        else:
            named = {"method": method, "dpi": dpi, "distance": distance, "evaluate": evaluate}
            given = {key: value for key, value in named.items() if value is not None}
            print_analysis(target, layout or (), given, settings or (), scale, expression, define or (), out)


@app.command()
def export(
    run: RunArgument,
    parquet: Annotated[pathlib.Path, typer.Option("--parquet", metavar="DIR", help="The folder to write Parquet files into.")],
) -> None:
    """Write a run's tables as Parquet files, which any DuckDB or Spark reads."""
    with _clear_exit():
        from queries.export import export_parquet
        from queries.run import open_run

        with open_run(run) as opened:
            for name, rows in export_parquet(opened, parquet).items():
                typer.echo(f"{parquet / name}.parquet: {rows:,} rows")


@app.command()
def bench(
    config: Annotated[pathlib.Path, typer.Argument(metavar="CONFIG", help="A benchmark: a YAML file.")],
    out: Annotated[pathlib.Path | None, typer.Option("--out", metavar="DIR", help="The folder of the results.")] = None,
    settings: SetOption = None,
) -> None:
    """Measure speed, size and error, and write a table and a chart."""
    with _clear_exit():
        import importlib

        from pipeline.progress import log_to_stderr

        log_to_stderr()
        code = importlib.import_module("pipeline.bench").main(config, out, settings or ())
        if code:
            raise typer.Exit(code)


@contextlib.contextmanager
def _clear_exit() -> Iterator[None]:
    """Turn every failure into one message on stderr and an exit code; a traceback only where the fault is ours."""
    try:
        yield
    except typer.Exit:
        raise
    except KeyboardInterrupt:
        _stop("interrupted", INTERRUPTED)
    except BrokenPipeError:
        sys.stderr.close()  # the reader of our output has gone, as `| head` does
        raise typer.Exit(FAILED) from None
    except PipelineError as error:
        _stop(str(error), error.exit_code)
    except Exception as error:
        if not _is_bad_input(error):
            _report_fault(error)
        _stop(str(error), BAD_INPUT)


def _is_bad_input(error: Exception) -> bool:
    """Whether a package below says that its input was bad."""
    from renderer.errors import SceneError

    if isinstance(error, SceneError):
        return True
    from queries.errors import QueryError

    return isinstance(error, QueryError)


def _report_fault(error: Exception) -> None:
    """A fault of the program: say where, keep the traceback for those who ask for it."""
    import logging
    import os
    import traceback

    if os.environ.get("PATHSPACE_TRACEBACK"):
        traceback.print_exception(error)
    logging.getLogger("pathspace").debug("fault", exc_info=error)
    where = traceback.extract_tb(error.__traceback__)[-1]
    what = f"{type(error).__name__}: {error} ({pathlib.Path(where.filename).name}:{where.lineno})"
    _stop(f"{what}. This is a fault of pathspace; PATHSPACE_TRACEBACK=1 shows more", FAILED)


def _stop(message: str, code: int) -> None:
    typer.echo(f"pathspace: {message}", err=True)
    raise typer.Exit(code)


def _interrupt(_signal: int, _frame: Any) -> None:
    raise KeyboardInterrupt


def main() -> None:
    """The entry point of the console script."""
    app()


if __name__ == "__main__":
    main()
