"""The engine of cases: YAML with units in, a frozen model in base units out, or why not."""
