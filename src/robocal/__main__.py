"""python -m robocal."""

from robocal.cli.main import run_command

if __name__ == "__main__":
    run_command()
