"""One YAML value from a command line, bounded: no aliases, no repeated keys, nothing long or deep."""

import re
from typing import Any, cast

import yaml

from queries.errors import QueryError

_MOST_CHARACTERS = 500_000
_FLOAT = re.compile(r"^[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$")


class _Loader(yaml.SafeLoader):
    """YAML's safe subset, with numbers such as ``1e-3`` as everybody means them, and keys that are given once."""

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """A node; aliases, which could stand for very much, are errors."""
        if self.check_event(yaml.AliasEvent):
            raise yaml.composer.ComposerError(None, None, "found an alias, expected plain values", self._mark())
        node: yaml.Node | None = super().compose_node(parent, index)
        return node

    def _mark(self) -> yaml.Mark:
        """Where the reader stands."""
        return cast(yaml.Mark, cast(Any, self).peek_event().start_mark)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """A mapping; a key that is given twice is an error."""
        keys = [key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode)]
        for key in keys:
            if keys.count(key) > 1:
                raise yaml.constructor.ConstructorError(None, None, f"the key `{key}` is given twice", node.start_mark)
        return super().construct_mapping(node, deep)


_Loader.yaml_implicit_resolvers = {first: list(known) for first, known in yaml.SafeLoader.yaml_implicit_resolvers.items()}
_Loader.add_implicit_resolver("tag:yaml.org,2002:float", _FLOAT, list("-+.0123456789"))


def read_yaml(text: str) -> Any:
    """The value of a short YAML text. Raises QueryError."""
    if len(text) > _MOST_CHARACTERS:
        raise QueryError(f"expected at most {_MOST_CHARACTERS:,} characters, found {len(text):,}")
    try:
        return yaml.load(text, Loader=_Loader)  # a SafeLoader
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f" at column {mark.column + 1}" if mark else ""
        raise QueryError(f"not valid YAML{place}: {error.problem or error.context}") from None
    except yaml.YAMLError as error:
        raise QueryError(f"not valid YAML: {getattr(error, 'reason', error)}") from None
    except RecursionError:
        raise QueryError("not valid YAML: nested too deeply") from None
    except (ValueError, OverflowError) as error:
        raise QueryError(f"a value cannot be read: {error}") from None
