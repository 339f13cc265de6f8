"""Syntax tree to plain words, for people who do not read the notation."""

from queries.lpe.syntax import Chain, Choice, Node, Repeat, Step, Test

_TYPES = {
    "C": "the camera",
    "R": "reflection",
    "T": "transmission",
    "V": "volume scattering",
    "L": "a light",
    "O": "a glowing object",
    "B": "the background",
}
_SCATTERING = {"D": "diffuse", "G": "glossy", "S": "specular", "s": "straight", "x": "unscattered"}
_OPERATORS = {"&": "and also", "-": "but not", "^": "or, but not both,"}


def describe(node: Node) -> str:
    """The expression in words.

    >>> from queries.lpe.parser import parse
    >>> describe(parse("C<RD><TS>{2}L").tree)
    'the camera, then diffuse reflection, then specular transmission 2 times, then a light'
    """
    if isinstance(node, Step):
        return describe_step(node)
    if isinstance(node, Chain):
        return ", then ".join(_bracketed(part) for part in node.parts)
    if isinstance(node, Choice):
        return " or ".join(_bracketed(part) for part in node.parts)
    if isinstance(node, Repeat):
        return f"{_bracketed(node.part)} {_times(node.low, node.high)}"
    shown = [_bracketed(node.first)]
    for operator, operand in node.rest:
        shown.append(f"{_OPERATORS[operator]} {_bracketed(operand)}")
    return " ".join(shown)


def _bracketed(node: Node) -> str:
    return describe(node) if isinstance(node, (Step, Repeat)) else f"({describe(node)})"


def _times(low: int, high: int | None) -> str:
    if (low, high) == (0, 1):
        return "at most once"
    if high is None:
        return "any number of times" if low == 0 else "once or more" if low == 1 else f"{low} times or more"
    return f"{low} times" if low == high else f"{low} to {high} times"


def describe_step(step: Step) -> str:
    """One event in words."""
    types = [test for test in step.tests if test.field == "type"]
    scatterings = [test for test in step.tests if test.field == "scattering"]
    labels = [test for test in step.tests if test.field == "label"]
    noun = " and ".join(_listed(test, _TYPES) for test in types)
    adjective = " and ".join(_listed(test, _SCATTERING) for test in scatterings)
    words = [word for word in (adjective, noun or ("scattering" if adjective else "any event")) if word]
    if labels:
        words.append(" ".join(_label(test) for test in labels))
    return " ".join(words)


def _listed(test: Test, words: dict[str, str]) -> str:
    listed = " or ".join(words.get(name, f"no such event ({name})") for name in sorted(test.names))
    return f"anything but {listed}" if test.mode == "other" else listed


def _label(test: Test) -> str:
    names = " or ".join(sorted(test.names))
    if test.mode == "in":
        return f"at {names}"
    if test.mode == "without":
        return f"not at {names}"
    return f"at something named but not {names}" if names else "at something named"
