"""Holds yawrig.exe under Wine against the program of this system: checks.py PROGRAM YAWRIG.EXE [NAME]..."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request

OURS, THEIRS, WANTED = sys.argv[1], sys.argv[2], sys.argv[3:]
WINE = os.environ["WINE"]
# Only what hangs takes so long, however busy the machine is.
PATIENCE_S = 900
# Where everything happens: a path as a user's is.
FOLDER = "Messungen Frühjahr, Öl & Co"
RELEASE = "simulate --spring K4 --wind 10 --seed 3 --out".split() + ["Schwingung größer.csv"]


class Place:
    """Two folders with the same files, one for each program."""

    def __init__(self, root):
        self.folders = {}
        for name in ("ours", "theirs"):
            self.folders[name] = os.path.join(root, name, FOLDER)
            os.makedirs(self.folders[name])

    def path(self, whose, *names):
        return os.path.join(self.folders[whose], *names)

    def text(self, whose, *names):
        with open(self.path(whose, *names), encoding="utf-8") as file:
            return file.read()

    def run(self, whose, arguments, exits=0, **more):
        """Runs it to its end; what it printed."""
        ended = subprocess.run(
            command(whose, arguments), cwd=self.folders[whose], capture_output=True, timeout=PATIENCE_S, **more
        )
        out, err = (text.decode().replace("\r\n", "\n") for text in (ended.stdout, ended.stderr))
        if ended.returncode != exits:
            raise AssertionError(f"{whose}: {arguments} ended with {ended.returncode}, not {exits}:\n{out}\n{err}")
        return out, err

    def start(self, whose, arguments):
        """Starts it; the process, and its lines as they come."""
        process = subprocess.Popen(
            command(whose, arguments),
            cwd=self.folders[whose],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
        )
        return process, Lines(process)

    def both(self, arguments, exits=0):
        """What both print, ours and theirs."""
        return [self.run(whose, arguments, exits) for whose in ("ours", "theirs")]


class Lines:
    """What a process says, read by a thread so that nothing waits for ever."""

    def __init__(self, process):
        self.said, self.ended = [], False
        self.changed = threading.Condition()
        threading.Thread(target=self._read, args=(process,), daemon=True).start()

    def _read(self, process):
        for line in process.stdout:
            with self.changed:
                self.said.append(line.rstrip("\r\n"))
                self.changed.notify_all()
        with self.changed:
            self.ended = True
            self.changed.notify_all()

    def wait(self, pattern):
        """The match in the first line that has one."""
        until = time.monotonic() + PATIENCE_S
        with self.changed:
            while True:
                for line in self.said:
                    if found := re.search(pattern, line):
                        return found
                if self.ended or time.monotonic() > until:
                    raise AssertionError(f"it never said {pattern}, but\n" + "\n".join(self.said))
                self.changed.wait(1)


def command(whose, arguments):
    arguments = arguments.split() if isinstance(arguments, str) else arguments
    return ([OURS] if whose == "ours" else [WINE, THEIRS]) + list(arguments)


def same(what, ours, theirs):
    if ours != theirs:
        raise AssertionError(f"{what} differs; here\n{ours}\nunder Wine\n{theirs}")


def leaves(value, path=""):
    """Every number, text and truth of a JSON value with its path."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from leaves(inner, f"{path}.{key}")
    elif isinstance(value, list):
        for k, inner in enumerate(value):
            yield from leaves(inner, f"{path}[{k}]")
    else:
        yield path, value


def alike(what, ours, theirs, digits=9):
    """Two JSON values of the same shape whose numbers agree to so many digits; how far they are apart at most.

    The two systems' own sine and exponential differ in the last bit.
    """
    ours, theirs = dict(leaves(ours)), dict(leaves(theirs))
    same(f"the shape of {what}", sorted(ours), sorted(theirs))
    worst = 0.0
    for path, value in ours.items():
        other = theirs[path]
        if path.endswith("seconds"):
            continue
        if isinstance(value, float) and isinstance(other, (float, int)):
            apart = abs(value - other) / max(abs(value), 1e-300)
            if apart > 10.0**-digits:
                raise AssertionError(f"{what}{path}: {value} here, {other} under Wine")
            worst = max(worst, apart)
        else:
            same(what + path, value, other)
    return worst


def check_demo(place):
    """The main job: its table to the digit, over the emulated device's socket."""
    (ours, _), (theirs, messages) = place.both("demo")
    lines = lambda text, *starts: [line for line in text.splitlines() if line.startswith(starts)]
    table = lambda text: lines(text, " K", "from the device's refined")
    assert len(table(ours)) == 9, ours
    same("the table of the demo", table(ours), table(theirs))
    # By its network alone: training ends in other last bits, as the systems' exponentials do.
    network = [[float(n) for n in re.findall(r"[0-9.]+(?= %)", *lines(text, "from its network's"))] for text in (ours, theirs)]
    assert len(network[0]) == 4 and all(abs(a - b) < 0.0025 for a, b in zip(*network)), network
    assert "tcp://127.0.0.1:" in messages, messages
    names = lambda whose: sorted(os.listdir(place.path(whose, "yawrig-demo")))
    same("the files of the demo", names("ours"), names("theirs"))
    return f"{len(table(ours))} lines equal"


def check_identify(place):
    """One record, in a folder with blanks and umlauts."""
    place.both(RELEASE)
    same("the record", place.text("ours", RELEASE[-1]), place.text("theirs", RELEASE[-1]))
    answers = [json.loads(out) for out, _ in place.both(["identify", RELEASE[-1], "--method", "all", "--json"])]
    worst = alike("identify", *answers)
    place.both(["identify", "nicht da.csv"], exits=3)
    place.both(["identify", RELEASE[-1], "--no-such-flag"], exits=2)
    # By a pipe, whose line ends are the system's.
    record = place.text("ours", RELEASE[-1]).replace("\n", "\r\n").encode()
    out, _ = place.run("theirs", "identify - --json", input=record)
    assert json.loads(out)["records"], out
    return f"numbers agree to {worst:.1e}"


def check_diagnose(place):
    """A model file with its journal: steps are taken and told."""
    made = "simulate --spring K4 --out r.csv --seed 2 --seconds 20 --rate-hz 200 --effect coulomb_friction:c=0.05".split()
    place.both(made)
    answers = [json.loads(out) for out, _ in place.both("diagnose r.csv --json")]
    same("the effects", answers[0]["effects"], answers[1]["effects"])
    alike("modal", answers[0]["modal"], answers[1]["modal"], digits=6)
    place.both("fit r.csv")
    place.both("add coulomb_friction")
    steps = [json.loads(out) for out, _ in place.both("history --json")]
    alike("the shape of history's steps", *([sorted(step) for step in one["steps"]] for one in steps))
    return ", ".join(answers[1]["effects"])


def check_campaign(place):
    """A campaign simulated, checked, to derivatives and to a report."""
    place.both("simulate --campaign Messreihe --seed 5 --seconds 20")
    for name in ("campaign.toml", "K1-mid-off.csv"):
        same(name, place.text("ours", "Messreihe", name), place.text("theirs", "Messreihe", name))
    place.both("campaign check Messreihe/campaign.toml")
    answers = [json.loads(out) for out, _ in place.both("derivatives Messreihe/campaign.toml --json")]
    worst = alike("derivatives", *answers)
    place.both("report Messreihe/campaign.toml --out Bericht.html")
    sizes = [os.path.getsize(place.path(whose, "Bericht.html")) for whose in ("ours", "theirs")]
    assert min(sizes) > 100_000, sizes
    assert abs(sizes[0] - sizes[1]) < 0.01 * sizes[0], sizes
    # Windows' own way to write a path.
    place.run("theirs", ["derivatives", "Messreihe\\campaign.toml"])
    place.both("campaign init Messreihe --out neu.toml --pattern {spring}-{axis}-{state}.csv")
    same("what init finds", place.text("ours", "neu.toml"), place.text("theirs", "neu.toml"))
    return f"numbers agree to {worst:.1e}"


def check_device(place):
    """A network trained, written and played into; another program follows over the shared socket."""
    place.both(RELEASE)
    answers = [json.loads(out) for out, _ in place.both(["replay", RELEASE[-1], "--json"])]
    worst = alike("replay", answers[0]["records"], answers[1]["records"], digits=5)
    place.both("train --samples 200 --epochs 5 --out netz.yrn")
    place.run("theirs", "flash netz.yrn")
    process, lines = place.start("theirs", "monitor --speed 200 --releases 3")
    path = lines.wait(r"--device (tcp://\S+)")[1]
    try:
        out, _ = place.run("theirs", ["device", "--device", path, "--json"])
        assert json.loads(out)["firmware"].startswith("yawrig "), out
    finally:
        process.wait(PATIENCE_S)
    assert process.returncode == 0, lines.said
    place.run("theirs", ["device", "--device", path], exits=4)
    place.run("theirs", "monitor --speed 200 --releases 2 --record sitzung.csv")
    kept = sorted(name for name in os.listdir(place.folders["theirs"]) if name.startswith("sitzung"))
    assert "sitzung.csv" in kept and not any(name.endswith(".partial") for name in kept), kept
    place.run("theirs", "device --device COM77", exits=4)
    place.run("theirs", "device --device qemu", exits=2)
    place.run("theirs", "ports --json")
    place.run("theirs", "doctor --json")
    return f"numbers agree to {worst:.1e}"


def check_port(place):
    """A COM port, which Wine makes of a pseudo-terminal with this system's device behind it."""
    process, lines = place.start("ours", "monitor --speed 1")
    port = os.path.join(os.environ["WINEPREFIX"], "dosdevices", "com33")
    try:
        os.symlink(lines.wait(r"--device (/dev/\S+)")[1], port)
        for _ in range(3):
            out, _ = place.run("theirs", "device --device COM33 --json")
            assert json.loads(out)["firmware"].startswith("yawrig "), out
        out, _ = place.run("theirs", "monitor --device COM33 --seconds 3 --jsonl")
    finally:
        process.kill()
        process.wait(PATIENCE_S)
        os.remove(port)
    return "a device at COM33 answers"


def check_interrupt(place):
    """Ctrl-C, which Wine makes of this system's signal."""
    process, lines = place.start("theirs", "monitor --speed 20")
    lines.wait("the built-in rig swings")
    process.send_signal(signal.SIGINT)
    code = process.wait(PATIENCE_S)
    assert code == 130, (code, lines.said)
    return "ended with 130"


def check_workbench(place):
    """It answers its page's requests."""
    place.run("theirs", RELEASE)
    process, lines = place.start("theirs", ["workbench", RELEASE[-1]])
    try:
        origin, token = lines.wait(r"(http://127\.0\.0\.1:\d+)/\?token=(\S+)").groups()

        def get(path):
            request = urllib.request.Request(origin + path, headers={"Authorization": f"Bearer {token}"})
            with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:
                return answer.status, answer.read()

        status, page = get(f"/?token={token}")
        assert status == 200 and b"<html" in page.lower(), page[:200]
        status, state = get("/api/state")
        assert status == 200, state
        assert "größer" in json.dumps(json.loads(state), ensure_ascii=False), state[:500]
    finally:
        process.kill()
        process.wait(PATIENCE_S)
    return f"{len(page)} bytes of page"


def check_kill(place):
    """Killed while it writes, again and again: whole lines, and the same call goes on."""
    os.makedirs(place.path("theirs", "viele"))
    place.run("theirs", "simulate --spring K4 --out a.csv --seed 1 --seconds 20 --rate-hz 100")
    for k in range(60):
        shutil.copy(place.path("theirs", "a.csv"), place.path("theirs", "viele", f"r{k}.csv"))
    log = place.path("theirs", "antworten.jsonl")
    kills = 0
    for wanted in (1, 10, 25, 40):
        process, _ = place.start("theirs", "identify viele --out antworten.jsonl")
        until = time.monotonic() + PATIENCE_S
        while process.poll() is None and time.monotonic() < until:
            if os.path.exists(log) and open(log, "rb").read().count(b"\n") >= wanted:
                break
            time.sleep(0.005)
        if wanted == 10:
            other = subprocess.run(
                command("theirs", "identify viele --out antworten.jsonl"),
                cwd=place.folders["theirs"],
                capture_output=True,
                timeout=PATIENCE_S,
            )
            # While it lives nobody else writes there.
            assert process.poll() is not None or other.returncode == 3, other
        kills += process.poll() is None
        kill_windows(process)
    place.run("theirs", "identify viele --out antworten.jsonl")
    lines = [json.loads(line) for line in open(log, encoding="utf-8")]
    same("the records with an answer", sorted({line["file"] for line in lines}), sorted(line["file"] for line in lines))
    assert len(lines) == 60, len(lines)
    # A model's journal, cut off at any moment.
    place.run("theirs", "fit a.csv")
    for k in range(8):
        process, _ = place.start("theirs", "add coulomb_friction" if k % 2 == 0 else "remove coulomb_friction")
        time.sleep(0.1 * k)
        kill_windows(process)
    place.run("theirs", "fit")
    steps = json.loads(place.run("theirs", "history --json")[0])["steps"]
    assert len(steps) >= 2, steps
    left = [name for name in os.listdir(place.folders["theirs"]) if name.endswith(".next")]
    assert not left, left
    return f"{kills} killed in the middle"


def kill_windows(process):
    """Its process of this system is the one of Windows: nothing is put away."""
    process.kill()
    process.wait(PATIENCE_S)


def main():
    checks = {name[6:]: check for name, check in globals().items() if name.startswith("check_")}
    unknown = [name for name in WANTED if name not in checks]
    if unknown:
        sys.exit(f"tests/windows: unknown: {', '.join(unknown)}; there are {', '.join(checks)}")
    failed = []
    for name in WANTED or checks:
        began = time.monotonic()
        with tempfile.TemporaryDirectory(prefix="yawrig-wine-") as root:
            try:
                found = "ok: " + checks[name](Place(root))
            except (AssertionError, subprocess.TimeoutExpired) as error:
                failed.append(name)
                found = f"FAILED: {error}"
        print(f"{name:10} {time.monotonic() - began:6.1f} s  {found}", flush=True)
    print(f"tests/windows: {len(WANTED or checks) - len(failed)} passed, {len(failed)} failed, under Wine only")
    sys.exit(bool(failed))


main()
