"""What ``import fretscale`` offers: cases from files and dictionaries, runs, and their results.

The package of that name, in ``workflow/facade``, only hands on what is here.
"""
