"""Commands and Python interface: the only package that reads cases, writes files and prints.

- ``cli``: the commands; ``interface``: the same from Python, which ``facade`` exports under the
  name ``fretscale``; ``kinds``: the list of analyses;
- ``analyses``: a folder for each analysis: ``contact``, ``wear``, ``specimens``, ``time``,
  ``vibration``, ``vibration_wear``; ``rig`` is shared by the vibrating ones;
- ``runs``: running one case or many, and checking them; ``chart``: error against cost;
  ``sweep``: a case with many values; ``commands``: files that are not cases;
- ``case``: the engine that reads and writes cases; ``shell``: common parts of all runs, such as
  folder, reporter and results; ``pictures``: helpers for figures and ParaView files.

Imports go in this order only: ``cli`` and ``interface``, then ``chart``, ``sweep`` and
``commands``, ``runs``, ``kinds``, ``analyses``, ``pictures``, ``shell``, ``case``, ``errors``.
"""
