"""Infrastructure shared by all runs: folder, reporter, results, memory, cache and processes."""
