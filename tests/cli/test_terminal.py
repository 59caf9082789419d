"""How robocal behaves as a guest in somebody's terminal: quick, quiet, stoppable, and at home in pipes."""

from __future__ import annotations

import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from cli.runs import Ran, files, finished, process, robocal

SLOW = """
import sys, time
import robocal.prove.identify as job
from robocal.cli.main import main
found = job.identify
def slow(chain, data, options, watch=None):
    for i in range(400):
        watch({"stage": "round", "done": i, "total": 400})
        time.sleep(0.05)
    return found(chain, data, options, watch)
job.identify = slow
print("ready", flush=True)
sys.exit(main(sys.argv[1:]))
"""

QUICK = """
import sys
import robocal.cli.terminal as terminal
from robocal.cli.main import main
terminal.PATIENCE = 1e9
sys.exit(main(sys.argv[1:]))
"""


def test_help_is_cheap() -> None:
    # What must not be imported for help; seconds are measured by hand, they belong to a machine and not to a test.
    code = "import sys; from robocal.cli.main import main; main(['--help']); print([*sys.modules], file=sys.stderr)"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(re.findall(r"'(\w+)'", ran.stderr))
    assert not loaded & {"numpy", "scipy", "numba", "pydantic", "rich", "ruamel"}
    assert "identify" in ran.stdout


def test_version_and_no_arguments() -> None:
    from robocal import __version__

    assert finished(process("--version")).out == f"robocal {__version__}\n"
    nothing = finished(process())
    assert nothing.status == 2 and "identify" in nothing.out


@pytest.mark.sampled(1)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_stopping_in_the_middle_leaves_nothing(case: Path, number: signal.Signals) -> None:
    (case / "slow.py").write_text(SLOW, encoding="utf-8")
    before = files(case)
    started = subprocess.Popen(
        [sys.executable, "slow.py", "identify", "robot.yaml", "data.yaml", "-o", "run"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert started.stdout is not None and started.stdout.readline() == "ready\n"
    time.sleep(1.5)
    started.send_signal(number)
    ran = finished(started)
    assert ran.status == 128 + number, ran.err
    assert "Traceback" not in ran.err and "stopped" in ran.err
    assert files(case) == before and not (case / "run").exists()


@pytest.mark.slow
def test_the_suite_can_be_stopped_whoever_started_it() -> None:
    """Started with Ctrl-C ignored (`trap '' INT`, a background job of a script), tests still stop their children."""
    code = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN); import pytest, sys; sys.exit(pytest.main(sys.argv[1:]))"
    those = (
        f"{__file__}::test_stopping_in_the_middle_leaves_nothing",
        f"{__file__}::test_a_swallowed_interrupt_still_stops",
    )
    command = [sys.executable, "-c", code, "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *those]
    ran = subprocess.run(command, capture_output=True, text=True, check=False, cwd=Path(__file__).parents[2])
    assert ran.returncode == 0 and "3 passed" in ran.stdout, ran.stdout


def test_ignoring_ctrl_c_is_inherited_and_sigterm_still_stops(case: Path) -> None:
    """What `nohup` and a script's background jobs ask for: Ctrl-C goes to somebody else."""
    (case / "slow.py").write_text(SLOW, encoding="utf-8")
    command = f"trap '' INT; exec {sys.executable} slow.py identify robot.yaml data.yaml -o run"
    started = subprocess.Popen(["sh", "-c", command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert started.stdout is not None and started.stdout.readline() == "ready\n"
    time.sleep(1.0)
    started.send_signal(signal.SIGINT)
    time.sleep(0.5)
    assert started.poll() is None
    started.send_signal(signal.SIGTERM)
    ran = finished(started)
    assert ran.status == 128 + signal.SIGTERM and not (case / "run").exists()


def test_stopping_while_it_still_starts(case: Path) -> None:
    for delay in (0.02, 0.1, 0.25, 0.45):
        started = process("identify", "robot.yaml", "data.yaml", "-o", "run")
        time.sleep(delay)
        started.send_signal(signal.SIGINT)
        ran = finished(started)
        # Before Python runs our first line, it is Python that is stopped.
        assert ran.status in (130, -signal.SIGINT, 0, 1), (delay, ran)
        if ran.status == 130:
            assert "Traceback" not in ran.err, (delay, ran.err)


def test_a_swallowed_interrupt_still_stops(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import robocal.prove.identify as job

    found = job.identify

    def solve(chain, data, options, watch=None):
        # As in a callback of compiled code, where Python prints exceptions and goes on.
        try:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.2)
        except KeyboardInterrupt:
            pass
        return found(chain, data, options, watch)

    monkeypatch.setattr(job, "identify", solve)
    ran = robocal("identify", "robot.yaml", "data.yaml", "-o", "run")
    assert ran.status == 130 and not (case / "run").exists()


def test_a_reader_that_goes_away(case: Path) -> None:
    command = (
        f"{sys.executable} -m robocal.cli identify robot.yaml data.yaml --json | head -c 20; exit ${{PIPESTATUS[0]}}"
    )
    ended = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    ran = Ran(ended.returncode, ended.stdout, ended.stderr)
    assert ran.status in (0, 141) and ran.remarks == "" and len(ran.out) == 20


def test_a_reader_of_tables_that_has_gone() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "robocal.cli", "new", "--list"]
    ran = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writer)
    assert (ran.returncode, ran.stderr) == (141, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_terminal(case: Path) -> None:
    with open("/dev/full", "w") as full:
        ran = finished(process("identify", "robot.yaml", "data.yaml", "--json", stdout=full))
    assert ran.status == 2 and "no space left" in ran.err and "Traceback" not in ran.err


@pytest.mark.sampled(1)
@pytest.mark.parametrize("home", ["/proc/nowhere", "/dev/null"])
def test_no_home_for_the_kernel_cache(case: Path, home: str) -> None:
    # Nothing compiles here but what this small job needs, so it is slow but works.
    nowhere = {
        "HOME": home,
        "XDG_CACHE_HOME": home,
        "ROBOCAL_CACHE_DIR": home,
        "TMPDIR": home,
        "NUMBA_DISABLE_JIT": "1",
    }
    ran = finished(process("check", "robot.yaml", "data.yaml", env=nowhere))
    assert ran.status == 0 and "three axes" in ran.out, ran.err


def test_json_with_warnings_keeps_them_apart(case: Path) -> None:
    text = (case / "robot.yaml").read_text(encoding="utf-8").replace("[-150, 150]", "[-40, 40]")
    (case / "robot.yaml").write_text(text, encoding="utf-8")
    ran = robocal("identify", "robot.yaml", "data.yaml", "--json")
    assert ran.document["warnings"] and "warning: " in ran.err and "outside its limits" in ran.err


def test_no_escape_sequences_without_a_terminal(case: Path) -> None:
    ran = finished(process("identify", "robot.yaml", "data.yaml"))
    assert "\033" not in ran.out + ran.err and "Written to" not in ran.out


@pytest.mark.sampled(1)
@pytest.mark.parametrize("width", [40, 80, 120])
def test_every_width(case: Path, width: int) -> None:
    for more in ((), ("--verbose",)):
        ran = finished(process("identify", "robot.yaml", "data.yaml", *more, env={"COLUMNS": str(width)}))
        assert ran.status == 0 and max(len(line) for line in ran.out.splitlines()) <= width
        assert "IMPROVED" in ran.out and "j3.d" in ran.out


@pytest.mark.slow
def test_an_ascii_terminal(case: Path) -> None:
    ran = finished(
        process(
            "identify", "robot.yaml", "data.yaml", env={"PYTHONIOENCODING": "ascii", "LC_ALL": "C", "PYTHONUTF8": "0"}
        )
    )
    assert ran.status == 0 and "IMPROVED" in ran.out and ran.out.isascii()


def in_a_terminal(*arguments: str, environment: dict[str, str] | None = None) -> tuple[int, str]:
    """A command with a real terminal as stdin, stdout and stderr; its status and everything that appeared."""
    ours, theirs = pty.openpty()
    started = subprocess.Popen(
        [sys.executable, *arguments],
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env={**os.environ, "TERM": "xterm-256color", **(environment or {})},
    )
    os.close(theirs)
    seen = b""
    while True:
        ready, _, _ = select.select([ours], [], [], 30)
        try:
            piece = os.read(ours, 65536) if ready else b""
        except OSError:
            piece = b""
        if not piece:
            break
        seen += piece
    os.close(ours)
    return started.wait(timeout=30), seen.decode("utf-8", "replace")


@pytest.mark.slow
def test_a_bar_appears_after_two_seconds(case: Path) -> None:
    (case / "slow.py").write_text(
        SLOW.replace("range(400)", "range(60)").replace('"total": 400', '"total": 60'), encoding="utf-8"
    )
    status, seen = in_a_terminal("slow.py", "identify", "robot.yaml", "data.yaml")
    assert status == 0 and "fitting" in seen and "\033[" in seen and "IMPROVED" in seen
    # On a busy machine a quick verb may take two seconds as well: here they never end.
    (case / "quick.py").write_text(QUICK, encoding="utf-8")
    quick_status, quick = in_a_terminal("quick.py", "check", "robot.yaml", "data.yaml", environment={"NO_COLOR": "1"})
    assert quick_status == 0 and "finding" not in quick and "\033[1;3" not in quick


def test_compiling_is_said_once(capsys: pytest.CaptureFixture[str]) -> None:
    from robocal.cli.terminal import Terminal
    from robocal.progress import tell_of_compilation

    with Terminal().watching():
        for _ in range(2):
            tell_of_compilation("geometry.add_step")
    tell_of_compilation("geometry.add_step")
    assert capsys.readouterr().err.count("compiling kernels") == 1


def test_a_fault_of_ours_is_one_line(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import robocal.prove.identify as job

    def broken(*_: object, **__: object) -> None:
        raise RuntimeError("the second law\nwas broken")

    monkeypatch.setattr(job, "identify", broken)
    ran = robocal("identify", "robot.yaml", "data.yaml")
    assert (
        ran.status == 1
        and "RuntimeError: the second law" in ran.err
        and "Traceback" not in ran.err
        and "report" in ran.err
    )
    with pytest.raises(RuntimeError):
        robocal("identify", "robot.yaml", "data.yaml", "--debug")


def test_help_of_every_verb_names_its_options() -> None:
    for verb in ("demo", "new", "check", "identify", "validate", "export", "simulate", "report"):
        ran = robocal(verb, "--help")
        assert ran.status == 0 and "--json" in ran.out, verb


def test_documents_of_every_verb_are_json(case: Path) -> None:
    robocal("identify", "robot.yaml", "data.yaml", "-o", "run")
    for words in (
        "new ur10 -o a", "check robot.yaml data.yaml", "check ur10", "identify robot.yaml data.yaml", "validate robot.yaml data.yaml",
        "export run --format csv", "simulate ur10 -o b -n 10", "report run", "new --list",
    ):  # fmt: skip
        ran = robocal(*words.split(), "--json")
        assert json.loads(ran.out), words
