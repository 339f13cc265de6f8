"""Words of paths as short text, and the plainest matcher of expressions: the oracle of the tests."""

from queries.lpe.syntax import Chain, Choice, Combination, Node, PathEvent, Repeat, Step


def word(text: str) -> tuple[PathEvent, ...]:
    """``C RD:floor:paint L`` as events: type, scattering type, labels."""
    events = []
    for token in text.split():
        letters, *labels = token.split(":")
        events.append(PathEvent(letters[0], letters[1:] or None, tuple(labels)))
    return tuple(events)


def matches(tree: Node, events: tuple[PathEvent, ...]) -> bool:
    """Whether the whole word matches, by trying everything."""
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
