"""Readers of the files that a case names: tables, scans and records of loops."""
