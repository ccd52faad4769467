"""``python -m fretscale``: the command, whose packages ``fretscale`` has looked for."""

import sys

try:
    from workflow.cli import main
except KeyboardInterrupt:  # before there is anything that could say so in its own words
    sys.exit(130)

if __name__ == "__main__":
    main()
