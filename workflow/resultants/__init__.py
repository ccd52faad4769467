"""Loads of a contact as files: from another FE code in, and worn surfaces back to its nodes.

Columns, units, signs and how to get them out of Abaqus and Ansys: ``RECIPE.md`` beside this file.
"""
