"""Automaton to SQL: distinct words are classified, never rows.

The forward automaton is folded over the ``words`` tree from the camera's root, the backward automaton (whose states are sets of
forward states) from the emitters over the light walks' words; a path is matched where its camera word's state is in its
light word's set. Each ``WITH`` item of the text is one of these steps.
"""

from dataclasses import dataclass

import numpy as np

from queries.lpe.alphabet import CAMERA, Alphabet
from queries.lpe.dfa import Backward, Dfa, alive
from queries.lpe.nfa import bits
from queries.lpe.syntax import Step, Test
from renderer.tables import CAMERA_ROOT, LIGHT_ROOT

_COLUMNS = {"type": "type", "scattering": "coalesce(scattering, 'x')"}


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
    items = [
        ("symbols(signature, symbol)", _values([(f"'{s}'", i) for i, s in enumerate(automata.alphabet.signatures)])),
        ("steps AS MATERIALIZED", _letters(automata.alphabet)),
        ("forward(state, symbol, next)", _rows(_forward_ways(automata))),
        ("camera(word, state)", _fold_camera(camera)),
        ("last(symbol, state)", _values(list(enumerate(automata.backward.after)))),
        ("emission(emitter, state)", _emission(automata.alphabet)),
    ]
    items.append(("matched(state, suffix)", _values(accepting)))
    items.append(("accepted AS MATERIALIZED", "SELECT word, suffix FROM camera JOIN matched USING (state)"))
    joins, suffix = ["emission AS e ON e.emitter = p.emitter"], "e.state"
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
    labels = "[objects.name, objects.material, events.lobe]"
    pairs = f"SELECT event, object, type, scattering, {_label_list(alphabet, labels)} FROM (SELECT DISTINCT event, object FROM words) \
JOIN events ON events.key = event LEFT JOIN objects USING (object)"
    letters = f"SELECT event, object, {_signature(alphabet)} AS signature FROM ({pairs})"
    return f"SELECT word, parent, symbol FROM words JOIN ({letters}) USING (event, object) JOIN symbols USING (signature)"


def _emission(alphabet: Alphabet) -> str:
    """Every emitter with the backward state of its symbol."""
    labels = "[emitters.name, objects.name, objects.material]"
    rows = f"SELECT emitter, emitters.symbol AS type, NULL AS scattering, {_label_list(alphabet, labels)} \
FROM emitters LEFT JOIN objects USING (object)"
    signed = f"SELECT emitter, {_signature(alphabet)} AS signature FROM ({rows})"
    return f"SELECT emitter, state FROM ({signed}) JOIN symbols USING (signature) JOIN last USING (symbol)"


def _label_list(alphabet: Alphabet, labels: str) -> str:
    """The labels of an event, where the expression asks for labels at all."""
    used = any(test.field == "label" for step in alphabet.steps for test in step.tests)
    return f"list_filter({labels}, lambda name: name <> '') AS labels" if used else "NULL AS labels"


def _signature(alphabet: Alphabet) -> str:
    return " || ".join(f"CASE WHEN {_condition(step)} THEN '1' ELSE '0' END" for step in alphabet.steps)


def _condition(step: Step) -> str:
    return " AND ".join(_test(test) for test in step.tests) or "true"


def _test(test: Test) -> str:
    names = ", ".join(quote(name) for name in sorted(test.names))
    if test.field != "label":
        return f"{_COLUMNS[test.field]} {'IN' if test.mode == 'in' else 'NOT IN'} ({names})"
    carries = f"list_has_any(labels, [{names}])" if names else "false"
    if test.mode == "in":
        return carries
    return f"NOT {carries}" + (" AND len(labels) > 0" if test.mode == "other" else "")


def quote(text: str) -> str:
    """A string literal."""
    return "'" + text.replace("'", "''") + "'"


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
