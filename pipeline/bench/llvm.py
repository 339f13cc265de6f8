"""Finding an LLVM library that Dr.Jit can use. Loading a wrong one may abort the process, so each is tried in one of its own."""

import glob
import os
import pathlib
import re
import subprocess
import sys
from collections.abc import Iterable

from pipeline.bench.worker import environment

VARIABLE = "DRJIT_LIBLLVM_PATH"  # where Dr.Jit looks first
PLACES = ("~/.rustup/toolchains/*/lib/libLLVM*.so*", "/usr/lib/llvm-*/lib/libLLVM*.so*", "/opt/homebrew/opt/llvm/lib/libLLVM*.dylib")
TRIAL = """
import drjit, numpy
from drjit.llvm import Float
x = drjit.arange(Float, 100)
assert numpy.allclose(numpy.array(x * x + 1), numpy.arange(100.0) ** 2 + 1)
"""
_SECONDS = 120


def find_llvm() -> str | None:
    """Path of a usable library: what the environment names, else the newest that works. None: there is none."""
    named = os.environ.get(VARIABLE)
    return next((path for path in ([named] if named else candidates()) if usable(path)), None)


def candidates() -> list[str]:
    """Libraries where LLVM is usually installed, newest version first, each file once."""
    found = [path for place in PLACES for path in glob.glob(os.path.expanduser(place))]
    files = dict.fromkeys(os.path.realpath(path) for path in [*found, *linked()])
    return sorted(files, key=version, reverse=True)


def linked() -> Iterable[str]:
    """LLVM libraries that the system's linker knows."""
    try:
        listing = subprocess.run(["ldconfig", "-p"], capture_output=True, text=True, check=False, timeout=_SECONDS).stdout
    except (OSError, subprocess.TimeoutExpired):
        return []
    return re.findall(r"^\s*libLLVM\S* .*=> (\S+)$", listing, re.MULTILINE)


def version(path: str) -> int:
    """The major version in a library's file name, 0 where it has none.

    >>> version("/lib/libLLVM-15.so.1"), version("/lib/libLLVM.so.22.1-rust-1.95.0-stable"), version("/lib/libLLVM.so")
    (15, 22, 0)
    """
    match = re.search(r"libLLVM\D*(\d+)", pathlib.Path(path).name)
    return int(match[1]) if match else 0


def usable(path: str) -> bool:
    """Whether Dr.Jit compiles and runs a small kernel with the library."""
    try:
        done = subprocess.run([sys.executable, "-c", TRIAL], env=environment(**{VARIABLE: path}), capture_output=True, check=False, timeout=_SECONDS)
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0
