"""What the command line says when a run cannot go on: a message for people, and an exit code."""

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


class PipelineError(Exception):
    """A failure with a clear message: what was expected, what was found, where, and what to do."""

    exit_code = FAILED


class JobError(PipelineError, ValueError):
    """A job, an argument or a run folder that was named wrongly: the caller can fix it. ``place`` is ``file:line`` where known."""

    exit_code = BAD_INPUT

    def __init__(self, message: str, place: str = "") -> None:
        super().__init__(f"{place}: {message}" if place else message)
        self.place = place


class RunFolderError(PipelineError):
    """A run folder that cannot be written or read now: locked, full, unwritable, damaged."""


class Interrupted(PipelineError):
    """The run was asked to stop. What is finished is kept, and ``--resume`` goes on."""

    exit_code = INTERRUPTED
