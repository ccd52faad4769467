"""Results of a vibration run: its motions, numbers, tables and files."""
