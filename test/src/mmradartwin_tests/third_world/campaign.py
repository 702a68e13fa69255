"""Trials in the third world: which session a number stands for, its record, and the table of all records."""
import os
import shutil
import time

import numpy as np

from mmradartwin_tests.blind import table, trials
from mmradartwin_tests.blind.scoring import score
from mmradartwin_tests.third_world import hidden, rooms
from mmradartwin_tests.third_world.measured import ThirdWorld

IMAGE_DB = 3.0      # an image of the world's own receivers is told right within
CORNER_DB = 20.0    # over the noise of a sample: a corner that stands out in this world
CORNER_POSES = 3    # to which a corner of this world answers at least
NEAR_NATS = 3.0     # a twin that is told a cause which is not there may be ahead by so much


def drawn(seed, what):
    """(cause or None, kind of room) of a session; kinds and causes come in turn, each with all of the other."""
    kinds, causes = list(rooms.KINDS), list(hidden.CAUSES)
    if what == "clean":
        return None, kinds[seed % len(kinds)]
    cause = causes[seed % len(causes)] if what == "single" else what
    return cause, kinds[(seed + seed // len(causes)) % len(kinds)]


def absent(seed, plan):
    """A cause that a clean session does not hold, weak as at its limit, to tell a twin of."""
    rng = np.random.default_rng([seed, 12])
    choices = {"radar_yaw_offset": {"yaw_deg": rng.uniform(-0.3, 0.3)}, "range_bias": {"range_m": rng.uniform(0.002, 0.01)},
               "excess_attenuation": {"db_per_m": rng.uniform(0.05, 0.3)},
               "element_pattern": {"cos_exponent": rng.uniform(0.05, 0.3)},
               "range_scale": {"scale": rng.uniform(-0.002, 0.002)},
               "carrier_scale": {"scale": rng.uniform(-0.005, 0.005)},
               "material_reflectivity": {"material": plan.walls["wall_south"], "delta_db": rng.uniform(-1.5, 1.5)},
               "tx_imbalance": {"phase_deg": rng.uniform(-4, 4), "gain_db": rng.uniform(-0.3, 0.3)}}
    return [{"cause": str(name), "parameters": {k: v if isinstance(v, str) else float(v) for k, v in choices[name].items()}}
            for name in rng.choice(list(choices), 4, replace=False)]


def run_trial(seed, what, program, folder, jobs, without=(), limit_s=3600.0, told=True):
    """One record. The session stands in the folder, with what a diagnosis said; one that was measured is not measured
    again."""
    cause, kind = drawn(seed, what)
    start, session = time.monotonic(), os.path.join(folder, "session")
    # A row's sessions have rooms and campaigns of their own.
    world = ThirdWorld(seed + (0 if what == "clean" else 100000), cause, kind, without)
    if not os.path.exists(os.path.join(session, "session.yaml")):     # the file that is written last
        shutil.rmtree(folder, ignore_errors=True)
        world.write(session)
    made_s = time.monotonic() - start
    truths = world.truth()
    record = trials.answer(program, session, folder, limit_s, jobs)
    if told:
        expected = truths or absent(seed, world.plan)
        answers = trials.told(program, session, expected, folder, limit_s, jobs)
        record["told"] = [{"cause": t["cause"], **a} for t, a in zip(expected, answers) if a]
    record["corners"] = [f["parameters"]["actors"]["value"] for f in record["findings"]
                         if f["cause"] == "corner_reflection" and
                         sum(v > CORNER_DB for v in world.corner_over_noise_db(f["parameters"]["actors"]["value"])) >= CORNER_POSES]
    record["image_db"] = [20 * float(np.log10(max(abs(v), 1e-9))) for v in world.images()]
    record.update(key=f"{what}-{seed}", seed=seed, row="clean" if cause is None else "single", kind=kind, truths=truths,
                  poses=len(world.stations), places=world.places, made_s=round(made_s, 1), without=sorted(without))
    return record


def is_true_of_the_world(finding, record):
    """A finding that tells what the world has and the twin has not: the images of its receivers, which every session has,
    or a corner across a gap that its second order returns (CORNER_DB)."""
    told = finding["parameters"].get("image_db", {}).get("value")
    if finding["cause"] == "corner_reflection":
        return finding["parameters"]["actors"]["value"] in record.get("corners", [])
    return (finding["cause"] == "iq_imbalance" and isinstance(told, list) and
            all(abs(a - b) <= IMAGE_DB for a, b in zip(told, record["image_db"])))


def figures(record):
    """What a record is scored by. What is true of the world is no answer to what was hidden, and no wrong one."""
    findings = record["findings"]
    if not any(t["cause"] == "iq_imbalance" for t in record["truths"]):
        findings = [f for f in findings if not is_true_of_the_world(f, record)]
    found = score(record["row"], record["truths"], findings)
    found["named_alarm"] = any(f["cause"] != "unknown" for f in findings)
    told = record.get("told") or []
    found["told"] = told[0]["nats"] if told and record["row"] == "single" else None
    found["ahead"] = max((t["nats"] for t in told), default=None) if record["row"] == "clean" else None
    found["strong"] = found["told"] is None or (table.strength_over_limit({"told": told[0]}) or 0) >= 2
    return found


def text_of(record):
    """One line."""
    short = lambda v: [short(x) for x in v] if isinstance(v, list) else f"{v:.4g}" if isinstance(v, float) else v
    hide = "; ".join(t["cause"] + " " + ", ".join(f"{k}={short(v)}" for k, v in t["parameters"].items())
                     for t in record["truths"]) or "nothing"
    said = []
    for f in record["findings"]:
        values = ", ".join(f"{k}={short(p['value'])}" for k, p in f["parameters"].items())
        names = ", ".join(f"{c['cause']} {c['probability']:.2g}" for c in f.get("candidates") or [])
        said.append(f"{f['cause']} {values} [{names}] {short(f['evidence'].get('log_likelihood_gain'))} nats" +
                    (f" ({f['description'][:200]})" if f["cause"] == "unknown" and f.get("description") else ""))
    told = ", ".join(f"{t['cause']} {t['nats']:+.1f}" for t in record.get("told") or [])
    answer = "; ".join(said) or ("nothing" if record["status"] == "ok" else f"{record['status']}: {record.get('log')}")
    return (f"{record['key']} {record['kind']} {record['made_s']:.0f}+{record['seconds']:.0f} s | hidden: {hide} | "
            f"said: {answer} | told: {told}")


def table_of(records):
    """Rows of text: figure, required, measured, trials."""
    scored = [(r, figures(r)) for r in records if r["status"] == "ok"]
    clean = [(r, f) for r, f in scored if r["row"] == "clean"]
    single = [(r, f) for r, f in scored if r["row"] == "single"]
    strong = [f for _, f in single if f["strong"]]
    covered = [c for _, f in single for c in f.get("coverage", [])]
    ahead = [t["nats"] <= NEAR_NATS for r, _ in clean for t in r.get("told") or []]
    rows = [
        ("nothing hidden: a catalogue name", "≤ 1 %", *table.share([f["named_alarm"] for _, f in clean])),
        ("nothing hidden: `unknown` alone", "by hand", *table.share([f["alarm"] and not f["named_alarm"]
                                                                     for _, f in clean])),
        ("single effects of twice their limit: right name first", "≥ 92 %", *table.share([f["first"] for f in strong])),
        ("all single effects: right name first", "", *table.share([f["first"] for _, f in single])),
        ("single effects: wrong with confidence", "≤ 1 %", *table.share([f["wrong"] for _, f in single])),
        ("95 % intervals that hold the truth", "93 to 97 %", *table.share([c[1] for c in covered])),
        ("told twins of what is not there at most 3 nats ahead", "all", *table.share(ahead)),
        ("no answer", "none", str(sum(r["status"] != "ok" for r in records)), len(records)),
    ]
    by_cause = []
    for cause in hidden.CAUSES:
        mine = [(r, f) for r, f in single if r["truths"][0]["cause"] == cause]
        if mine:
            by_cause.append((f"`{cause}`", str(len(mine)), str(sum(f["first"] for _, f in mine)),
                             str(sum(f["wrong"] for _, f in mine)),
                             " ".join(sorted({r["findings"][0]["cause"] if r["findings"] else "nothing"
                                              for r, f in mine if not f["first"]})) or "–"))
    return (table.markdown(table.HEAD, [(a, b, c, str(d)) for a, b, c, d in rows]) + "\n\n" +
            table.markdown(("hidden", "sessions", "named first", "wrong name with confidence", "first name else"), by_cause))
