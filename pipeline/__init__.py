"""What runs when: jobs, run folders, stages, the command line."""
