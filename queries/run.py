"""Open a run: its tables memory-mapped, and read-only DuckDB views of them."""

import functools
import json
import os
import pathlib
import shutil
import tempfile
from collections.abc import Mapping
from types import TracebackType
from typing import TYPE_CHECKING, Any

import duckdb
import pyarrow as pa

from queries.errors import QueryError, RunError
from queries.views import CATALOGUES, RECORDED, create_views
from queries.word_tree import WordTree

if TYPE_CHECKING:
    from queries.lpe import Expression
    from queries.regions import Region, SceneGeometry

MEMORY_LIMIT = "2GB"
_LOCKED = {
    # Nothing outside the connection can be reached: no files, no extensions, no Python variables.
    "autoinstall_known_extensions": "false",
    "autoload_known_extensions": "false",
    "allow_community_extensions": "false",
    "allow_persistent_secrets": "false",
    "python_enable_replacements": "false",
}


class Run:
    """An open run: a context manager.

    ``path`` the folder, ``manifest`` its manifest, ``tables`` the stored Arrow tables by name (memory-mapped), ``shard_files``
    the files of the recorded tables, shard by shard, ``regions`` the named regions that expressions may test, ``connection`` a
    DuckDB connection with the views. ``connect`` makes further connections, of which none sees another's changes; ``disconnect`` ends one.
    """

    def __init__(
        self,
        path: pathlib.Path,
        manifest: dict[str, Any],
        tables: dict[str, pa.Table],
        shard_files: list[dict[str, pathlib.Path]],
        memory_limit: str,
        threads: int | None,
        regions: "Mapping[str, Region | Mapping[str, Any]] | None" = None,
    ) -> None:
        self.path = path
        self.shard_files = shard_files
        self.manifest = manifest
        self.tables = tables
        self.memory_limit = memory_limit
        self.threads = threads
        self._regions = dict(regions or {})
        self._spill = pathlib.Path(tempfile.mkdtemp(prefix="pathspace-"))
        self._connections: dict[duckdb.DuckDBPyConnection, pathlib.Path] = {}  # open ones, and where they spill
        self._own: duckdb.DuckDBPyConnection | None = None

    @property
    def settings(self) -> dict[str, Any]:
        """The settings that the run was traced with."""
        settings: dict[str, Any] = self.manifest["settings"]
        return settings

    @property
    def light_words(self) -> bool:
        """Whether paths of this run use light walks."""
        return "paths" in self.tables and "light_word" in self.tables["paths"].schema.names

    @functools.cached_property
    def words(self) -> WordTree:
        """The tree of words, ready to be folded over and looked up."""
        return WordTree(self.tables["words"])

    def files(self, *tables: str) -> list[dict[str, pathlib.Path]]:
        """The files of these tables, shard by shard: ``queries.shards`` opens no others. A table that the run lacks is left out."""
        return [{name: file for name, file in shard.items() if name in tables} for shard in self.shard_files]

    @functools.cached_property
    def regions(self) -> "dict[str, Region]":
        """The job's regions and those that the run was opened with, which come first. Raises QueryError for a bad description."""
        from queries.regions import Region, region

        job = self.manifest.get("job") or {}
        base = pathlib.Path(self.manifest.get("job_file", self.path)).parent
        named = {name: region(given, base) for name, given in (job.get("regions") or {}).items()}
        return named | {name: given if isinstance(given, Region) else region(given) for name, given in self._regions.items()}

    @functools.cached_property
    def geometry(self) -> "SceneGeometry":
        """The scene's surfaces, as regions need them."""
        from queries.regions import SceneGeometry

        return SceneGeometry(self)

    def require_paths(self, lost: str) -> None:
        """Raise ``QueryError`` where the run recorded no paths; ``lost`` says what is not possible without them."""
        if self.settings["keep"] <= 0 or "paths" not in self.tables:
            raise QueryError(f"`{self.path}` recorded no paths (record.keep is none), so {lost}: record some, as in `keep: 0.1`")

    def require_unlit(self, wanted: str) -> None:
        """Raise ``QueryError`` where the run does not know the film positions of camera walks that carried nothing, so cannot be ``wanted``."""
        if "unlit" not in self.tables:
            raise QueryError(
                f"`{self.path}` cannot be {wanted}: it was rendered before camera walks that carry nothing were recorded (table `unlit`), "
                "and they count in the weights of a filter. Render it again"
            )

    def require_whole(self) -> None:
        """Raise ``QueryError`` where only some shards are open."""
        found, shards = len(self.shard_files), self.manifest["shards"]["count"]
        if found != shards:
            raise QueryError(f"expected a whole run, found {found} of {shards} shards open: open all of it, `{self.path}` without `shards`")

    def compile(self, text: str, dialect: str = "std") -> "Expression":
        """A light path expression whose names are those of this run. Raises ``ExpressionError``."""
        from queries.lpe import compile

        return compile(text, dialect, self.names, self.regions)

    @functools.cached_property
    def names(self) -> dict[str, frozenset[str]]:
        """The names of objects, materials and emitters, each with what it names: ``object``, ``material``, ``light``."""
        from queries.lpe.names import kinds_by_name

        objects, emitters = self.tables["objects"], self.tables["emitters"]
        return kinds_by_name(objects["name"].to_pylist(), objects["material"].to_pylist(), emitters["name"].to_pylist())

    def sql(self, text: str, time_limit: float | None = 60.0) -> pa.Table:
        """The answer to a query as an Arrow table (``queries.sql.query``)."""
        from queries.sql import query

        return query(self, text, time_limit)

    @property
    def connection(self) -> duckdb.DuckDBPyConnection:
        """The run's own connection, made when first asked for."""
        if self._own is None:
            self._own = self.connect()
        return self._own

    def connect(self) -> duckdb.DuckDBPyConnection:
        """A fresh connection: the views, and what a query makes in it; files, settings and extensions are out of reach."""
        spill = pathlib.Path(tempfile.mkdtemp(dir=self._spill))
        config: dict[str, str | bool | int | float | list[str]] = {**_LOCKED, "memory_limit": self.memory_limit, "temp_directory": str(spill)}
        if self.threads:
            config["threads"] = str(self.threads)
        connection = duckdb.connect(":memory:", config=config)
        self._connections[connection] = spill
        create_views(connection, self.tables)
        connection.execute("SET enable_external_access = false")
        connection.execute("SET lock_configuration = true")
        return connection

    def disconnect(self, connection: duckdb.DuckDBPyConnection) -> None:
        """Close a connection that ``connect`` made, and remove what it spilled."""
        connection.close()
        spill = self._connections.pop(connection, None)
        if spill is not None:
            shutil.rmtree(spill, ignore_errors=True)

    def close(self) -> None:
        """Close all connections and remove what they spilled."""
        for connection in list(self._connections):
            self.disconnect(connection)
        self._own = None
        self.tables = {}
        shutil.rmtree(self._spill, ignore_errors=True)

    def __enter__(self) -> "Run":
        """The run itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Close."""
        self.close()


def open_run(
    path: str | os.PathLike[str],
    memory_limit: str = MEMORY_LIMIT,
    threads: int | None = None,
    shards: range | None = None,
    regions: "Mapping[str, Region | Mapping[str, Any]] | None" = None,
) -> Run:
    """Open a finished run, or some of its shards with all of its catalogues. ``regions``: further ones, by name, or as described.

    Mapped pages count as the process's memory once they are read: what sums over rows can go through a large run some shards
    at a time. Raises ``RunError`` where the folder is no run, is unfinished, or lacks or holds damaged files.
    """
    folder = pathlib.Path(path)
    manifest = _read_manifest(folder)
    tables: dict[str, pa.Table] = {}
    files = _table_files(folder, manifest, shards)
    for name, found in files.items():
        parts = [_map_table(folder / file, file, size) for file, size in found]
        try:
            tables[name] = pa.concat_tables(parts)
        except pa.ArrowInvalid:
            raise RunError(f"the shards of table `{name}` in `{folder}` have different columns: render the run again") from None
    for name, rows in manifest.get("rows", {}).items():
        there = tables[name].num_rows if name in tables else 0
        if there != rows and shards is None:
            raise RunError(f"table `{name}` in `{folder}` has {there:,} rows, its manifest says {rows:,}: {_ADVICE}")
    recorded = [(name, [folder / file for file, _ in found]) for name, found in files.items() if name in RECORDED and name != "words"]
    shard_files = [dict(zip([name for name, _ in recorded], parts)) for parts in zip(*(parts for _, parts in recorded), strict=True)]
    return Run(folder, manifest, tables, shard_files, memory_limit, threads, regions)


_ADVICE = "run the job again with --resume, which renders damaged shards anew"


def _read_manifest(folder: pathlib.Path) -> dict[str, Any]:
    if not folder.is_dir():
        raise RunError(f"expected a run folder, found {'a file' if folder.exists() else 'nothing'} at `{folder}`")
    file = folder / "manifest.json"
    try:
        manifest = json.loads(file.read_bytes())
    except FileNotFoundError:
        raise RunError(f"`{folder}` is no run folder: it has no manifest.json. Make one with `pathspace run CONFIG --out {folder}`") from None
    except (OSError, ValueError) as error:
        raise RunError(f"`{file}` cannot be read ({error})") from None
    if not isinstance(manifest, dict) or not isinstance(manifest.get("settings"), dict):
        raise RunError(f"`{file}` is no manifest of a run: expected an object with `settings`")
    if manifest.get("status") != "complete":
        raise RunError(f"the run in `{folder}` is unfinished: run the job again with --resume")
    return manifest


def _table_files(folder: pathlib.Path, manifest: dict[str, Any], shards: range | None) -> dict[str, list[tuple[str, int]]]:
    """The files of each table, in the shards' order, with the sizes that they must have."""
    found: dict[str, list[tuple[str, int]]] = {}
    try:
        for shard in range(manifest["shards"]["count"]) if shards is None else shards:
            record = f"shards/{shard:05d}.json"
            for file, known in json.loads((folder / record).read_bytes())["files"].items():
                parts = pathlib.PurePosixPath(file).parts
                if parts[0] == "tables" and parts[1] in RECORDED:
                    found.setdefault(parts[1], []).append((file, known["bytes"]))
        for name, known in manifest["catalogues"].items():
            found[name] = [(f"tables/{name}.arrow", known["bytes"])]
    except FileNotFoundError:
        raise RunError(f"`{folder}` lacks {record}: {_ADVICE}") from None
    except (OSError, ValueError, KeyError, TypeError, IndexError, AttributeError) as error:
        raise RunError(f"what `{folder}` says of its files cannot be read ({type(error).__name__}: {error}): {_ADVICE}") from None
    for name in CATALOGUES:
        if name not in found:
            raise RunError(f"`{folder}` has no catalogue `{name}`: {_ADVICE}")
    return found


def _map_table(file: pathlib.Path, name: str, size: int) -> pa.Table:
    """One file as a memory-mapped table."""
    try:
        found = file.stat().st_size
    except OSError as error:
        raise RunError(f"`{file}` {'is missing' if isinstance(error, FileNotFoundError) else 'cannot be read'}: {_ADVICE}") from None
    if found != size:
        raise RunError(f"`{file}` is truncated or grown: expected {size:,} bytes, found {found:,}: {_ADVICE}")
    try:
        return pa.ipc.open_file(pa.memory_map(str(file))).read_all()
    except (pa.ArrowException, OSError) as error:
        raise RunError(f"`{file}` is damaged ({str(error).splitlines()[0]}): {_ADVICE}") from None
