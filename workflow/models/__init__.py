"""Models of structures, contacts and wear: what a case describes, built and run from Python.

Models are plain frozen dataclasses with numpy in them. They know :mod:`fe_models`, :mod:`wear` and
:mod:`sa_solver`, and nothing of case files, folders, caches, printing or plots.
"""
