"""Analyses of the workflow, one folder each; ``rig`` is shared by those with vibration."""
