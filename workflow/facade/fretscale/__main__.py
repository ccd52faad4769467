"""``python -m fretscale``: the command, whose packages ``fretscale`` has looked for."""

from workflow.cli import main

if __name__ == "__main__":
    main()
