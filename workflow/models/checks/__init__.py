"""Checks of models: names, limits on the length of runs, states to resume from, and warnings."""
