"""The numba policy of queries: no GIL, cached on disk, numpy's error model, and no allocation inside kernels.

As in ``renderer.kernel``, numba's disk cache does not notice an edited callee, so its folder is named after a hash of all kernel sources.
"""

import hashlib
import os
import pathlib
import platform
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np

F = TypeVar("F", bound=Callable[..., Any])


def cache_folder() -> pathlib.Path:
    """The folder of compiled kernels: ``$PATHSPACE_CACHE`` or ``~/.cache/pathspace``, then a hash of what they depend on."""
    root = os.environ.get("PATHSPACE_CACHE") or os.path.join(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "pathspace")
    digest = hashlib.sha256()
    for text in (numba.__version__, np.__version__, platform.python_version(), platform.machine()):
        digest.update(text.encode())
    folder = pathlib.Path(__file__).parent / "kernels"
    for source in [pathlib.Path(__file__), *sorted(folder.glob("*.py"))]:
        digest.update(source.read_bytes())
    return pathlib.Path(root) / f"queries-{digest.hexdigest()[:16]}"


_CACHE = str(cache_folder())


def kernel(function: F) -> F:
    """Compile a function of ``queries/kernels`` with the project's flags."""
    settings = cast(Any, numba.config)
    before = settings.CACHE_DIR
    settings.CACHE_DIR = os.environ.get("NUMBA_CACHE_DIR") or _CACHE  # read when the function is decorated
    try:
        compiler = cast(Any, numba.njit)  # its stubs know neither `_nrt` nor functions of arrays
        return cast(F, compiler(nogil=True, cache=True, error_model="numpy", fastmath={"contract"}, _nrt=False)(function))
    finally:
        settings.CACHE_DIR = before
