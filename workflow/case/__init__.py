"""Engine of cases: reads YAML with units into a frozen model in base units, or explains errors."""
