"""The tools that draw light: one file for each, named as in `views` of a job."""
