"""Results of a wear run: its outcome, numbers, tables and files."""
