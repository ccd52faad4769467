"""Runs of cases: single, many side by side or on a cluster, and their verification."""
