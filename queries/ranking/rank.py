"""Ranked lists of the classes of paths in a region (thesis 9.4.2)."""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from queries.classes import PathClasses
from queries.errors import QueryError
from queries.ranking.histograms import Histogram, histograms
from queries.ranking.labels import ClassLabels, DescriptorLabels, Label, Labels, selection
from queries.ranking.orders import ORDERS, Comparison, compare, order_key, tiers
from queries.ranking.places import Places
from queries.regions import Region
from queries.run import Run
from queries.statistics import Estimate, Units, effective_samples, verdicts

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
MINIMUM_SUPPORT = 30


def rank(
    run: Run,
    region: str | Region | None = None,
    by: str = "contribution",
    with_objects: bool = False,
    top: int | None = None,
    merge: bool = False,
    at: str = "seen",
    outer: float = 1.5,
    threads: int | None = None,
    minimum_support: int = MINIMUM_SUPPORT,
) -> pa.Table:
    """The classes of paths in a region, ranked; without a region, of the whole image.

    ``region``: a name of ``run.regions``, or a region. ``by``: one of ``queries.ranking.orders.ORDERS``; all but contribution compare with the
    ring that surrounds the region, up to the region enlarged by ``outer``. ``with_objects``: classes also differ by objects and emitters.
    ``merge``: classes are merged by high-level descriptors. ``at``: "seen", paths whose interaction next to the camera lies in the region;
    "any", paths with any interaction there. ``top``: how many are listed. ``minimum_support``: walks below which a class comes after all others
    when ranked by discrimination.

    Flux is the luminance of contributions, summed over the image's pixels. Errors are standard errors over the estimator's independent units
    (``queries.statistics``). Null stands for what cannot be known. Equal figures are ordered by flux, then by expression.

    Columns: ``rank``, ``description``, ``descriptor``, ``flux``, ``share`` (of the region's flux), ``cumulative`` (share, down to this rank),
    ``paths`` (rows), ``samples`` (walks that have such paths), ``effective_samples`` (walks of equal value that would have the same relative
    variance), ``units`` (that errors rest on), ``trusted`` and ``verdict`` (why errors cannot be trusted, null where they can), ``expression``
    (selects the class) and, with a named region, ``selection`` (selects the class's paths there). Comparisons have ``ratio``, ``ring_share``,
    ``ring_samples``, ``ring_verdict`` (why the errors of ``ring_share`` and ``ratio`` cannot be trusted) and ``outer_flux``; discrimination has
    ``lower`` (the bound that it ranks by) and ``supported``. Each estimate ``x`` has its standard error ``x_error`` beside it.

    Raises QueryError for unknown names and values, and where no path lies in the region, or none in the ring that it is compared with.
    """
    _check(by, at, top, merge and with_objects, region)
    units = Units.of_run(run)
    inner = _region(run, region)
    compared = by != "contribution"
    places = Places(run, inner, inner.enlarged(outer) if compared else None, at) if inner else None

    classes = PathClasses(run, with_objects, threads=threads)
    labels: Labels = DescriptorLabels(classes) if merge else ClassLabels(classes)
    inside, ring = histograms(run, len(labels), labels.of, units, places, threads)

    found = np.flatnonzero(inside.moments.rows)
    if not len(found):
        raise QueryError(_nothing(inner, at, inside=True))
    totals = inside.total, ring.total
    inside, ring_of_found = inside.of(found), ring.of(found)
    flux, comparison = units.total(inside.sums), None
    if compared:
        if not ring.moments.rows.any():
            raise QueryError(_nothing(inner, at, inside=False))
        comparison = compare(by, units, inside, ring_of_found, totals, minimum_support)
    key = order_key(by, units, flux, comparison)
    order = _order(key, flux.value, tiers(inside, comparison), lambda i: labels.label(int(found[i])).expression, top)
    columns: dict[str, Any] = {} if comparison is None else _compared(by, comparison, ring_of_found, order)
    columns |= _figures(units, inside, totals[0], flux, order)
    return _table(columns, labels, found[order[:top]], selection_of=(region, at) if isinstance(region, str) else None)


def _check(by: str, at: str, top: int | None, objects_of_merged: bool, region: object) -> None:
    if by not in ORDERS:
        raise QueryError(f"expected `by` to be one of {', '.join(ORDERS)}, found {by!r}")
    if at not in ("seen", "any"):
        raise QueryError(f"expected `at` to be seen or any, found {at!r}")
    if top is not None and top < 1:
        raise QueryError(f"expected `top` to be 1 or more, found {top}")
    if objects_of_merged:
        raise QueryError("high-level descriptors tell no objects apart: ask for merged classes or for objects, not for both")
    if region is None and by != "contribution":
        raise QueryError(f"a ranking by {by} compares a region with its surroundings: name a region, or rank by contribution")


def _region(run: Run, region: str | Region | None) -> Region | None:
    """The region itself, checked against the scene."""
    if isinstance(region, str):
        if region not in run.regions:
            known = f"known are {', '.join(sorted(run.regions))}" if run.regions else "the run has none"
            raise QueryError(f"there is no region `{region}` ({known}): name it in the job, or give it to `open_run`")
        region = run.regions[region]
    if region is not None:
        region.check(run.geometry)
    return region


def _nothing(region: Region | None, at: str, inside: bool) -> str:
    if region is None:
        return "the run has no paths: render with more samples"
    which = "is seen" if at == "seen" else "passes"
    if inside:
        more = "; `at: any` also finds paths that meet it on the way" if at == "seen" else ""
        return f"no recorded path {which} in the region, {region.describe()}: move or enlarge it, or render with more samples{more}"
    return f"no recorded path {which} around the region, {region.describe()}: make `outer` larger, or rank by contribution, which compares nothing"


def _order(key: F64, flux: F64, tier: I64, expression: Callable[[int], str], top: int | None) -> I64:
    """All classes in their order. Expressions are spelled for ties alone, and only as far down as is listed."""
    order = np.lexsort((-flux, -key, tier))
    tied = np.logical_and.reduce([column[order[1:]] == column[order[:-1]] for column in (flux, key, tier)])
    starts = np.flatnonzero(np.concatenate([[True], ~tied]))
    for first, end in zip(starts, [*starts[1:], len(order)]):
        if end - first > 1 and (top is None or first < top):
            order[first:end] = sorted(order[first:end], key=lambda i: expression(int(i)))
    return order


def _figures(units: Units, inside: Histogram, total: F64, flux: Estimate, order: I64) -> dict[str, Any]:
    """The columns that every ranking has, all ranks."""
    whole = np.broadcast_to(total, inside.sums.shape)
    share = units.ratio(inside.sums, whole)
    cumulative = units.ratio(np.cumsum(inside.sums[order], axis=0), whole)
    reasons = [units.reason or reason or None for reason in verdicts(inside.moments)]
    columns = _estimate("flux", flux, order) | _estimate("share", share, order)
    return columns | {
        "cumulative": cumulative.value,
        "cumulative_error": cumulative.error,
        "paths": inside.moments.rows[order].astype(np.int64),
        "samples": inside.moments.walks[order].astype(np.int64),
        "effective_samples": effective_samples(inside.moments)[order],
        "units": np.full(len(order), units.count),
        "trusted": np.array([reasons[i] is None for i in order], np.bool_),
        "verdict": pa.array([reasons[i] for i in order], pa.string()),
    }


def _compared(by: str, comparison: Comparison, ring: Histogram, order: I64) -> dict[str, Any]:
    """The columns of comparisons, all ranks."""
    columns = _estimate("ratio", comparison.ratio, order)
    if by == "discrimination":
        columns |= {"lower": comparison.lower[order], "supported": comparison.supported[order]}
    columns |= _estimate("ring_share", comparison.ring_share, order)
    reasons = verdicts(ring.moments)
    columns |= {"ring_samples": ring.moments.walks[order].astype(np.int64)}
    columns |= {"ring_verdict": pa.array([reasons[i] or None for i in order], pa.string())}
    return columns | _estimate("outer_flux", comparison.outer, order)


def _estimate(name: str, estimate: Estimate, order: I64) -> dict[str, Any]:
    return {name: estimate.value[order], f"{name}_error": estimate.error[order]}


def _table(columns: dict[str, Any], labels: Labels, classes: I64, selection_of: tuple[str, str] | None) -> pa.Table:
    """The first ranks as a table; NaN and infinities are null. What is to be copied, and may be long, comes last."""
    found: list[Label] = [labels.label(int(number)) for number in classes]
    table: dict[str, Any] = {"rank": np.arange(1, len(found) + 1)}
    table |= {"description": [label.description for label in found], "descriptor": [label.descriptor for label in found]}
    table |= {name: _column(values, len(found)) for name, values in columns.items()}
    table["expression"] = [label.expression for label in found]
    if selection_of is not None:
        table["selection"] = [selection(label.expression, *selection_of) for label in found]
    return pa.table(table)


def _column(values: Any, count: int) -> pa.Array:
    """The first values of a column; null for NaN and infinities."""
    found = pa.array(values[:count]) if not isinstance(values, pa.Array) else values[:count]
    if found.type != pa.float64():
        return found
    numbers = found.to_numpy(zero_copy_only=False)
    return pa.array(numbers, mask=~np.isfinite(numbers))
