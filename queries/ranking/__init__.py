"""Smart selection (thesis 9.4.2): which classes of paths make up what is seen in a region, and which are special to it."""

from queries.ranking.rank import rank

__all__ = ["rank"]
