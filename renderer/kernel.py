"""The one numba policy of the project, and where compiled kernels are cached.

``@kernel`` compiles a module-level function without the GIL, with numpy's error model and with fused multiply-adds as
the only relaxed rule (full ``fastmath`` would break NaN tests). Kernels are specialized by *type*: an optional piece
of the scene is ``None`` where a scene lacks it, and a callee that opens with ``if piece is None: return …`` loses the
rest of its body at compile time.

numba's disk cache does not notice an edited callee, so its folder is named after a hash of all kernel sources.

Kernels neither allocate nor own arrays, so they are compiled without numba's reference counts (``_nrt=False``): handing a
scene's arrays to a callee would otherwise cost one atomic operation for each array and call, and keep LLVM from inlining.
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
    package = pathlib.Path(__file__).parent
    for source in sorted(package.rglob("*.py")):
        if source.parent.name == "scene" and source.name != "arrays.py":
            continue  # the scene's compiler runs in plain Python
        digest.update(source.relative_to(package).as_posix().encode())
        digest.update(source.read_bytes())
    return pathlib.Path(root) / f"kernels-{digest.hexdigest()[:16]}"


if not os.environ.get("NUMBA_CACHE_DIR"):
    numba.config.CACHE_DIR = str(cache_folder())  # type: ignore[attr-defined]


def kernel(function: F) -> F:
    """Compile a function with the project's flags: no GIL, cached on disk, numpy's division, FMA contraction."""
    compiler = cast(Any, numba.njit)  # its stubs know neither `_nrt` nor functions of arrays
    return cast(F, compiler(nogil=True, cache=True, error_model="numpy", fastmath={"contract"}, _nrt=False)(function))
