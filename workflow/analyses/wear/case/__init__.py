"""Sections and base classes of wear cases, whatever the source of their loads."""
