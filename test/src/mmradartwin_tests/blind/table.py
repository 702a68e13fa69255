"""The protocol's table: figures, what is required, what was measured, with exact binomial bounds."""
import collections
import math
import statistics

import numpy as np
from scipy.special import log_expit
from scipy.stats import binomtest, chi2, norm

from mmradartwin_tests.blind.scoring import score

HEAD = ("figure", "required", "measured", "trials")


def bounds(count, trials):
    """95 % Clopper-Pearson bounds of a share."""
    interval = binomtest(count, trials).proportion_ci(0.95, method="exact")
    return interval.low, interval.high


def share(values):
    """'hits of trials, share and bounds' of a list of truth values, with their number."""
    values = [bool(v) for v in values]
    if not values:
        return "not run", 0
    count, n = sum(values), len(values)
    low, high = bounds(count, n)
    return f"{100 * count / n:.1f} % ({100 * low:.1f} to {100 * high:.1f})", n


def limit_by_chance(nats):
    """Limit in nats that the matched test passes by chance as seldom as it is meant to (MATCHED_LEVEL), of what it made
    of effects of one kind that are not there: an exponential tail beyond the best tenth. None of fewer than 100."""
    if len(nats) < 100:
        return None
    beyond = np.quantile(nats, 0.9)
    above = [v - beyond for v in nats if v > beyond]
    if not above:   # all alike
        return float(beyond)
    return float(beyond + np.mean(above) * math.log(len(above) / len(nats) / MATCHED_LEVEL))


def kind_of(cause):
    """One of KINDS."""
    return KINDS[0] if cause in MOVES_ECHOES else KINDS[1]


def strength_over_limit(record, at_its_word=True, limit_nats=None):
    """Strength of a hidden effect over the one at which the matched test, the likelihood of the twin that is told it,
    detects it; None where the twin cannot be told. Nats go by the square of small strengths.

    limit_nats: of the matched test, MATCHED_NATS where none is given. At its word the likelihood knows all errors of
    rooms and poses: a matched test better than there is. Otherwise its nats are divided by what they scatter over
    places more than they would then, twice their mean (variance of a likelihood ratio of two simple hypotheses): a
    worse one where few places see the effect.
    """
    told = record.get("told")
    if not told:
        return None
    nats = max(0.0, told["nats"])
    if not at_its_word and nats > 0:
        deviation = (told["nats_ci95"][1] - told["nats_ci95"][0]) / (2 * norm.ppf(0.975))
        nats /= max(1.0, deviation ** 2 / (2 * nats))
    return math.sqrt(nats / (limit_nats or MATCHED_NATS))


def half_power(strengths, named):
    """(strength at which half are named, its 95 % interval) by maximum likelihood of a logistic curve over log strength
    and its profile; None where there are fewer than ten of each, or the curve has no such place."""
    x = np.log(np.maximum(strengths, 1e-2))
    y = np.where(np.asarray(named, bool), 1.0, -1.0)
    if min((y > 0).sum(), (y < 0).sum()) < 10:
        return None
    places, slopes = np.linspace(math.log(0.1), math.log(10), 400), np.geomspace(0.5, 30, 60)
    curve = slopes[None, :, None] * (x[None, None, :] - places[:, None, None])
    profile = log_expit(curve * y).sum(axis=2).max(axis=1)
    within = places[profile > profile.max() - chi2.ppf(0.95, 1) / 2]
    if within[0] == places[0] or within[-1] == places[-1]:
        return None
    return tuple(float(math.exp(v)) for v in (places[profile.argmax()], within[0], within[-1]))


class Scores:
    """Scores of all results of one tier and campaign. LedgerError where a truth was changed after it was sealed."""

    def __init__(self, records, ledger):
        self.rows = collections.defaultdict(list)    # row: [(record, truths, score)]
        self.silent = 0                              # trials without an answer
        for record in records:
            truths = ledger.open(record["key"])["effects"]
            if record["status"] != "ok":
                self.silent += 1
            row = "single" if record["row"] == "later" else record["row"]
            self.rows[row].append((record, truths, score(record["row"], truths, record["findings"])))

    def each(self, row, figure, answered=False):
        """A figure of all trials of a row that have it; `answered`: of those only where the program gave an answer."""
        return [s[figure] for record, _, s in self.rows[row]
                if s.get(figure) is not None and (record["status"] == "ok" or not answered)]

    def coverage(self):
        """[(parameter, covered, quantile)] over all rows where truths are named."""
        return [c for row in self.rows.values() for _, _, s in row for c in s.get("coverage", [])]

    def limits_by_chance(self):
        """({kind: limit in nats, none where too few}, number of effects that are not there and were told)."""
        by_kind = {kind: [] for kind in KINDS}
        for record, _, _ in self.rows["clean"]:
            for absent in record.get("told_absent", []):
                by_kind[kind_of(absent["cause"])].append(absent["nats"])
        limits = {kind: limit_by_chance(nats) for kind, nats in by_kind.items()}
        return ({kind: max(limit, MATCHED_NATS) for kind, limit in limits.items() if limit},
                sum(len(nats) for nats in by_kind.values()))

    def strength_of_half_power(self, at_its_word=True, limits=None):
        """Text and trials; of the kinds that have a limit, where limits by chance are given."""
        faint = [(strength_over_limit(record, at_its_word, limits and limits[kind_of(truths[0]["cause"])]),
                  all(s["named"]))
                 for record, truths, s in self.rows["single"] + self.rows["faint"]
                 if record.get("told") and (limits is None or kind_of(truths[0]["cause"]) in limits)]
        half = half_power(*zip(*faint)) if faint else None
        return "{:.2f} ({:.2f} to {:.2f})".format(*half) if half else "not run", len(faint)

    def table(self):
        """Rows of text: figure, required, measured, trials."""
        named = self.each("pair", "named")
        sizes = self.each("single", "group_size")
        covered = [c[1] for c in self.coverage()]
        gains = self.each("clean", "gain")
        ratios = [s["gain"] / record["told"]["explained_power"] for record, _, s in self.rows["single"]
                  if (record.get("told") or {}).get("explained_power", 0) >= LEAST_TRUE_GAIN and s["gain"] is not None]
        strengths = [(strength_over_limit(record), s) for record, _, s in self.rows["single"]]
        strong = [s["first"] for strength, s in strengths if strength is None or strength >= 2]
        limits, absent = self.limits_by_chance()
        limits_text = ", ".join(f"{limit:.1f} nats of {kind}" for kind, limit in limits.items())
        halves = [self.strength_of_half_power(), self.strength_of_half_power(at_its_word=False),
                  self.strength_of_half_power(limits=limits)]
        rows = [
            ("false alarms on clean sessions", "≤ 1 %", *share(self.each("clean", "alarm", answered=True))),
            ("single effects: right name first", "≥ 92 %", *share(self.each("single", "first"))),
            ("– of those of at least twice their detection limit", "≥ 92 %", *share(strong)),
            ("single effects: wrong with confidence", "≤ 2 %", *share(self.each("single", "wrong"))),
            ("single effects: truth within the first group", "≥ 98 %", *share(self.each("single", "in_group"))),
            ("mean size of that group", "≤ 1.6", f"{statistics.mean(sizes):.2f}" if sizes else "not run",
             len(sizes)),
            ("effects of any strength: wrong with confidence", "≤ 2 %", *share(self.each("faint", "wrong"))),
            ("detection strength at 50 % power over that of the matched test", "≤ 1.5", *halves[0]),
            ("– with the scatter of its likelihood over places taken off", "≤ 1.5", *halves[1]),
            (f"– with the limits that {absent} effects which are not there set, "
             + (limits_text or "none of fewer than 100"), "≤ 1.5", *halves[2]),
            ("actor, material, walls, pose or order right where the name is", "",
             *share([v for row in ("single", "pair", "twice") for s in self.each(row, "subjects") for v in s])),
            ("pairs: both named", "≥ 85 %", *share([all(n) for n in named])),
            ("pairs: one right and none wrong", "≥ 97 %",
             *share([any(n) and not w for n, w in zip(named, self.each("pair", "wrong"))])),
            ("one cause for two things: both named, and what they are about",
             "", *share(self.each("twice", "told_apart"))),
            ("one cause for two things: something else claimed", "", *share(self.each("twice", "wrong"))),
            ("outside the catalogue: called unknown", "≥ 90 %", *share(self.each("outside", "unknown"))),
            ("outside the catalogue: given a catalogue name", "≤ 3 %", *share(self.each("outside", "wrong"))),
            ("outside the catalogue: right variable", "≥ 90 %", *share(self.each("outside", "variable"))),
            ("outside the catalogue: place within 0.3 m", "all", *share(self.each("outside", "place"))),
            ("decoys: material blamed", "≤ 2 %", *share(self.each("decoy", "material_blamed", answered=True))),
            ("95 % intervals that hold the truth, right names only", "93 to 97 %", *share(covered)),
            ("held-out gain over that of the true model, median and mean, where that is 0.01 or more", "≥ 0.90",
             f"{statistics.median(ratios):.2f}, {statistics.mean(ratios):.2f}" if ratios else "not run", len(ratios)),
            ("clean sessions: held-out gain of what was claimed negative", "never", *share([g < 0 for g in gains])),
            ("put into a real recording: named", "", *share([n[0] for n in self.each("recording", "named")])),
            ("put into a real recording: something else claimed", "", *share(self.each("recording", "wrong"))),
        ]
        records = [r for row in self.rows.values() for r, _, _ in row]
        generated = [r for r in records if r["row"] != "recording"]
        if generated:
            for name, figure in (("wall", "seconds"), ("CPU", "cpu_s")):
                times = [r[figure] for r in generated]
                rows.append((f"{name} time of one diagnosis, median and longest", "",
                             f"{statistics.median(times):.0f} s, {max(times):.0f} s", len(times)))
            rows.append(("peak memory of one diagnosis", "≤ 2048 MiB", f"{max(r['peak_mib'] for r in records):.0f} MiB",
                         len(records)))
        rows.append(("no answer (failed or over the time limit)", "0", str(self.silent), len(records)))
        return rows

    def by_cause(self):
        """Rows of text over the hidden effects of the rows with one: effect, trials, right, what else was said first."""
        groups = collections.defaultdict(list)
        for row in ("single", "faint", "outside", "decoy", "recording"):
            for record, truths, s in self.rows[row]:
                groups[(row, truths[0]["cause"])].append((record, s))
        rows = []
        for (row, cause), trials in sorted(groups.items()):
            right = {"single": "first", "faint": "first", "outside": "unknown"}.get(row)
            if row == "recording":
                good = sum(s["named"][0] for _, s in trials)
            else:
                good = sum(s[right] if right else not s["material_blamed"] for _, s in trials)
            said = collections.Counter(r["findings"][0]["cause"] if r["findings"] else
                                       "nothing" if r["status"] == "ok" else r["status"] for r, _ in trials)
            rows.append((row, cause, f"{good} of {len(trials)}",
                         ", ".join(f"{name} {n}" if n > 1 else name for name, n in said.most_common())))
        return rows

    def by_name_where_nothing_is(self):
        """Rows of text over the clean sessions: name, how often it was fitted, most nats (trials.most_nats), where."""
        best = collections.defaultdict(list)
        for record, _, _ in self.rows["clean"]:
            for name, nats in record.get("most_nats", {}).items():
                best[name].append((nats, record["key"]))
        most = sorted(((*max(all_of), len(all_of), name) for name, all_of in best.items()), reverse=True)
        return [(name, str(fitted), f"{nats:.1f}", key) for nats, key, fitted, name in most]

    def by_parameter(self):
        """Rows of text: parameter, covered, bounds."""
        groups = collections.defaultdict(list)
        for name, covered, _ in self.coverage():
            groups[name].append(covered)
        return [(name, *(str(v) for v in share(values))) for name, values in sorted(groups.items())]


def markdown(head, rows):
    """A Markdown table."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(str(c) for c in row) + " |" for row in rows])


MATCHED_LEVEL = 1e-4     # of one test: 1 % for some hundred hypotheses
MATCHED_NATS = -math.log(MATCHED_LEVEL)   # chance brings as large a ratio as often at most (Markov's inequality)
# What moves echoes lets paths come and go, and gains by it where it is not there; each kind has its own limit by chance.
KINDS = ("what moves echoes", "what does not")
MOVES_ECHOES = {"actor_moved", "carrier_scale", "radar_pitch_offset", "radar_position_offset", "radar_yaw_offset",
                "range_bias", "range_scale", "scene_registration", "scene_scale"}
LEAST_TRUE_GAIN = 0.01   # of explained power: less is lost in the figures' rounding
COLORS = ("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b", "#e377c2", "#bcbd22", "#17becf")
SIDE = 400    # of the plot's square, pixels


def quantile_plot(coverage, fewest=5):
    """P-P plot as SVG text: share of the trials over the truth's quantile in its interval's normal law.

    A line for every parameter with at least `fewest` values and a black one for all; on the diagonal intervals are
    honest, an S across it means that they are too narrow.
    """
    groups = collections.defaultdict(list)
    for name, _, quantile in coverage:
        groups[name].append(quantile)
        groups["all"].append(quantile)
    shown = [name for name, values in sorted(groups.items()) if len(values) >= fewest]
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{SIDE + 330}" height="{SIDE + 60}" '
             'font-family="sans-serif" font-size="11">',
             '<rect width="100%" height="100%" fill="white"/><g transform="translate(40,10)">',
             f'<rect width="{SIDE}" height="{SIDE}" fill="none" stroke="black"/>',
             f'<line x1="0" y1="{SIDE}" x2="{SIDE}" y2="0" stroke="#999999"/>',
             f'<text x="{SIDE / 2}" y="{SIDE + 35}" text-anchor="middle">quantile of the truth in its interval</text>',
             f'<text x="-25" y="{SIDE / 2}" text-anchor="middle" transform="rotate(-90 -25 {SIDE / 2})">'
             'share of trials</text>']
    for tick in (0, 0.5, 1):
        lines.append(f'<text x="{SIDE * tick}" y="{SIDE + 15}" text-anchor="middle">{tick:g}</text>')
        lines.append(f'<text x="-4" y="{SIDE * (1 - tick) + 4}" text-anchor="end">{tick:g}</text>')
    for place, name in enumerate(shown):
        values = sorted(groups[name])
        color, width = ("black", 2.5) if name == "all" else (COLORS[place % len(COLORS)], 1)
        points = " ".join(f"{SIDE * q:.1f},{SIDE * (1 - (i + 0.5) / len(values)):.1f}" for i, q in enumerate(values))
        lines.append(f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="{width}"/>')
        lines.append(f'<text x="{SIDE + 10}" y="{12 + 14 * place}" fill="{color}">{name} ({len(values)})</text>')
    return "\n".join(lines + ["</g></svg>"]) + "\n"
