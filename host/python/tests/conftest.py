import json
import os
import subprocess

import pytest
import signal

# What runs in the background of a shell is born with interrupts ignored, and Python then leaves them so.
signal.signal(signal.SIGINT, signal.default_int_handler)


class Program:
    """The program itself, in a folder."""

    def __init__(self, folder):
        self.folder = folder

    def run(self, *arguments):
        command = [os.environ["YAWRIG"], *map(str, arguments)]
        return subprocess.run(command, cwd=self.folder, capture_output=True, text=True)

    def json(self, *arguments):
        done = self.run(*arguments, "--json")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)


@pytest.fixture(scope="session")
def program(tmp_path_factory):
    return Program(tmp_path_factory.mktemp("program"))


@pytest.fixture(scope="session")
def csv(program):
    """A record with dry friction in it, of the virtual rig's own integrator."""
    planted = "--natural-frequency 7 --damping 0.006 --seconds 16 --rate-hz 100 --effect coulomb_friction:c=0.15"
    program.json("simulate", *planted.split(), "--out", "r.csv")
    return program.folder / "r.csv"


@pytest.fixture(scope="session")
def campaign(program):
    program.json("simulate", "--campaign", "campaign", "--rate-hz", "100")
    return program.folder / "campaign" / "campaign.toml"


@pytest.fixture(autouse=True)
def _in_its_folder(program, monkeypatch):
    # Messages and results name files as they were given.
    monkeypatch.chdir(program.folder)
