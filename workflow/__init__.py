"""Reads cases, runs them through the other packages, writes and draws the results."""
