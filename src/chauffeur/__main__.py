"""`python -m chauffeur`: the `chauffeur` command of the interpreter that runs it."""

from chauffeur.cli.main import run

if __name__ == "__main__":
    run()
