"""The renderer: scene -> tables. It knows nothing of jobs, of DuckDB or of pictures."""
