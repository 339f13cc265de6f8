"""Light path expressions: regular expressions over the events of light paths, compiled to automata and to SQL.

The modules, in the order that a text travels through them (``compile`` leads it):

- the text: ``limits`` (bounds on all work), ``dialects`` (which notation), ``prefixes`` (``unoccluded;`` …)
- to tokens and a tree: ``tokens``, ``parser``, ``predicates`` (after ``@``) of the standard notation; ``osl``; ``thesis_tokens``, ``thesis``;
  ``names`` (which exist); ``syntax`` (the tree, what its tests mean for a ``PathEvent``); ``direction`` (light first to camera first)
- to automata: ``minterms``, ``alphabet`` (events to symbols), ``nfa``, ``dfa``, ``depth`` (tests of depth), ``automaton`` (all of it together);
  ``events`` (what callers write for a path, to be accepted or not)
- to SQL: ``conditions`` (tests of events), ``sql`` (the query text)
- back to text: ``printer``, ``osl_printer``, ``thesis_printer``
- to words and back: ``describe`` (any expression, event by event), ``effects`` (the table of common effects), ``shapes`` (trees to effects),
  ``phrases`` (effects to phrases); classes of paths: ``class_words``, ``descriptors``
"""

from queries.lpe.compile import Expression, compile

__all__ = ["Expression", "compile"]
