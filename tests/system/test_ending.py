"""Signals that end a job or a terminal: a command leaves no temporary file, and ends as by the signal itself."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(os.name != "posix", reason="sends signals")
ROOT = Path(__file__).parents[2]

# A command that is writing a file when the signal comes. It sleeps in short steps: Python would see a signal that comes
# just before a sleep at its end.
SCRIPT = """
import sys, time
from renderer.system.files import write_atomically
from renderer.system.interrupt import interruptible

@interruptible("interrupted")
def main(arguments=None):
    def write(file):
        file.write(b"half")
        file.flush()
        print("writing", flush=True)
        for _ in range(600): time.sleep(0.1)
    write_atomically("out.bin", write)
    return 0

sys.exit(main())
"""


def started(folder: Path, before: str = "", script: str = SCRIPT) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-c", before + script], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        # A job in the background may have had them ignored.
        preexec_fn=lambda: [signal.signal(number, signal.SIG_DFL) for number in (signal.SIGTERM, signal.SIGHUP)],
    )  # fmt: skip


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_no_temporary_file_stays(tmp_path, number):
    with started(tmp_path) as running:
        assert running.stdout.readline() == "writing\n"
        assert len(list(tmp_path.iterdir())) == 1
        running.send_signal(number)
        assert running.wait(timeout=30) == -number
        assert running.stderr.read() == ""
    assert list(tmp_path.iterdir()) == []


def test_a_command_that_takes_it_for_ctrl_c_and_ends_well_ends_by_the_signal_too(tmp_path):
    """As view does, for whom Ctrl-C is the usual way to end."""
    wait = "        for _ in range(600): time.sleep(0.1)\n"
    script = SCRIPT.replace(wait, f"        try:\n    {wait}        except KeyboardInterrupt: pass\n")
    with started(tmp_path, script=script) as running:
        assert running.stdout.readline() == "writing\n"
        running.send_signal(signal.SIGTERM)
        assert running.wait(timeout=30) == -signal.SIGTERM


def test_an_ignored_signal_stays_ignored(tmp_path):
    """As nohup asks for."""
    with started(tmp_path, "import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN)\n") as running:
        assert running.stdout.readline() == "writing\n"
        running.send_signal(signal.SIGHUP)
        time.sleep(0.2)
        assert running.poll() is None
        running.send_signal(signal.SIGTERM)
        assert running.wait(timeout=30) == -signal.SIGTERM
