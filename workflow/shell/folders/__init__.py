"""Run folders on disk: locks, checkpoints, stored steps and the cache."""
