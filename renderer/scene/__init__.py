"""Scenes: a Mitsuba 3 description (XML or YAML) compiled into the arrays that kernels read."""
