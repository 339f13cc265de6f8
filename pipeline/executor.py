"""The local executor: one thread and one tracer for each core, shards handed out in order.

Kernels and rays release the GIL, so threads share memory and cores both. What a shard holds depends on its walk ids
alone, so neither the number of threads nor the order in which they finish shows in any file.
"""

import queue
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from pipeline.errors import Interrupted
from pipeline.files import clear_errors
from pipeline.progress import Progress
from pipeline.run_folder import RunFolder
from pipeline.shard_writer import write_shard
from pipeline.shards import Shard
from renderer.film import Film
from renderer.settings import TraceSettings
from renderer.trace import Tracer

_POLL_SECONDS = 0.2  # how soon an interrupt is noticed


@dataclass(frozen=True)
class _Failure:
    """What ended a worker."""

    error: BaseException


class Reports(queue.SimpleQueue[Shard | _Failure | None]):
    """What workers tell the main thread: a finished shard, a failure, or None where a worker ends."""


def render_shards(
    folder: RunFolder, shards: Iterable[Shard], settings: TraceSettings, tracers: Iterable[Callable[[], Tracer]], progress: Progress
) -> None:
    """Render and write the given shards, with one worker for each of ``tracers`` (which make them, inside the thread).

    An error in any worker stops the others at their next tile and is raised here. KeyboardInterrupt does the same: shards that are
    finished stay, Interrupted is raised.
    """
    waiting: queue.SimpleQueue[Shard] = queue.SimpleQueue()
    reports = Reports()
    for shard in shards:
        waiting.put(shard)
    stop = threading.Event()

    def work(make: Callable[[], Tracer]) -> None:
        try:
            tracer, film = make(), Film(settings.width, settings.height, settings.filter)
            while not stop.is_set():
                shard = waiting.get_nowait()
                with clear_errors(f"writing shard {shard.name}", folder.path):
                    write_shard(folder, shard, tracer, film, stop)
                reports.put(shard)
        except queue.Empty:
            pass
        except BaseException as error:  # whatever ended it, the main thread must hear of it
            reports.put(_Failure(error))
        finally:
            reports.put(None)

    workers = [threading.Thread(target=work, args=(make,), name=f"tracer-{i}", daemon=True) for i, make in enumerate(tracers)]
    for worker in workers:
        worker.start()
    error: BaseException | None = None
    try:
        error = _listen(reports, len(workers), stop, progress)
    except KeyboardInterrupt:
        error = Interrupted("interrupted: finished shards are kept, and --resume goes on from them")
    finally:
        stop.set()
        for worker in workers:
            worker.join()
    if error is not None:
        raise error


def _listen(reports: Reports, workers: int, stop: threading.Event, progress: Progress) -> BaseException | None:
    """Follow the workers until all have ended; the first failure, if any."""
    failure: BaseException | None = None
    while workers:
        try:
            report = reports.get(timeout=_POLL_SECONDS)
        except queue.Empty:
            continue
        if report is None:
            workers -= 1
        elif isinstance(report, _Failure):
            if failure is None:
                failure = report.error
            stop.set()
        else:
            progress.advance(report.count)
    return failure
