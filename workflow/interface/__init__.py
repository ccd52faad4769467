"""Python interface of fretscale: cases from files and dictionaries, runs, and their results.

The package ``fretscale`` in ``workflow/facade`` only re-exports these names.
"""
