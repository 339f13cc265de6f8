"""What lies in ranges of rows: the vertices that a path uses are rows first … end - 1 of a table; none where end <= first."""

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel

I64 = npt.NDArray[np.int64]
U8 = npt.NDArray[np.uint8]


@kernel
def mark_ranges(first: I64, end: I64, marked: npt.NDArray[np.bool_]) -> None:
    """Mark the rows that lie in some range."""
    for i in range(len(first)):
        # Paths of one walk share its beginning: most ranges are marked by then, to their ends
        for row in range(end[i] - 1, first[i] - 1, -1):
            if marked[row]:
                break
            marked[row] = True


@kernel
def largest_in_ranges(first: I64, end: I64, codes: U8, largest: U8) -> None:
    """Raise each range's ``largest`` to the largest code of its rows."""
    for i in range(len(first)):
        for row in range(first[i], end[i]):
            largest[i] = max(largest[i], codes[row])
