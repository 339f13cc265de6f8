"""A benchmark from its file to its report, section by section."""

import pathlib
import tempfile
from collections.abc import Callable, Sequence

from pipeline.bench.config import load_benchmark
from pipeline.bench.contenders import Contenders
from pipeline.bench.error import measure_error
from pipeline.bench.features import measure_features
from pipeline.bench.memory import measure_memory
from pipeline.bench.pictures import measure_pictures
from pipeline.bench.questions import measure_questions
from pipeline.bench.rates import measure_rates
from pipeline.bench.report import TITLES, machine, print_rows, write_report
from pipeline.bench.results import SectionResult
from pipeline.bench.session import Session
from pipeline.bench.size import measure_size
from pipeline.bench.start import measure_start
from pipeline.bench.subpixel import measure_subpixel
from pipeline.errors import DONE
from pipeline.files import clear_errors
from pipeline.prepare import prepare_job
from pipeline.progress import LOG

SECTIONS: dict[str, Callable[[Session], SectionResult]] = {
    "rates": measure_rates,
    "size": measure_size,
    "memory": measure_memory,
    "error": measure_error,
    "start": measure_start,
    "features": measure_features,
    "questions": measure_questions,
    "pictures": measure_pictures,
    "subpixel": measure_subpixel,
}


def run_bench(config: pathlib.Path, out: pathlib.Path | None = None, settings: Sequence[str] = ()) -> int:
    """Measure what a benchmark file asks for and write ``results.json``, ``results.md`` and charts; the exit code.

    A goal that is missed is a result, not a failure. ``settings`` are ``key=value`` changes to the file. Raises JobError, SceneError
    and what the pipeline raises where a run fails.
    """
    loaded = load_benchmark(config, settings)
    prepared = prepare_job(loaded.job, loaded.overrides)
    folder, benchmark = loaded.folder(out), loaded.benchmark
    results: dict[str, SectionResult] = {}
    with clear_errors("measuring", folder):
        (folder / "logs").mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix="scratch-", dir=folder, ignore_cleanup_errors=True) as name:
            scratch = pathlib.Path(name)
            made = Contenders(prepared.scene, prepared.settings, benchmark.threads, loaded.job, loaded.overrides, scratch, folder / "logs")
            session = Session(loaded, prepared.scene, prepared.settings, made, scratch, folder / "logs")
            before = machine()
            try:
                for section in benchmark.sections:
                    LOG.info("— %s —", TITLES[section])
                    results[section] = SECTIONS[section](session)
                    for row in results[section].rows:
                        LOG.info("%s: %s (goal: %s): %s", row.what, row.measured, row.goal, row.verdict)
                    write_report(folder, session, results, before)
            finally:
                made.close()
    print_rows(results)
    LOG.info("results: %s", folder / "results.md")
    return DONE
