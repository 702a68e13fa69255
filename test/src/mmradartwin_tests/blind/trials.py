"""Runs one blind trial: hide, seal, diagnose, open, keep what came out. And keeps results, so that none runs twice."""
import csv
import json
import os
import re
import shutil
import signal
import subprocess
import tempfile
import time

import yaml

from mmradartwin_tests import effects
from mmradartwin_tests.blind import draws, recordings
from mmradartwin_tests.session import Measurement, Settings

# What frames and converters do no map expects; of leakage the truth tells a part.
UNTOLD = ("tx_rx_leakage", "dc_offset", "adc_saturation", "noise_floor", "moving_target", "interference",
          "phase_drift", "packet_loss", "packet_misalignment", "iq_conjugation", "channel_conjugation",
          "channel_permutation")
KEPT = ("cause", "parameters", "candidates", "evidence", "mechanism", "where", "description")


class Results:
    """A file of JSON lines, one per finished trial, each with the keys `needs`. An incomplete last line (the machine
    stopped) counts for nothing, and goes when the next is added."""

    def __init__(self, file, needs=()):
        self.file, self.records, self.whole_size = file, {}, None
        if not os.path.exists(file):
            return
        with open(file, "rb") as stream:
            data = stream.read()
        whole = data[:data.rfind(b"\n") + 1]
        if len(whole) < len(data):
            self.whole_size = len(whole)
        for number, line in enumerate(whole.splitlines(), 1):
            try:
                record = json.loads(line)
                self.records[record["key"]] = record
                for name in needs:
                    record[name]
            except (ValueError, KeyError, TypeError, RecursionError):
                raise ValueError(f"{file}: line {number} is no result; take the line out, its trial runs again") \
                    from None

    def add(self, record):
        """Keeps a finished trial."""
        self.records[record["key"]] = record
        if self.whole_size is not None:
            os.truncate(self.file, self.whole_size)
            self.whole_size = None
        with open(self.file, "a", encoding="utf-8") as out:
            out.write(json.dumps(record) + "\n")
            out.flush()
            os.fsync(out.fileno())


def run_measured(command, limit_s, log):
    """Runs a program in a session of its own: (exit status or None after limit_s, wall s, CPU s, peak MiB).

    Its output goes to the file log. On whatever ends the wait, the whole group is ended.
    """
    start = time.monotonic()
    with open(log, "wb") as out:
        child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=out, start_new_session=True)
    status = usage = None
    try:
        while time.monotonic() - start < limit_s:
            pid, raw, usage = os.wait4(child.pid, os.WNOHANG)
            if pid:
                status = os.waitstatus_to_exitcode(raw)
                break
            time.sleep(0.05)
    finally:
        if status is None:
            os.killpg(child.pid, signal.SIGKILL)
            _, _, usage = os.wait4(child.pid, 0)
        child.returncode = status if status is not None else -signal.SIGKILL   # waited for above
    return status, time.monotonic() - start, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def kept(finding):
    """What the results keep of a finding: pose lists and most metrics are left out."""
    small = {key: finding[key] for key in KEPT if finding.get(key) is not None}
    small["where"] = [{k: v for k, v in w.items() if k != "poses" and v} for w in finding.get("where") or []]
    if finding.get("gain"):
        small["gain"] = {"explained_power": finding["gain"]["explained_power"]}
    return small


def answer(program, session, folder, limit_s, jobs):
    """Diagnoses a session; a record without key and truth."""
    output, log = os.path.join(folder, "out"), os.path.join(folder, "log")
    shutil.rmtree(output, ignore_errors=True)
    command = [program, session, "--output", output, "--jobs", str(jobs)]
    status, seconds, cpu_s, peak_mib = run_measured(command, limit_s, log)
    record = {"status": "ok", "exit": status, "seconds": round(seconds, 2), "cpu_s": round(cpu_s, 2),
              "peak_mib": round(peak_mib, 1), "verdict": None, "findings": []}
    file = os.path.join(output, "findings.json")
    if status in (0, 2) and os.path.exists(file):
        with open(file, encoding="utf-8") as text:
            told = json.load(text)
        record.update(verdict=told["verdict"], findings=[kept(f) for f in told["findings"]])
        return record
    with open(log, encoding="utf-8", errors="replace") as text:
        lines = text.read().replace("\r", "\n").splitlines()
    record.update(status="timeout" if status is None else "failed", log=lines[-3:])
    return record


def most_nats(file):
    """{name: nats} of a diagnosis's tried.csv: the most that a name gains without its best place, over the inflation of
    its scatter, of those that were fitted. Bounds of the diagnosis stand above what this comes to where nothing is
    hidden."""
    most = {}
    with open(file, encoding="utf-8", newline="") as text:
        for row in csv.DictReader(text):
            if row["gain_nats"]:
                name = re.split("[ ,]", row["hypothesis"])[0]
                nats = round(float(row["gain_without_best_place_nats"]) / float(row["inflation"]), 2)
                most[name] = max(nats, most.get(name, nats))
    return most


def told(program, session, truths, folder, limit_s, jobs):
    """What twins that are each told one of the effects explain more than the session's own, one entry an effect, None
    where it cannot be told all of it: causes are mechanisms of the same name and parameters. {"explained_power", "nats",
    "nats_ci95" over places}."""
    output, log = os.path.join(folder, "told"), os.path.join(folder, "told.log")
    shutil.rmtree(output, ignore_errors=True)
    mechanisms = [{}]
    for truth in truths:
        # YAML knows no numbers of numpy.
        mechanisms.append({truth["cause"]: json.loads(json.dumps({**truth["parameters"], **truth.get("beside", {})}))})
    twins = [os.path.join(session, f"told{i}.yaml") for i in range(len(mechanisms))]
    for twin, told_of in zip(twins, mechanisms):
        with open(twin, "w", encoding="ascii") as out:
            yaml.safe_dump({"mechanisms": {**effects.BASE, **told_of}}, out)
    compared = [word for twin in twins[1:] for word in ("--compare", twin)]
    status, *_ = run_measured([program, session, "--twin", twins[0], *compared, "--findings", "0", "--output", output,
                               "--jobs", str(jobs)], limit_s, log)
    for twin in twins:
        os.remove(twin)
    with open(log, encoding="utf-8", errors="replace") as text:
        said = text.read()
    number = r"(-?[0-9.]+(?:e[-+]?[0-9]+)?)"
    before = re.search("the twin as given explains " + number, said)
    answers = []
    for twin in twins[1:]:
        other = re.search(re.escape(twin) + f" explains the same channels {number} nats (more|less) likely "
                          f"\\({number} to {number} more by places\\) and {number} of", said)
        if status != 0 or not before or not other:
            answers.append(None)
            continue
        nats = float(other[1]) if other[2] == "more" else -float(other[1])
        answers.append({"explained_power": round(float(other[5]) - float(before[1]), 6), "nats": nats,
                        "nats_ci95": [float(other[3]), float(other[4])]})
    return answers


def measurement_of(trial, drawn, session):
    """The campaign of a trial with some effects, of which nothing is measured or written yet."""
    chosen = [effects.make_effect(name, parameters, strength) for name, parameters, strength in drawn]
    return Measurement(Settings(output=session, seed=trial.session_seed(), poses=trial.poses,
                                locations=draws.PLACES, headings=trial.headings(),
                                frames=trial.frames, tier=trial.tier, effects=chosen, jobs=1))


def hide(trial, session):
    """Writes the session of a trial; returns its truths."""
    if trial.row == "recording":
        return recordings.write_session(trial, session)
    measurement = measurement_of(trial, draws.draw(trial), session)
    measurement.run()
    return measurement.hidden()


def told_absent(program, session, trial, folder, limit_s, jobs):
    """[{"cause", "nats"}]: what the matched test makes of effects that a clean session does not hold."""
    truths = [truth for name, parameters in draws.absent(trial)
              for truth in measurement_of(trial, [(name, parameters, None)], None).hidden()]
    return [{"cause": truth["cause"], "nats": answer_of_it["nats"]}
            for truth, answer_of_it in zip(truths, told(program, session, truths, folder, limit_s, jobs))
            if answer_of_it]


def run_trial(trial, ledger, program, limit_s=600.0, jobs=1):
    """One trial from drawing to its record. The session lives in a temporary folder and is gone afterwards."""
    with tempfile.TemporaryDirectory(prefix="session") as folder:
        session = os.path.join(folder, "session")
        start = time.monotonic()
        truths = hide(trial, session)
        ledger.seal(trial.key(), {"key": trial.key(), "effects": truths})
        made_s = time.monotonic() - start
        record = answer(program, session, folder, limit_s, jobs)
        tried = os.path.join(folder, "out", "tried.csv")
        if trial.row == "clean" and os.path.exists(tried):
            record["most_nats"] = most_nats(tried)
            record["told_absent"] = told_absent(program, session, trial, folder, limit_s, jobs)
        if trial.row in ("single", "later", "faint") and truths[0]["cause"] not in UNTOLD:
            record["told"], = told(program, session, truths[:1], folder, limit_s, jobs)
        if trial.row == "recording":
            plain = os.path.join(folder, "plain")
            recordings.write_untouched(plain)
            before = answer(program, plain, folder, limit_s, jobs)
            record["findings"] = recordings.beyond(record["findings"], before["findings"])
            record["untouched"] = [f["cause"] for f in before["findings"]]
    record.update(key=trial.key(), row=trial.row, tier=trial.tier, seed=trial.seed, trial=trial.trial,
                  poses=trial.poses, frames=trial.frames, made_s=round(made_s, 2))
    ledger.open(trial.key())     # refuses a truth that was changed meanwhile
    return record
