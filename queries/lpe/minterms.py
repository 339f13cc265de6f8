"""What an expression can tell apart in one field of an event: a truth column of its tests for each kind of value.

All arrays are bool (tests or steps, values). A field's tests see names only through the tests that list them: names that are always
listed together count as one.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from queries.errors import ExpressionError
from queries.lpe.limits import MAX_CELLS
from queries.lpe.syntax import EVENT_TYPES, NUMBERED_FIELDS, SCATTERING_TYPES, PathEvent, Step, Test, in_range

Bits = npt.NDArray[np.bool_]
UNNAMED = "\0"  # a letter that no expression can name
TYPES = EVENT_TYPES + UNNAMED
_SCATTERINGS = SCATTERING_TYPES + UNNAMED
_MAX_TABLE = 20_000_000  # rows times columns
# How many of its names a field may have at once; an event may lie in any number of regions, and a light has a name and its shape's.
_AT_ONCE = {"object": 1, "material": 1, "medium": 1, "blocker": 1, "technique": 1, "light": 2}


def columns(steps: Sequence[Step], field: str) -> Bits:
    """Whether values of a field pass the steps' tests of it: bool (steps, values). Of types, every value in order; else distinct values."""
    tests = list(dict.fromkeys(test for step in steps for test in step.tests if test.field == field))
    values = _values(tests, field)
    check_size(len(steps), values.shape[1])
    numbers = {test: i for i, test in enumerate(tests)}
    table = np.ones((len(steps), values.shape[1]), np.bool_)
    for row, step in zip(table, steps):
        for test in step.tests:
            if test.field == field:
                row &= values[numbers[test]]
    return table if field == "type" else table[:, distinct(table)[0]]


def depths(steps: Sequence[Step]) -> Bits:
    """Whether each depth passes the steps' tests of it, up to one above all that are named: bool (steps, depths)."""
    tests = list(dict.fromkeys(test for step in steps for test in step.tests if test.field == "depth"))
    numbers = {test: i for i, test in enumerate(tests)}
    carried = _ranges(tests)
    table = np.ones((len(steps), carried.shape[1]), np.bool_)
    for row, step in zip(table, steps):
        for test in step.tests:
            if test.field == "depth":
                row &= carried[numbers[test]] == (test.mode == "in")
    return table


def distinct(table: Bits) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """The first of each kind of column, and for each column its kind."""
    packed = np.ascontiguousarray(np.packbits(table, axis=0).T)
    keys = packed.view(np.dtype((np.void, packed.shape[1]))).ravel() if packed.size else np.zeros(table.shape[1], np.uint8)
    _, first, kind = np.unique(keys, return_index=True, return_inverse=True)
    return first, kind.ravel()


def check_size(rows: int, cells: int) -> None:
    """Refuse tables that are too large."""
    if cells > MAX_CELLS or rows * cells > _MAX_TABLE:
        raise ExpressionError("the expression tells too many kinds of events apart: use fewer different symbols, labels and names")


def _values(tests: Sequence[Test], field: str) -> Bits:
    """The tests' answers for each value of a field: bool (tests, values)."""
    if field == "type":
        return np.array([[test.accepts(PathEvent(letter, None)) for letter in TYPES] for test in tests], np.bool_).reshape(-1, len(TYPES))
    if field == "scattering":
        return np.array([[test.accepts(PathEvent("", None if letter == "x" else letter)) for letter in _SCATTERINGS] for test in tests])
    if field == "label":
        return _label_lists(tests)
    if field in NUMBERED_FIELDS:
        ranges = _ranges(tests)
        carried = np.hstack([np.zeros((len(tests), 1), np.bool_), ranges])  # at first of an event that has no such number
    else:
        carried = _names(tests, _AT_ONCE.get(field))
    answers: Bits = carried == np.array([test.mode == "in" for test in tests])[:, None]
    return answers


def _ranges(tests: Sequence[Test]) -> Bits:
    """Whether each number, up to one above all that are named, lies in one of a test's ranges: bool (tests, numbers)."""
    top = max(int(digits or 0) for test in tests for name in test.names for digits in name.split(".."))
    check_size(len(tests), top)
    return np.array([[any(in_range(number, name) for name in test.names) for number in range(top + 2)] for test in tests])


def _names(tests: Sequence[Test], at_once: int | None) -> Bits:
    """Whether each combination of at most so many names holds one of the tests' names."""
    listed = _listed(tests)
    none = np.zeros((len(tests), 1), np.bool_)
    if at_once is None:
        return _subsets(none, listed)
    if at_once == 1:
        return np.hstack([none, listed])
    first, second = np.triu_indices(listed.shape[1])
    check_size(len(tests), len(first))
    return np.hstack([none, listed[:, first] | listed[:, second]])


def _listed(tests: Sequence[Test]) -> Bits:
    """Which tests list each kind of name: bool (tests, kinds)."""
    names = sorted({name for test in tests for name in test.names})
    check_size(len(tests), len(names))
    table = np.array([[name in test.names for name in names] for test in tests], np.bool_).reshape(len(tests), len(names))
    return table[:, np.sort(distinct(table)[0])]


def _subsets(start: Bits, kinds: Bits) -> Bits:
    """The distinct unions of ``start``'s columns with any of ``kinds``."""
    found = start
    for kind in kinds.T:
        found = np.hstack([found, found | kind[:, None]])
        check_size(len(found), found.shape[1])
        found = found[:, distinct(found)[0]]
    return found


# --- labels -------------------------------------------------------------------------------------------------------


def _label_lists(tests: Sequence[Test]) -> Bits:
    """The tests' answers for each list of labels: as sets for tests of any place, and place by place for those of one.

    While places are gone through, further rows remember what the list holds, so that no list is longer in one place than in another.
    Lists that no event has may remain; they do no harm.
    """
    listed = _listed(tests)
    anywhere = np.array([test.position is None for test in tests])
    others = np.array([test.mode == "other" for test in tests])
    modes = np.array([test.mode == "in" for test in tests])
    count, kinds = listed.shape
    places = max((test.position + 1 for test in tests if test.position is not None), default=0)
    # Rows: the tests, whether there is a label at the place before (at first: anywhere), and which kinds of labels there are.
    held = kinds if places and anywhere.any() else 0
    here = count
    cells = np.zeros((count + 1 + held, 1), np.bool_)
    if anywhere.any():
        memory = np.eye(kinds, dtype=np.bool_)[:held]
        options = np.vstack([listed & anywhere[:, None], np.ones((1, kinds), np.bool_), memory])
        unnamed = np.zeros((len(cells), 1), np.bool_)
        unnamed[here] = True
        cells = _subsets(cells, np.hstack([options, unnamed]))
        carried = cells[:count]
        cells[:count] = np.where(modes[:, None], carried, ~carried & (cells[here] | ~others[:, None])) & anywhere[:, None]
    elif places:
        cells = np.hstack([cells, cells])
        cells[here, 1] = True
    for place in range(places):
        cells = _at_place(cells, place, tests, listed, held)
    return cells[:count, distinct(cells[:count])[0]]


def _at_place(cells: Bits, place: int, tests: Sequence[Test], listed: Bits, held: int) -> Bits:
    """The cells divided by what stands at one place: nothing, a label without a name, or one of each kind."""
    count, kinds = listed.shape
    rows = np.array([test.position == place for test in tests])
    modes = np.array([test.mode == "in" for test in tests])
    before = cells[count]
    blocks = []
    for option in range(-2, kinds):
        if option == -2:  # a list that is not empty has a first label; others may end anywhere
            allowed, passed = (~before if place == 0 else np.ones_like(before)), np.zeros(count, np.bool_)
        else:
            allowed = before & (cells[count + 1 + option] if held and option >= 0 else True)
            passed = (listed[:, option] if option >= 0 else np.zeros(count, np.bool_)) == modes
        block = cells[:, allowed]
        block[:count][rows] = passed[rows, None]
        block[count] = option != -2
        blocks.append(block)
    found = np.hstack(blocks)
    check_size(len(found), found.shape[1])
    return found[:, distinct(found)[0]]
