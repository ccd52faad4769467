"""Sweeps: many runs of one case, each with other values (``fretscale sweep``)."""

from workflow.sweep.running import run_sweep

__all__ = ["run_sweep"]
