"""What runs of all kinds share: folder, reporter, results, memory, cache, processes."""
