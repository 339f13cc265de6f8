"""Automaton to SQL: distinct words are classified, never rows.

The forward automaton is folded over the ``words`` tree from the camera's root, the backward automaton (whose states are sets of
forward states) from the emitters over the light walks' words; a path is matched where its camera word's state is in its
light word's set. Each ``WITH`` item of the text is one of these steps.
"""

from dataclasses import dataclass

import numpy as np

from queries.lpe.alphabet import CAMERA, Alphabet
from queries.lpe.conditions import OF_EMISSION, OF_INTERACTIONS, ROW_COLUMNS, signature
from queries.lpe.dfa import Backward, Dfa, alive
from queries.lpe.nfa import bits
from renderer.tables import CAMERA_ROOT, LIGHT_ROOT, OCCLUDED

_BLOCKER = "blocker"


@dataclass(frozen=True)
class Automata:
    """What the SQL of one expression is made of."""

    alphabet: Alphabet
    forward: Dfa
    backward: Backward


def select(automata: Automata, table: str, columns: str) -> str:
    """The query for the rows of ``table`` (paths or occluded) that the expression matches."""
    camera, accepting = _camera_states(automata)
    if not accepting:
        return f"SELECT {columns} FROM {table} AS p WHERE false"
    columns_of_row = _row_columns(automata.alphabet, table)
    items = [
        ("symbols(signature, symbol)", _values([(f"'{s}'", i) for i, s in enumerate(automata.alphabet.signatures)])),
        ("steps AS MATERIALIZED", _letters(automata.alphabet)),
        ("forward(state, symbol, next)", _rows(_forward_ways(automata))),
        ("camera(word, state)", _fold_camera(camera)),
        ("last(symbol, state)", _values(list(enumerate(automata.backward.after)))),
        (f"emission({', '.join(['emitter', *columns_of_row, 'state'])})", _emission(automata.alphabet, table, columns_of_row)),
    ]
    items.append(("matched(state, suffix)", _values(accepting)))
    items.append(("accepted AS MATERIALIZED", "SELECT word, suffix FROM camera JOIN matched USING (state)"))
    # Columns that a run does not store are NULL.
    joins = ["emission AS e ON e.emitter = p.emitter" + "".join(f" AND e.{name} IS NOT DISTINCT FROM p.{name}" for name in columns_of_row)]
    suffix = "e.state"
    if automata.backward.transitions.size:
        items.append(("backward(state, symbol, next)", _rows(_backward_ways(automata))))
        items.append(("light(start, word, state)", _fold_light()))
        joins.append(f"light AS l ON l.start = e.state AND l.word = coalesce(p.light_word, {LIGHT_ROOT})")
        suffix = "l.state"
    # Every path finds one row at most: a plain join, which DuckDB runs twice as fast as a semi-join on 64-bit words.
    joins.append(f"accepted AS a ON a.word = coalesce(p.camera_word, {CAMERA_ROOT}) AND a.suffix = {suffix}")
    with_items = ",\n".join(f"{name if name.endswith('MATERIALIZED') else name + ' AS'} ({body})" for name, body in items)
    return f"WITH RECURSIVE {with_items}\nSELECT {columns} FROM {table} AS p\nJOIN " + "\nJOIN ".join(joins)


def _values(rows: list[tuple[object, ...]]) -> str:
    return "VALUES " + ", ".join(f"({', '.join(map(str, row))})" for row in rows)


def _rows(rows: list[tuple[object, ...]]) -> str:
    """VALUES of three integers, of which there may be none."""
    return _values(rows) if rows else "SELECT 0, 0, 0 WHERE false"


# --- events to symbols --------------------------------------------------------------------------------------------


def _letters(alphabet: Alphabet) -> str:
    """Every word with the symbol of its last event: found once for each pair of event and object."""
    signed = f"SELECT pairs.event, pairs.object, {signature(alphabet.steps, OF_INTERACTIONS)} AS signature \
FROM (SELECT DISTINCT event, object FROM words) AS pairs JOIN events ON events.key = pairs.event LEFT JOIN objects ON objects.object = pairs.object"
    return f"SELECT word, parent, symbol FROM words JOIN ({signed}) USING (event, object) JOIN symbols USING (signature)"


def _row_columns(alphabet: Alphabet, table: str) -> list[str]:
    """The columns of a path's row, beside its emitter, that the symbol of its last event depends on."""
    used = {column for step in alphabet.steps for test in step.tests for column in ROW_COLUMNS.get(test.field, ())}
    return sorted(used if table == OCCLUDED.name else used - {_BLOCKER})


def _emission(alphabet: Alphabet, table: str, columns: list[str]) -> str:
    """Every emitter, with each combination of the row's columns that matter, and the backward state of its symbol."""
    known = {field: value for field, value in OF_EMISSION.items() if field != _BLOCKER or _BLOCKER in columns}
    ends = "emitters"
    if columns:
        ends = f"(SELECT DISTINCT emitter, {', '.join(columns)} FROM {table}) AS p JOIN emitters ON emitters.emitter = p.emitter"
    keys = "".join(f", p.{column}" for column in columns)
    listed = "".join(f", {column}" for column in columns)
    blockers = " LEFT JOIN objects AS blockers ON blockers.object = p.blocker" if _BLOCKER in columns else ""
    signed = f"SELECT emitters.emitter{keys}, {signature(alphabet.steps, known)} AS signature \
FROM {ends} LEFT JOIN objects ON objects.object = emitters.object{blockers}"
    return f"SELECT emitter{listed}, state FROM ({signed}) JOIN symbols USING (signature) JOIN last USING (symbol)"


# --- folds --------------------------------------------------------------------------------------------------------


def _camera_states(automata: Automata) -> tuple[int, list[tuple[object, ...]]]:
    """The forward state after the camera, and the pairs (forward state, backward state) of matched paths."""
    camera = int(automata.forward.transitions[0, automata.alphabet.symbol(CAMERA)])
    pairs: list[tuple[object, ...]] = [(state, suffix) for suffix, states in enumerate(automata.backward.sets) for state in bits(states)]
    return camera, pairs


def _forward_ways(automata: Automata) -> list[tuple[object, ...]]:
    """Transitions between states from which something can still be matched."""
    living = alive(automata.forward)
    ways = automata.forward.transitions
    states, symbols = np.nonzero(living[:, None] & living[ways])
    return list(zip(states.tolist(), symbols.tolist(), ways[states, symbols].tolist()))


def _backward_ways(automata: Automata) -> list[tuple[object, ...]]:
    """Transitions between sets that are not empty."""
    living = np.array([bool(states) for states in automata.backward.sets])
    ways = automata.backward.transitions
    states, symbols = np.nonzero(living[:, None] & living[ways])
    return list(zip(states.tolist(), symbols.tolist(), ways[states, symbols].tolist()))


def _fold_camera(start: int) -> str:
    return (
        f"SELECT {CAMERA_ROOT}::UBIGINT, {start} UNION ALL SELECT s.word, f.next FROM camera AS c JOIN steps AS s ON s.parent = c.word "
        "JOIN forward AS f ON f.state = c.state AND f.symbol = s.symbol"
    )


def _fold_light() -> str:
    return (
        f"SELECT DISTINCT state, {LIGHT_ROOT}::UBIGINT, state FROM emission UNION ALL SELECT l.start, s.word, b.next FROM light AS l "
        "JOIN steps AS s ON s.parent = l.word JOIN backward AS b ON b.state = l.state AND b.symbol = s.symbol"
    )
