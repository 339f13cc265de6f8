"""Whether two trees select the same paths: an oracle for notations and phrases that spell one expression differently."""

from queries.lpe.automaton import automaton, matches_some_path
from queries.lpe.direction import camera_first
from queries.lpe.limits import Work
from queries.lpe.parser import parse
from queries.lpe.syntax import Combination, Node

_PATHS = parse("C X* [LOB]").tree


def differ(a: Node, b: Node) -> bool:
    """Whether some path (a camera, interactions, a light) matches one tree and not the other. Light-first trees are turned round."""
    work = Work()
    either = Combination(camera_first(a, work), (("^", camera_first(b, work)),))
    machine = automaton(Combination(either, (("&", _PATHS),)), work)
    return matches_some_path(machine.dfa, machine.alphabet)


def same_paths(a: Node, b: Node) -> bool:
    """Whether two trees match the same paths, and some."""
    work = Work()
    machine = automaton(camera_first(a, work), work)
    return matches_some_path(machine.dfa, machine.alphabet) and not differ(a, b)
