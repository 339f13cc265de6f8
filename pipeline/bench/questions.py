"""How long questions of a recorded run take, beside rendering the scene again and beside a regular expression for each path."""

import shutil
from collections.abc import Callable
from typing import Any

from pipeline.bench.config import Question
from pipeline.bench.contenders import LABELS, Contender, NotAvailable
from pipeline.bench.rates import WARM_UPS
from pipeline.bench.results import Row, SectionResult, markdown_table
from pipeline.bench.session import Session
from pipeline.bench.timing import Timing, alternate, ratio, spread
from pipeline.bench.worker import Worker
from pipeline.errors import JobError
from pipeline.progress import LOG
from pipeline.run_folder import RunFolder
from pipeline.stages import run_job

MOST_BYTES = 2e9
AGAIN = ("mitsuba_llvm", "mitsuba_scalar")  # who renders again: the first that this machine has
REGEX = "a Python regex for each path"


def measure_questions(session: Session) -> SectionResult:
    """Ask a recorded run each question in rounds; then ask a longer run once, for its memory."""
    asked = session.benchmark.questions
    result = SectionResult()
    with recorded(session, session.settings.passes) as folder, _worker(session, folder) as worker:
        paths = folder.paths
        contenders: dict[str, Callable[[int], Timing]] = {q.what: _ask(worker, q) for q in asked.ask}
        if asked.regex:
            contenders[REGEX] = _ask_regex(worker, asked.regex)
        name, again = _mitsuba(session)
        if again is not None:
            contenders[name] = lambda number: again.render(session.settings.passes, session.settings.seed + number)
        replies = {q.what: worker.ask(**_request(q)) for q in asked.ask}  # warm: kernels are loaded, pages are mapped
        _check_regex(worker, session)
        timings = alternate(contenders, session.benchmark.rounds)
    walls = {who: [timing.wall for timing in found] for who, found in timings.items()}
    others = [who for who in (name, REGEX) if who in walls]
    for question in asked.ask:
        result.rows.append(_row(question, walls, others, paths))
    result.figures = {"paths": paths, "wall_seconds": walls, "answers": replies}
    result.notes.append(_table(session, walls, others, paths))
    if asked.memory_samples:
        _measure_memory(session, result)
    return result


# --- asking -------------------------------------------------------------------------------------------------------


class recorded:
    """A recorded run of so many samples, removed in the end."""

    def __init__(self, session: Session, samples: int) -> None:
        self.session, self.samples, self.path = session, samples, session.scratch / "questions"

    def __enter__(self) -> "recorded":
        LOG.info("recording %d samples …", self.samples)
        overrides = [*self.session.loaded.overrides, "record.keep=all", f"render.samples={self.samples}"]
        run_job(self.session.loaded.job, overrides, self.path, threads=self.session.benchmark.threads)
        self.paths = int((RunFolder(self.path).manifest() or {})["rows"]["paths"])
        return self

    def __exit__(self, *_: object) -> None:
        shutil.rmtree(self.path, ignore_errors=True)


def _worker(session: Session, folder: recorded) -> Worker:
    return Worker("pipeline.bench.questions_worker", [str(folder.path), str(session.benchmark.threads)], session.logs / "questions.log")


def _request(question: Question) -> dict[str, Any]:
    return {"expression": question.expression, "rank": question.rank}


def _ask(worker: Worker, question: Question) -> Callable[[int], Timing]:
    def timing(_round: int) -> Timing:
        reply = worker.ask(**_request(question))
        return Timing(reply["wall"], reply["cpu"])

    return timing


def _ask_regex(worker: Worker, pattern: str) -> Callable[[int], Timing]:
    def timing(_round: int) -> Timing:
        reply = worker.ask(regex=pattern)
        return Timing(reply["wall"], reply["cpu"])

    return timing


def _check_regex(worker: Worker, session: Session) -> None:
    """Both must find the same paths, or they are not the same question."""
    asked = session.benchmark.questions
    if not asked.regex:
        return
    first = next(q for q in asked.ask if q.expression)
    theirs, ours = worker.ask(regex=asked.regex)["matched"], worker.ask(count=first.expression)["matched"]
    if theirs != ours:
        raise JobError(f"the regular expression `{asked.regex}` finds {theirs} paths, `{first.expression}` finds {ours}: not the same question")


def _mitsuba(session: Session) -> tuple[str, Contender | None]:
    """Who renders the scene again, warm."""
    for name in AGAIN:
        try:
            contender = session.contenders.get(name)
        except NotAvailable:
            continue
        for i in range(WARM_UPS):
            contender.render(session.settings.passes, session.settings.seed + 1000 + i)
        return f"rendering again ({LABELS[name]})", contender
    return "rendering again", None


# --- reporting ----------------------------------------------------------------------------------------------------


def _row(question: Question, walls: dict[str, list[float]], others: list[str], paths: int) -> Row:
    found = spread(walls[question.what])
    against = "".join(f"; {ratio(walls[question.what], walls[who]).median:.3f} × {who}" for who in others)
    measured = f"{found.text('.2f', ' s')} on {paths / 1e6:.1f} M paths{against}"
    return Row(question.what, f"≤ {question.most_seconds:g} s", measured, found.median <= question.most_seconds)


def _table(session: Session, walls: dict[str, list[float]], others: list[str], paths: int) -> str:
    rows = []
    for question in session.benchmark.questions.ask:
        text = f"`{question.expression}`" if question.expression else f"ranking of `{(question.rank or {}).get('region')}`"
        rows.append([question.what, text.replace("|", "\\|"), spread(walls[question.what]).text(".3f", " s")])
    rows += [[who, f"`{session.benchmark.questions.regex}`" if who == REGEX else "", spread(walls[who]).text(".3f", " s")] for who in others]
    note = f"\n\n{paths:,} paths, opened once; every figure is a whole answer: classification, sums and image, or the whole ranking."
    return markdown_table(["what", "question", "wall time, median (range)"], rows) + note


def _measure_memory(session: Session, result: SectionResult) -> None:
    """The most memory that each question takes on a long run, each in a process of its own."""
    peaks: dict[str, int] = {}
    with recorded(session, session.benchmark.questions.memory_samples) as folder:
        for question in session.benchmark.questions.ask:
            with _worker(session, folder) as worker:
                worker.ask(**_request(question))
                peaks[question.what] = worker.ask(peak=True)["peak_bytes"]
        paths = folder.paths
    most = max(peaks.values())
    measured = f"{most / 1e6:.0f} MB at most ({', '.join(f'{value / 1e6:.0f}' for value in peaks.values())} MB)"
    result.rows.append(Row(f"peak memory of each question on {paths / 1e6:.0f} M paths", "< 2 GB", measured, most < MOST_BYTES))
    result.figures["peak_bytes"] = peaks
