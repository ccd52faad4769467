"""From a case to its results: the only package that reads cases, writes files and prints.

- ``cli``: the commands; ``interface``: the same from Python, as ``facade`` offers it under the name
  ``fretscale``; ``kinds``: the analyses there are;
- ``analyses``: what can be computed, a folder each: ``contact``, ``wear``, ``specimens``, ``time``,
  ``vibration``, ``vibration_wear``; ``rig`` is shared by those that move;
- ``runs``: running a case, many of them, and checking them; ``chart``: error against cost;
  ``sweep``: a case with many values; ``commands``: files that are no cases;
- ``case``: the engine that reads and writes cases; ``shell``: what every run needs, such as its
  folder, reporter and results; ``pictures``: what figures and ParaView files are made with.

Imports go down only: ``cli`` and ``interface``, then ``chart``, ``sweep`` and ``commands``,
``runs``, ``kinds``, ``analyses``, ``pictures``, ``shell``, ``case``, ``errors``.
"""
