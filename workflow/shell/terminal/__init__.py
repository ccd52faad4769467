"""Output to the terminal, and signals that end a run."""
