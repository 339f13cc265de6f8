"""Words of paths as short text, and the plainest matcher of expressions: the oracle of the tests."""

import functools

from queries.lpe.syntax import NAMED_FIELDS, Chain, Choice, Combination, Node, PathEvent, Repeat, Step


def word(text: str) -> tuple[PathEvent, ...]:
    """``C RD:floor:paint@object:floor@P L`` as events: type, scattering type, labels, and facts (``@P``: region P; ``@`` alone: no fact holds)."""
    events = []
    for token in text.split():
        described, *known = token.split("@")
        letters, *labels = described.split(":")
        pairs = (fact.split(":") if ":" in fact else ["region", fact] for fact in known if fact)
        facts = frozenset((field, name) for field, name in pairs) if known else None
        events.append(PathEvent(letters[0], letters[1:] or None, tuple(labels), facts))
    return tuple(events)


@functools.lru_cache(maxsize=4096)
def dated(events: tuple[PathEvent, ...]) -> tuple[PathEvent, ...]:
    """The events with everything written out as facts: depths, and what labels stand for where nothing else is known."""
    found = []
    for depth, event in enumerate(events):
        facts = event.facts if event.facts is not None else frozenset((field, label) for field in NAMED_FIELDS for label in event.labels)
        if not any(field == "depth" for field, _ in facts):
            facts |= {("depth", str(depth))}
        found.append(event._replace(facts=facts))
    return tuple(found)


def matches(tree: Node, events: tuple[PathEvent, ...]) -> bool:
    """Whether the whole word matches, by trying everything."""
    events = dated(events)
    if isinstance(tree, Combination):
        result = matches(tree.first, events)
        for operator, operand in tree.rest:
            other = matches(operand, events)
            result = {"&": result and other, "-": result and not other, "^": result != other}[operator]
        return result
    if isinstance(tree, Choice):
        return any(matches(part, events) for part in tree.parts)
    return len(events) in _ends(tree, events, 0)


def _ends(tree: Node, events: tuple[PathEvent, ...], start: int) -> set[int]:
    """Where a match that begins at ``start`` may end."""
    if isinstance(tree, Step):
        return {start + 1} if start < len(events) and tree.accepts(events[start]) else set()
    if isinstance(tree, Chain):
        reached = {start}
        for part in tree.parts:
            reached = {end for at in reached for end in _ends(part, events, at)}
        return reached
    if isinstance(tree, Choice):
        return {end for part in tree.parts for end in _ends(part, events, start)}
    assert isinstance(tree, Repeat)
    reached, found = {start}, {start} if tree.low == 0 else set()
    # a part that can be empty may stand still, so low + length rounds reach everything
    rounds = tree.low + len(events) + 1 if tree.high is None else tree.high
    for done in range(1, rounds + 1):
        reached = {end for at in reached for end in _ends(tree.part, events, at)}
        if done >= tree.low:
            found |= reached
        if not reached:
            break
    return found
