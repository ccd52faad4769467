"""Checks of a finished wear run, which lead to warnings."""
