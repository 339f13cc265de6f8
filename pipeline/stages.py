"""A run, stage by stage: compile the scene, trace, sum the film, write catalogues and images, then answer what the job asks and draw it."""

import functools
import pathlib
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from pipeline import catalogues, film_sum, images
from pipeline.errors import JobError, RunFolderError
from pipeline.estimate import SizeEstimate, refuse_too_large, refuse_too_much_memory
from pipeline.executor import render_shards
from pipeline.files import FileRecord, checksum, clear_errors, is_whole
from pipeline.identity import camera, differences, processor, renderer_version, settings_as_json, versions
from pipeline.inspection import size_with_inspection, trace_inspection
from pipeline.prepare import PreparedJob, prepare_job
from pipeline.progress import LOG, log_file, progress
from pipeline.questions import region_terms
from pipeline.run_folder import COMPLETE, RENDERING, RunFolder
from pipeline.shards import Shard, plan_shards, shard_count, shard_size
from pipeline.stopwatch import Stopwatch, peak_rss_bytes
from queries.shards import cores
from renderer.film import Film
from renderer.trace import Tracer

LAYERS = "layers"  # the file of all images: no AOV may have its name


def validate_job(path: pathlib.Path, overrides: Sequence[str] = (), out: pathlib.Path | None = None) -> tuple[PreparedJob, SizeEstimate]:
    """Check a job as ``run`` would, and estimate its size; nothing is written. Raises JobError and SceneError."""
    prepared = prepare_job(path, overrides)
    refuse_too_much_memory(prepared.settings, cores())
    size = size_with_inspection(prepared, Tracer(prepared.scene, prepared.settings))
    refuse_too_large(size, RunFolder(prepared.loaded.run_folder(out)))
    return prepared, size


def run_job(
    path: pathlib.Path, overrides: Sequence[str] = (), out: pathlib.Path | None = None, resume: bool = False, threads: int | None = None
) -> RunFolder:
    """Run a job into its folder, or go on with it. Raises JobError, SceneError, RunFolderError or Interrupted."""
    watch = Stopwatch()
    with watch.stage("scene"):
        prepared = prepare_job(path, overrides)
    threads = threads or cores()
    refuse_too_much_memory(prepared.settings, threads)
    folder = RunFolder(prepared.loaded.run_folder(out))
    with folder.locked(), clear_errors("running the job", folder.path), log_file(folder.path / "log.txt"):
        try:
            Run(prepared, folder, watch, threads, resume).go()
        except BaseException as error:
            LOG.debug("stopped: %s", error)
            raise
    return folder


class Run:
    """One run of a prepared job into a locked folder."""

    def __init__(self, prepared: PreparedJob, folder: RunFolder, watch: Stopwatch, threads: int, resume: bool) -> None:
        self.prepared, self.folder, self.watch, self.threads = prepared, folder, watch, threads
        self.job, self.settings, self.scene = prepared.loaded.job, prepared.settings, prepared.scene
        self.film = Film(self.settings.width, self.settings.height, self.settings.filter)
        self.manifest = self._manifest(self._same_run(resume))

    def go(self) -> None:
        """All stages, in order."""
        summed = film_sum.load_film(self.folder, self.film, _record(self.manifest["film"]))
        if self.folder.finished_shards() < shard_count(self.settings.walks):
            self._refuse_too_large()
        with self.watch.stage("verify"):
            missing = self._missing_shards(film_needed=not summed)
        if missing:
            self._render(missing)
        with self.watch.stage("images"):
            if not summed:
                self.manifest["film"] = film_sum.sum_films(self.folder, self.shards, self.film).as_json()
            self._write_image("beauty", self.film.image(self.settings.method, self.settings.passes), None)
        with self.watch.stage("catalogues"):
            self._write_catalogues()
        self.manifest["status"] = COMPLETE
        self._save()
        film_sum.drop_films(self.folder, self.shards)
        with self.watch.stage("aovs"):
            self._write_aovs()
        with self.watch.stage("rankings"):
            self._write_rankings()
        with self.watch.stage("inspection"):
            self._trace_inspection()
        with self.watch.stage("views"):
            self._write_views()
        with self.watch.stage("subpixel"):
            self._analyze_subpixels()
        self._save()
        with self.watch.stage("report"):
            self._write_report()
        self._save()
        LOG.info("done: %s", self.folder.path)

    # --- which run this is ----------------------------------------------------------------------------------------

    def _same_run(self, resume: bool) -> dict[str, Any]:
        """The manifest of the run to go on with, empty for a new one; refuses folders of other runs."""
        old = self.folder.manifest()
        if old is None:
            return {}
        different = differences(old.get("fingerprint", {}), self.prepared.fingerprint)
        if different:
            raise JobError(f"`{self.folder.path}` holds a run of another job ({different}): choose another folder with --out")
        if not resume:
            state = "complete" if old.get("status") == COMPLETE else "unfinished"
            raise JobError(
                f"`{self.folder.path}` holds this job's run already, {state}: add --resume to go on with it, or choose another folder with --out"
            )
        return old

    def _manifest(self, old: dict[str, Any]) -> dict[str, Any]:
        """The manifest as known before rendering."""
        job = self.prepared.loaded
        return {
            "name": self.job.name,
            "status": RENDERING,
            "job": self.job.model_dump(mode="json"),
            "job_file": str(job.file.absolute()),
            "overrides": list(job.overrides),
            "fingerprint": self.prepared.fingerprint,
            "settings": settings_as_json(self.settings),
            "seed": self.settings.seed,
            "camera": camera(self.scene),
            "versions": old.get("versions") or versions(),
            "warnings": list(self.scene.warnings),
            "shards": {"count": shard_count(self.settings.walks), "walks": shard_size(self.settings.walks)},
            "film": old.get("film"),
            "catalogues": old.get("catalogues", {}),
            "images": old.get("images", {}),
            "rankings": old.get("rankings", {}),
            "views": old.get("views", {}),
            "subpixel": old.get("subpixel", {}),
            "stats": old.get("stats", {}),
        }

    # --- rendering ------------------------------------------------------------------------------------------------

    @functools.cached_property
    def shards(self) -> tuple[Shard, ...]:
        """All shards of the run; there may be many, so they are listed once the run's size was checked."""
        return plan_shards(self.settings.walks)

    @functools.cached_property
    def tracer(self) -> Tracer:
        """The first tracer; its kernels are compiled, or loaded, when it is asked for."""
        with self.watch.stage("kernels"):
            LOG.info("loading kernels (compiled on the first run, up to a minute) …")
            tracer = Tracer(self.scene, self.settings)
            tracer.warm_up()
        return tracer

    def _refuse_too_large(self) -> None:
        """Estimate the size of the run, and refuse it before anything is written if it cannot fit."""
        tracer = self.tracer
        with self.watch.stage("estimate"):
            size = size_with_inspection(self.prepared, tracer)
            LOG.info("%d walks, about %s", self.settings.walks, size.text())
            refuse_too_large(size, self.folder)

    def _missing_shards(self, film_needed: bool) -> list[Shard]:
        """The shards that must be rendered; those that were whole once are named."""
        self._save()
        self.folder.prepare()
        with ThreadPoolExecutor(self.threads) as pool:
            found = list(pool.map(lambda shard: self.folder.damage(shard, film_needed), self.shards))
        missing = [shard for shard, damage in zip(self.shards, found, strict=True) if damage is not None]
        for shard, damage in zip(self.shards, found, strict=True):
            if damage:
                LOG.warning("shard %s is rendered again: %s", shard.name, damage)
        if len(missing) < len(self.shards):
            LOG.info("%d of %d shards are there and whole", len(self.shards) - len(missing), len(self.shards))
        return missing

    def _render(self, missing: list[Shard]) -> None:
        """Trace and write what is missing."""
        self._check_version(len(missing) < len(self.shards))
        first = self.tracer
        others = max(1, min(self.threads, len(missing))) - 1
        tracers: list[Callable[[], Tracer]] = [lambda: first, *[lambda: Tracer(self.scene, self.settings, first.accelerators)] * others]
        walks = sum(shard.count for shard in missing)
        seconds = self.watch.seconds.get("render", 0.0)
        try:
            with self.watch.stage("render"), progress("tracing", walks, "samples") as bar:
                render_shards(self.folder, missing, self.settings, tracers, bar)
        finally:
            self._add_render_stats(walks if sys.exc_info()[0] is None else bar.done, self.watch.seconds["render"] - seconds)
            self._save()
        LOG.info("traced %d walks in %.1f s", walks, self.watch.seconds["render"] - seconds)

    def _check_version(self, going_on: bool) -> None:
        """Shards of two versions of the renderer, or of two kinds of processor, must not be mixed."""
        here, there = renderer_version(), self.manifest["versions"].get("renderer")
        if going_on and here != there:
            raise RunFolderError(
                f"`{self.folder.path}` was begun by another version of the renderer ({there}, this is {here}), whose numbers may differ "
                "in their last bits: go on with that version, or choose another folder with --out"
            )
        here, there = processor(), self.manifest["versions"].get("processor")
        if going_on and here != there:
            raise RunFolderError(
                f"`{self.folder.path}` was begun on another kind of processor ({there}, this is {here}), whose numbers may differ "
                "in their last bits: go on with it there, or choose another folder with --out"
            )
        self.manifest["versions"] = versions()

    def _add_render_stats(self, walks: int, seconds: float) -> None:
        stats = self.manifest["stats"]
        stats["rendered_walks"] = stats.get("rendered_walks", 0) + walks
        stats["render_seconds"] = stats.get("render_seconds", 0.0) + seconds
        stats["samples_per_second"] = stats["rendered_walks"] / max(stats["render_seconds"], 1e-9)
        stats["threads"] = self.threads

    # --- what is made of it ---------------------------------------------------------------------------------------

    def _write_catalogues(self) -> None:
        """Sum the shards' counts, then write the small tables."""
        rows: dict[str, int] = {}
        size = 0
        for shard in self.shards:
            record = self.folder.read_shard(shard)
            if record is None:
                raise RunFolderError(f"shard {shard.name} vanished from `{self.folder.path}`: run again with --resume")
            for key, value in record["counts"].items():
                rows[key] = rows.get(key, 0) + value
            size += sum(file["bytes"] for name, file in record["files"].items() if name.startswith("tables/"))
        counts = {table: rows.get(f"{table}_rows", 0) for table in catalogues.COUNTED}
        words = catalogues.merged_words(self.folder, self.shards if self.settings.keep > 0 else ())
        run = catalogues.run_row(self.job.name, self.settings, self.scene, self.manifest["versions"], {**counts, "words": words.num_rows})
        written = catalogues.write_catalogues(self.folder, self.scene, run, words)
        self.manifest["catalogues"] = {name: record.as_json() for name, record in written.items()}
        self.manifest["rows"] = {**counts, "words": words.num_rows}
        self.manifest["stats"] |= {"vertices": rows["vertices"], "paths": rows["paths"], "bytes": size}

    def _write_aovs(self) -> None:
        """Resolve every AOV from the tables, in one pass; images of expressions that are gone are left alone."""
        if not self.job.aovs:
            return
        from queries.images import images as resolve
        from queries.run import open_run

        wanted = {name: expression for name, expression in self.job.aovs.items() if not self._has_image(name, expression)}
        with progress("AOVs", len(self.job.aovs), "images") as bar:
            bar.advance(len(self.job.aovs) - len(wanted))
            if wanted:
                with open_run(self.folder.path, threads=self.threads) as run:
                    found = resolve(run, {name: run.compile(expression, self.job.dialect) for name, expression in wanted.items()})
                for name, pixels in found.items():
                    self._write_image(name, pixels, wanted[name])
                    bar.advance(1)
        if wanted or not self._has_layers():
            self._write_layers()

    def _write_rankings(self) -> None:
        """Make every ranking; those of other names are left alone."""
        if self.job.rank:
            from pipeline.rankings import write_rankings

            with progress("rankings", len(self.job.rank), "rankings") as bar:
                for name, made in write_rankings(self.folder, self.job, self.regions, self.manifest["rankings"], self.threads, bar):
                    self.manifest["rankings"][name] = made
                    self._save()  # an interrupted job goes on with the next ranking

    def _trace_inspection(self) -> None:
        """Trace the light walks that the job asks for beside its own."""

        def trace(job: PreparedJob, folder: RunFolder) -> None:
            LOG.info("tracing light walks for inspection …")
            watch = Stopwatch()
            with log_file(folder.path / "log.txt"):
                Run(job, folder, watch, self.threads, resume=True).go()

        trace_inspection(self.prepared, self.folder, trace)

    def _write_views(self) -> None:
        """Draw every view; those of other names are left alone."""
        if self.job.views:
            from pipeline.views import write_views

            cameras = {name: camera.model_dump(mode="json") for name, camera in self.job.cameras.items()}
            inspected = self.job.inspection.model_dump(mode="json") if self.job.inspection else None
            terms = {**self._terms(), "cameras": cameras, "inspection": inspected}
            with progress("views", len(self.job.views), "views") as bar:
                for name, drawn in write_views(self.folder, self.job, terms, self.manifest["views"], self.threads, bar):
                    self.manifest["views"][name] = drawn
                    self._save()  # an interrupted job goes on with the next view

    def _analyze_subpixels(self) -> None:
        """Derive, apply and compare the subpixel filters that the job asks for."""
        if self.job.analysis.subpixel is not None:
            from pipeline.subpixel import write_job_analysis

            LOG.info("analyzing subpixel filters …")
            self.manifest["subpixel"] = write_job_analysis(self.folder, self.job.analysis.subpixel, self.manifest["subpixel"], self.threads)

    def _write_report(self) -> None:
        """Write the report that the job asks for, anew each time: it tells what is in the folder now."""
        if self.job.report is not None:
            from pipeline.report import write_job_report

            LOG.info("writing the report …")
            write_job_report(self.folder, self.job.report, self.threads, scene=self.scene)

    def _has_layers(self) -> bool:
        """Whether the layered file was written before, of the same images."""
        known = self.manifest["images"].get(LAYERS, {})
        try:
            same = known["expressions"] == self.job.aovs and known["terms"] == self._terms()
            return bool(same) and is_whole(self.folder.image(LAYERS, "exr"), known["exr"])
        except KeyError:
            return False

    def _write_layers(self) -> None:
        """Write the image and all AOVs as layers of one EXR, with their expressions, and note its checksum."""
        names = {"": "beauty"} | {name: name for name in self.job.aovs}
        layers = {layer: images.read_exr(self.folder.image(name, "exr")) for layer, name in names.items()}
        expressions = {f"expression:{name}": text for name, text in self.job.aovs.items()}
        images.write_layers(self.folder.image(LAYERS, "exr"), layers, self._metadata(LAYERS) | expressions)
        record = FileRecord(0, *checksum(self.folder.image(LAYERS, "exr"))).as_json()
        self.manifest["images"][LAYERS] = {"expression": None, "expressions": dict(self.job.aovs), "terms": self._terms(), "exr": record}

    def _has_image(self, name: str, expression: str) -> bool:
        """Whether the AOV was computed before, from the same expression in the same terms."""
        known = self.manifest["images"].get(name, {})
        try:
            same = known["exposure"] == self.job.images.exposure and known["expression"] == expression and known["terms"] == self._terms()
            return same and is_whole(self.folder.image(name, "exr"), known["exr"])
        except KeyError:
            return False

    def _write_image(self, name: str, image: images.F32, expression: str | None) -> None:
        """Write one image in both kinds, and note its checksums."""
        exposure = self.job.images.exposure
        images.write_exr(self.folder.image(name, "exr"), image, self._metadata(name) | {"expression": expression or ""})
        images.write_png(self.folder.image(name, "png"), image, exposure)
        files = {kind: FileRecord(0, *checksum(self.folder.image(name, kind))).as_json() for kind in ("exr", "png")}
        self.manifest["images"][name] = {"expression": expression, "exposure": exposure, **files}
        if expression is not None:
            self.manifest["images"][name]["terms"] = self._terms()

    def _terms(self) -> dict[str, Any]:
        """What expressions mean in this job: their dialect and its regions."""
        return {"dialect": self.job.dialect, "regions": self.regions}

    @functools.cached_property
    def regions(self) -> dict[str, Any]:
        """The job's regions, as images and rankings depend on them."""
        return region_terms(self.prepared.loaded)

    def _metadata(self, name: str) -> dict[str, str]:
        """What an image file says of the run."""
        return {
            "job": self.job.name,
            "image": name,
            "method": self.settings.method,
            "seed": str(self.settings.seed),
            "samples": str(self.settings.passes),
            "max_depth": str(self.settings.max_depth),
            "version": self.manifest["versions"]["pathspace"],
        }

    def _save(self) -> None:
        """Write the manifest with what is known by now."""
        stages = {name: round(seconds, 4) for name, seconds in self.watch.seconds.items()}
        self.manifest["stats"] |= {"peak_rss_bytes": peak_rss_bytes(), "stages": stages, "peak_rss_bytes_by_stage": dict(self.watch.peaks)}
        self.folder.write_manifest(self.manifest)


def _record(value: dict[str, Any] | None) -> FileRecord | None:
    return None if value is None else FileRecord(**value)
