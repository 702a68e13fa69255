"""Scores findings.json of one trial against its truth. Knows nothing of how either was made."""
import math

from scipy.stats import norm

MATERIAL_CAUSES = ("material_reflectivity", "surface_roughness", "diffuse_scattering")
# Words for the variable of an effect outside the catalogue: a finding names it in the mechanism that it proposes, as a
# law over it, or in its description.
VARIABLES = {
    "azimuth": ("azimuth",),
    "range": ("range_m",),
    "echo amplitude": ("amplitude", "echo_db", "level_db"),
    "radar height": ("height",),
    "world direction": ("heading", "world_azimuth", "bearing", "world direction"),
    "place": ("place", "x_m", "region"),
    "where the radar stands": ("standing_m", "distance_m", "location"),
    "range behind an echo": ("behind", "trailing", "excess"),
    "range behind a place": ("behind",),
    "transmitter": ("transmitter", "slot"),
    "channel": ("channel", "mutual_coupling"),
    "frame and beat frequency": ("beat", "spur", "frequency", "tone"),
    "frame": ("frame",),
    "incidence": ("incidence",),
    "time": ("time", "hour"),
    "actor": ("actor",),
}
PLACE_M = 0.3
CONFIDENT = 0.5           # probability of its first name above which a finding counts as said with confidence
CONVENTIONS = {"channel_conjugation", "channel_permutation"}


def group(finding):
    """Names that a finding leaves open, {name: probability}."""
    names = {c["cause"]: c["probability"] for c in finding.get("candidates") or []}
    names.setdefault(finding["cause"], 1.0 if not names else 0.0)
    return names


def same_cause(truth, name):
    """Whether a name is the truth's; the reversed order of channels has two names (docs/reference/causes.md)."""
    if truth["cause"] == name:
        return True
    reversed_order = truth["cause"] == "channel_conjugation" or (
        truth["cause"] == "channel_permutation" and truth["parameters"].get("order") == [7, 6, 5, 4, 3, 2, 1, 0])
    return reversed_order and name in CONVENTIONS


def wrong_with_confidence(truths, finding):
    """A catalogue name that none of the truths bears, nor the finding's group, said with confidence."""
    names = group(finding)
    if finding["cause"] == "unknown" or names[finding["cause"]] < CONFIDENT:
        return False
    return not any(same_cause(t, name) for t in truths for name in names)


def interval(finding, name):
    """[(value, low, high)] of a number or a list; elements without an interval of their own are left out."""
    parameter = finding["parameters"].get(name)
    if not parameter or parameter.get("ci95") is None or isinstance(parameter["value"], str):
        return None
    value, bounds = parameter["value"], parameter["ci95"]
    if not isinstance(value, list):
        value, bounds = [value], [bounds]
    return [(v, low, high) for v, (low, high) in zip(value, bounds)]


def coverage(truth, finding):
    """[(parameter, covered, quantile of the truth in the interval's normal law)] of a finding with the right name."""
    result = []
    for name, true in truth["parameters"].items():
        found = interval(finding, name)
        if found is None or isinstance(true, str) or true is None:
            continue
        true = true if isinstance(true, list) else [true]
        if len(true) != len(found):
            continue
        for t, (value, low, high) in zip(true, found):
            if not high > low:      # a reference channel, which is what it is by definition
                continue
            sigma = (high - low) / (2 * norm.ppf(0.975))
            result.append((f"{truth['cause']}.{name}", bool(low <= t <= high), float(norm.cdf((t - value) / sigma))))
    return result


def subject_right(truth, finding):
    """Whether actor, material, walls, pose or the channels' order are the true ones; None where the cause has none."""
    judged = None
    for name in ("actor", "material", "walls", "actors", "pose", "order"):
        if name not in truth["parameters"]:
            continue
        found = (finding["parameters"].get(name) or {}).get("value")
        true = truth["parameters"][name]
        if isinstance(true, list) and name != "order":
            judged = isinstance(found, list) and sorted(true) == sorted(found)
        else:
            judged = found == true
    return judged


def named_variable(finding):
    """Words in which an unknown finding tells what its law depends on."""
    mechanism = finding.get("mechanism") or {}
    words = []
    for name, values in mechanism.items():
        words.append(name)
        words += [str(values[key]) for key in ("variable", "event") if values.get(key)]
        words += [key for key in ("actor", "x_m") if values.get(key)]
    if not mechanism or "empirical_law" not in mechanism:
        words.append(finding.get("description") or "")
    return " ".join(words).lower()


def place_error_m(truth, finding):
    """Distance of the nearest place that a finding gives to the true one; None without a true one, inf without any."""
    if truth["parameters"].get("x_m") is None:
        return None
    true = (truth["parameters"]["x_m"], truth["parameters"]["y_m"])
    places = [(w.get("x_m"), w.get("y_m")) for w in finding.get("where") or []]
    for values in (finding.get("mechanism") or {}).values():
        if isinstance(values, dict):
            places.append((values.get("x_m"), values.get("y_m")))
    distances = [math.dist(true, p) for p in places if p[0] is not None and p[1] is not None]
    return min(distances, default=math.inf)


def match(truths, findings):
    """The finding of each truth's cause, None where there is none; one finding answers one truth, of several of one
    cause the one about the right subject or the nearer place."""
    left, matched = list(findings), []
    for truth in truths:
        alike = [f for f in left if same_cause(truth, f["cause"])]
        best = min(alike, default=None,
                   key=lambda f: (subject_right(truth, f) is False, place_error_m(truth, f) or 0))
        matched.append(best)
        left = [f for f in left if f is not best]
    return matched


def gain_of(findings):
    """Held-out explained power that all findings add, None where none was measured."""
    pairs = [f["gain"]["explained_power"] for f in findings if f.get("gain")]
    pairs = [p for p in pairs if p.get("after") is not None and p.get("before") is not None]
    return sum(p["after"] - p["before"] for p in pairs) if pairs else None


def score(row, truths, findings):
    """Figures of one trial.

    truths: [{"cause", "parameters"}] as the generator tells them; findings: of findings.json, those of the untouched
    recording taken out where there is one. Returns a dict of what the row is judged by.
    """
    wrong = [f["cause"] for f in findings if wrong_with_confidence(truths, f)]
    result = {"alarm": bool(findings), "wrong": bool(wrong), "wrong_names": wrong, "gain": gain_of(findings)}
    if row == "clean":
        return result
    if row == "decoy":
        result["material_blamed"] = any(f["cause"] in MATERIAL_CAUSES for f in findings)
        return result
    if row == "outside":
        unknown = [f for f in findings if f["cause"] == "unknown"]
        tokens = VARIABLES[truths[0]["parameters"]["variable"]]
        result["unknown"] = bool(unknown)
        result["variable"] = any(t in named_variable(f) for f in unknown for t in tokens)
        errors = [place_error_m(truths[0], f) for f in unknown]
        if truths[0]["parameters"].get("x_m") is not None:
            result["place"] = min(errors, default=math.inf) <= PLACE_M
        return result
    matched = match(truths, findings)
    # The right cause of one thing more than there is.
    more = [f["cause"] for f in findings
            if any(f["cause"] == t["cause"] for t in truths) and not any(f is m for m in matched)]
    result["wrong_names"] += more
    result["wrong"] = bool(result["wrong_names"])
    result["named"] = [m is not None for m in matched]
    result["coverage"] = [c for t, m in zip(truths, matched) if m for c in coverage(t, m)]
    result["subjects"] = [s for s in (subject_right(t, m) for t, m in zip(truths, matched) if m) if s is not None]
    if row == "twice":
        result["told_apart"] = all(m is not None and subject_right(t, m) is not False
                                   and (place_error_m(t, m) or 0) <= PLACE_M for t, m in zip(truths, matched))
    if row in ("single", "later", "faint", "recording"):
        first = findings[0] if findings else None
        names = group(first) if first else {}
        result["first"] = first is not None and same_cause(truths[0], first["cause"])
        result["in_group"] = any(same_cause(truths[0], name) for name in names)
        result["group_size"] = len(names) if first else None
    return result
