"""What the parts of a report say: classes, rankings, diagnostics, and how to do it again."""

import json
import pathlib
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pyarrow as pa

from queries.diagnostics import DIAGNOSTICS
from queries.diagnostics.answers import meanings
from queries.errors import QueryError, RunError
from queries.run import Run
from viz.report.numbers import number, percent, seconds, size, with_error
from viz.report.picture import Picture
from viz.report.tables import Cell, Column, Table, answer_table, heading, short_words

DrawClass = Callable[[str, str], Picture | None]  # a name, and the expression that selects what is to be drawn
TOP_CLASSES = 30  # rows that are shown before a reader asks for more
MOST_CLASSES = 200
MOST_ROWS, FIRST_ROWS = 40, 12  # of diagnostics, at all; of these and of rankings, before a reader asks for more

_RANKING_MEANINGS = {
    "rank": "the place in this order",
    "description": "the class in words",
    "descriptor": "what such classes are called",
    "flux": "luminance of the class, summed over the image's pixels",
    "share": "its share of the light in the region",
    "cumulative": "share of this class and of all before it",
    "samples": "walks that have such paths",
    "effective_samples": "how many walks of equal value would have the same relative variance",
    "verdict": "why the error cannot be trusted",
    "ratio": "how much more of the light it is inside than around the region (of a ranking by discrimination: of shares)",
    "lower": "one-sided 95 % lower bound of that ratio, by which classes are ranked",
    "ring_share": "its share of the light in the ring around the region",
    "expression": "selects the class",
}
# Columns of rankings that only the files have, which hold all of them
_LEFT_OUT = ("trusted", "supported", "paths", "ring_samples", "outer_flux", "outer_flux_error", "ring_verdict", "selection", "cumulative_error")


@dataclass(frozen=True)
class Diagnostic:
    """One diagnostic: its table, or why there is none. ``chart``: file of a chart that shows it."""

    name: str
    title: str
    table: Table | None
    refused: str = ""
    chart: str = ""


@dataclass(frozen=True)
class Ranking:
    """One ranking: its table, and pictures of its first classes by rank."""

    name: str
    title: str
    table: Table
    pictures: Sequence[tuple[int, Picture]]


def answers(run: Run) -> dict[str, tuple[str, pa.Table | str]]:
    """All diagnostics by name: what each shows, and its table, or why it cannot be had."""
    found: dict[str, tuple[str, pa.Table | str]] = {}
    for name, (ask, title) in DIAGNOSTICS.items():
        try:
            answer: pa.Table | str = ask(run)
        except QueryError as error:
            answer = str(error)
        found[name] = title, answer
    return found


# --- classes -------------------------------------------------------------------------------------------------------


def class_table(answer: pa.Table, colors: Mapping[str, str]) -> Table:
    """Classes of paths, the largest energy first. ``colors``: of those that the inspector names, by expression."""
    means = meanings(answer)
    columns = [
        Column("description", "class and its expression", f"{means['description']}, and the expression that selects its paths", "class"),
        Column("share", "share", means["share"], "share"),
        Column("energy", "energy ± standard error", f"{means['energy']}, and its standard error where that can be trusted", "number"),
        Column("relative_error", "relative error", means["relative_error"], "number"),
        *(Column(name, heading(name), means[name], "number") for name in ("paths", "samples", "effective_samples", "efficiency")),
        Column("verdict", "verdict", means["verdict"], "verdict"),
    ]
    rows = [_class_row(row, colors) for row in answer.slice(0, MOST_CLASSES).to_pylist()]
    rest = answer.slice(MOST_CLASSES)
    note = ""
    if rest.num_rows:
        share = sum(value or 0.0 for value in rest["share"].to_pylist())
        note = f"{rest.num_rows:,} more classes together have {percent(share)}; `pathspace diagnose RUN classes` lists them all."
    return Table("Classes of paths, by energy", columns, rows, note, TOP_CLASSES)


def _class_row(row: Mapping[str, Any], colors: Mapping[str, str]) -> list[Cell]:
    share, error = row["share"], row["relative_error"]
    words = short_words(row["description"], row["expression"])
    return [
        Cell(words, words, color=colors.get(row["expression"]), code=row["expression"]),
        Cell(percent(share), share, None if share is None else round(100 * share, 2)),
        Cell(with_error(row["energy"], row["standard_error"]), row["energy"]),
        Cell(percent(error), error),
        *(Cell(number(row[name]), row[name]) for name in ("paths", "samples", "effective_samples", "efficiency")),
        Cell(row["verdict"] or "", row["verdict"]),
    ]


# --- rankings ------------------------------------------------------------------------------------------------------


def rankings(run: Run, draw: DrawClass | None, top: int) -> list[Ranking]:
    """The rankings that lie in the run folder, with pictures of their first ``top`` classes, where ``draw`` gives any."""
    found = []
    for name, known in (run.manifest.get("rankings") or {}).items():
        file = run.path / "rankings" / f"{name}.arrow"
        if not file.is_file():
            continue
        answer = _read(file)
        asked = known.get("asked") or {}
        shown = answer.select([column for column in answer.schema.names if column not in _LEFT_OUT])
        title = f"{name}: {_asked(asked)}"
        table = answer_table(f"Ranking {title}", shown, cut=FIRST_ROWS, explained=_RANKING_MEANINGS)
        found.append(Ranking(name, title, table, _drawn(name, answer, draw, top)))
    return found


def _read(file: pathlib.Path) -> pa.Table:
    """A ranking as it was written: a stream of Arrow batches."""
    try:
        with pa.OSFile(str(file)) as source:
            return pa.ipc.open_stream(source).read_all()
    except (pa.ArrowException, OSError) as error:
        raise RunError(f"`{file}` cannot be read ({str(error).splitlines()[0]}): run the job again with --resume") from None


def _asked(asked: Mapping[str, Any]) -> str:
    """What a ranking was asked."""
    where = f"light in the region {asked['region']}" if asked.get("region") else "light of the whole image"
    at = ", anywhere on its way" if asked.get("at") == "any" else ""
    return f"{where}{at}, by {asked.get('by', 'contribution')}"


def _drawn(name: str, answer: pa.Table, draw: DrawClass | None, top: int) -> list[tuple[int, Picture]]:
    """Pictures of the first classes, of their paths in the region where there is one: a class that cannot be drawn has none."""
    if draw is None:
        return []
    selects = "selection" if "selection" in answer.schema.names else "expression"
    rows = answer.slice(0, top).select(["rank", selects]).to_pylist()
    drawn = [(row["rank"], draw(f"{name}-{row['rank']:02d}", row[selects])) for row in rows]
    return [(rank, picture) for rank, picture in drawn if picture is not None]


# --- diagnostics ---------------------------------------------------------------------------------------------------


def diagnostics(found: Mapping[str, tuple[str, pa.Table | str]], charts: Mapping[str, str]) -> list[Diagnostic]:
    """All diagnostics but that of classes, which has a part of its own, as tables or with the reason why there is none."""
    return [_diagnostic(name, title, answer, charts.get(name, "")) for name, (title, answer) in found.items() if name != "classes"]


def _diagnostic(name: str, title: str, answer: pa.Table | str, chart: str) -> Diagnostic:
    if isinstance(answer, str):
        return Diagnostic(name, title, None, answer)
    shown = _spread(answer, MOST_ROWS) if name == "convergence" else answer
    table = answer_table(f"{heading(name).capitalize()}: {title}", shown, MOST_ROWS, FIRST_ROWS)
    return Diagnostic(name, title, table, chart=chart)


def _spread(answer: pa.Table, most: int) -> pa.Table:
    """Rows spread evenly over an answer, the last among them."""
    count = answer.num_rows
    return answer if count <= most else answer.take(sorted({round(i * (count - 1) / (most - 1)) for i in range(most)}))


# --- at a glance, and again ----------------------------------------------------------------------------------------


def glance(run: Run, found: Mapping[str, tuple[str, pa.Table | str]]) -> list[tuple[str, str, str]]:
    """The few facts that come first: name, value, and what is to be added."""
    settings, stats = run.settings, run.manifest.get("stats") or {}
    facts = [("film", f"{settings['width']} × {settings['height']}", f"pixels, {settings['filter']} filter")]
    facts += [("samples", f"{settings['passes']:,}", f"for each pixel, {settings.get('sampler', 'independent')}, seed {settings.get('seed', 0)}")]
    rows = run.manifest.get("rows") or {}
    if rows.get("paths"):
        vertices = sum(rows.get(f"{side}_vertices", 0) for side in ("camera", "light"))
        facts += [("recorded paths", f"{rows['paths']:,}", f"{vertices:,} vertices, {size(stats['bytes'])}" if "bytes" in stats else "")]
    if "render_seconds" in stats:
        rate = stats.get("samples_per_second", 0.0)
        facts += [("tracing", seconds(stats["render_seconds"]), f"{rate:,.0f} samples/s on {stats.get('threads', 1)} threads")]
    convergence = found.get("convergence", ("", ""))[1]
    if isinstance(convergence, pa.Table) and convergence.num_rows:
        last = convergence.slice(convergence.num_rows - 1).to_pylist()[0]
        error = percent(last["relative_error"]) if last["relative_error"] is not None else "not known"
        facts += [("mean luminance", number(last["mean"]), f"relative standard error {error}")]
    return facts


def settings_rows(run: Run) -> list[tuple[str, str]]:
    """Every setting that the run was traced with."""
    return [(heading(name), _plain(value)) for name, value in run.settings.items()]


def _plain(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (list, tuple)):
        return ", ".join(map(str, value)) or "none"
    return "none" if value is None else f"{value:,}" if isinstance(value, int) and value >= 10_000 else str(value)


def job_yaml(run: Run) -> str:
    """The job as it was run, with all overrides in it; keys without a value are left out. Empty where the run knows no job."""
    import yaml

    job = run.manifest.get("job")
    return yaml.safe_dump(_given(job), sort_keys=False, allow_unicode=True, width=100, default_flow_style=None) if job else ""


def _given(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _given(item) for key, item in value.items() if item is not None and item != {} and item != []}
    return value


def command_of(run: Run) -> str:
    """The command that makes such a run, as far as the run knows it."""
    file = run.manifest.get("job_file")
    settings = "".join(f" --set {shlex.quote(text)}" for text in run.manifest.get("overrides") or ())
    return f"pathspace run {shlex.quote(str(file))}{settings} --out {shlex.quote(run.path.name)}" if file else ""


def checksums(run: Run) -> list[tuple[str, str, str, str]]:
    """File, rows, size and checksum (xxh3) of what the manifest vouches for."""
    manifest = run.manifest
    records = {f"tables/{name}.arrow": known for name, known in (manifest.get("catalogues") or {}).items()}
    if manifest.get("film"):
        records["film/sum.npy"] = manifest["film"]
    for folder, names in (("images", manifest.get("images")), ("rankings", manifest.get("rankings"))):
        for name, known in (names or {}).items():
            records |= {f"{folder}/{name}.{kind}": known[kind] for kind in ("exr", "png", "csv", "arrow") if kind in known}
    return [(name, number(record.get("rows") or None), size(record["bytes"]), str(record.get("xxh3", ""))) for name, record in records.items()]


def run_digest(run: Run) -> str:
    """XXH3 of the files' checksums of all shards, in order: equal for runs whose recorded tables are equal."""
    import xxhash

    digest = xxhash.xxh3_128()
    for shard in range(run.manifest["shards"]["count"]):
        record = json.loads((run.path / "shards" / f"{shard:05d}.json").read_bytes())
        for name, known in sorted(record["files"].items()):
            digest.update(f"{pathlib.PurePosixPath(name)} {known['bytes']} {known.get('xxh3', '')}\n".encode())
    return digest.hexdigest()
