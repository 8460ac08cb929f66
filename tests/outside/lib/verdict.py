"""How an outside program ends: a line for each thing that holds, one sentence for the first that does not."""

import sys
from pathlib import Path


def fail(sentence):
    """Ends the program with exit code 1 and this sentence."""
    sys.exit(f"{Path(sys.argv[0]).stem}: {sentence}")


def require(condition, sentence):
    """Fails with the sentence unless the condition holds."""
    if not condition:
        fail(sentence)


def leave_out(what):
    """Says what cannot be judged on this machine, and why."""
    print(f"LEFT OUT: {what}", file=sys.stderr, flush=True)


class Tally:
    """Counts what held."""

    def __init__(self):
        self.passed = 0

    def ok(self, sentence):
        self.passed += 1
        print(f"ok: {sentence}", flush=True)

    def end(self):
        print(f"\n{self.passed} passed, 0 failed")
