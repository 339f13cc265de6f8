"""How many random examples a property is tried with: all of them by `make test-slow`, the first third by `make test`."""

import os

from hypothesis import HealthCheck, settings

ALL = bool(os.environ.get("PATHSPACE_ALL_EXAMPLES"))


def examples(count: int, *suppressed: HealthCheck) -> settings:
    """Settings under which each test tries the same examples every time, without a deadline."""
    suppressed = (HealthCheck.too_slow, *suppressed)
    return settings(max_examples=count if ALL else count // 3, derandomize=True, deadline=None, suppress_health_check=suppressed)
