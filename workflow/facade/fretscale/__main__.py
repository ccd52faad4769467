"""``python -m fretscale``: the command, after ``fretscale`` has checked its packages."""

import sys

try:
    from workflow.cli import main
except KeyboardInterrupt:  # before the command can report an interruption itself
    sys.exit(130)

if __name__ == "__main__":
    main()
