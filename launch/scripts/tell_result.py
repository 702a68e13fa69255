#!/usr/bin/env python3
"""Says in plain sentences what a session hid, what diagnose found, and whether that is right.

usage: tell_result.py TRUTH_JSON FINDINGS_JSON

TRUTH_JSON is what make_session.py --truth wrote. Exit status: 0 every hidden cause was found, with each number inside its
95 % interval or within the tolerance that is said; 1 not so; 2 a file that cannot be read.
"""
import json
import sys

# Causes in words, for somebody who does not know the catalogue (docs/reference/causes.md); others go by their names.
SENTENCES = {
    "actor_moved": "{actor} stands {dx_m:+.2f} m along x and {dy_m:+.2f} m along y from where the scene has it",
    "actor_unmodelled": "at x {x_m:.2f} m, y {y_m:.2f} m stands an object that the scene lacks",
    "element_pattern": "the antennas' directivity is another than the twin assumes",
    "tx_rx_leakage": "the radar hears its own transmitter, as an echo at {range_m:.2f} m",
}
# A number may lie outside its interval by chance, one time in twenty. So far beside the truth it still counts as found;
# test_diagnosis.py holds the diagnosis to the same.
TOLERANCES = {
    ("actor_unmodelled", "x_m"): 0.1, ("actor_unmodelled", "y_m"): 0.1,
    ("element_pattern", "cos_exponent"): 0.6,
    ("tx_rx_leakage", "range_m"): 0.02, ("tx_rx_leakage", "level_db"): 1.2,
}
UNITS = {"_m": "m", "_db": "dB", "_deg": "deg"}


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def text_of(value):
    if isinstance(value, list):
        return "[" + ", ".join(text_of(v) for v in value) + "]"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def named(name, value):
    """"dx_m -0.137 m"."""
    unit = next((u for ending, u in UNITS.items() if name.endswith(ending)), "") if is_number(value) else ""
    return f"{name} {text_of(value)}{' ' + unit if unit else ''}"


def told(cause, values, details):
    """The cause in words, and below them its name with the details of its parameters."""
    exact = cause + (": " + "; ".join(details) if details else "")
    try:
        return f"{SENTENCES[cause].format(**values)}.\n        {exact}"
    except (KeyError, ValueError, TypeError):
        return exact


def hidden_text(effect):
    return told(effect["cause"], effect["parameters"], [named(*item) for item in effect["parameters"].items()])


def found_text(finding):
    details = []
    for name, parameter in finding["parameters"].items():
        text, interval = named(name, parameter["value"]), parameter.get("ci95")
        if interval and is_number(parameter["value"]):
            text += f" (95 %: {text_of(float(interval[0]))} to {text_of(float(interval[1]))})"
        details.append(text)
    return told(finding["cause"], {name: p["value"] for name, p in finding["parameters"].items()}, details)


def judge_parameter(cause, name, true, parameter):
    """(whether it is right, a sentence or None where there is nothing to say)."""
    if parameter is None:   # 0 is what a finding leaves out
        return (True, None) if is_number(true) and true == 0 else (False, f"{name} is not told.")
    value, interval = parameter["value"], parameter.get("ci95")
    if not is_number(true):
        return value == true, None if value == true else f"{name} is {text_of(true)}, not {text_of(value)}."
    if not is_number(value):
        return False, f"{name} is no number."
    if interval and interval[0] <= true <= interval[1]:
        return True, f"{name}: the hidden {text_of(float(true))} lies inside the interval."
    tolerance = TOLERANCES.get((cause, name))
    if tolerance is None:
        return False, f"{name}: the hidden {text_of(float(true))} lies outside the interval."
    off = abs(value - true)
    verdict = "is accepted" if off <= tolerance else "would be accepted"
    return off <= tolerance, f"{name}: {off:.2g} beside the hidden {text_of(float(true))}; up to {tolerance:g} {verdict}."


def judge(truth, findings):
    """(whether all is found, lines of text)."""
    right, lines, left = True, [], list(findings["findings"])
    for effect in truth["effects"]:
        lines.append(f"Hidden: {hidden_text(effect)}")
        finding = next((f for f in left if f["cause"] == effect["cause"]), None)
        if finding is None:
            right = False
            lines.append("Found:  not this")
            continue
        left.remove(finding)
        lines.append(f"Found:  {found_text(finding)}")
        for name, true in effect["parameters"].items():
            good, sentence = judge_parameter(effect["cause"], name, true, finding["parameters"].get(name))
            right = right and good
            if sentence:
                lines.append(f"        {sentence}")
        power = (finding.get("gain") or {}).get("explained_power") or {}
        if power.get("before") is not None and power.get("after") is not None:
            lines.append(f"        At places that the fit did not see, the twin explains {100 * power['after']:.0f} % of "
                         f"the measured power with it, {100 * power['before']:.0f} % without.")
    lines += [f"Also said: {found_text(finding)}" for finding in left]
    if not truth["effects"]:
        right = not findings["findings"]
        lines.insert(0, "Hidden: nothing")
    lines.append("The diagnosis is right." if right else "The diagnosis is NOT right.")
    return right, lines


def read(file, key):
    """The file's object, whose `key` is a list of findings or effects. ValueError, which names the file, for others."""
    try:
        with open(file, encoding="utf-8") as text:
            content = json.load(text)
    except OSError as error:
        raise ValueError(f"{file}: {error.strerror}") from None
    except RecursionError:
        raise ValueError(f"{file}: is nested too deep") from None
    except ValueError as error:
        raise ValueError(f"{file}: is no JSON: {error}") from None
    entries = content.get(key) if isinstance(content, dict) else None
    if not isinstance(entries, list):
        raise ValueError(f"{file}: has no list '{key}'")
    for entry in entries:
        if not isinstance(entry, dict) or not isinstance(entry.get("cause"), str) or \
                not isinstance(entry.get("parameters"), dict):
            raise ValueError(f"{file}: {key}: each must have a cause and parameters")
    return content


def is_interval(told):
    return isinstance(told, list) and len(told) == 2 and all(map(is_number, told))


def has_interval(parameter):
    """Whether ci95 is absent, an interval, or one for each number of a list."""
    told = parameter.get("ci95")
    if told is None or not isinstance(parameter["value"], list):
        return told is None or is_interval(told)
    return isinstance(told, list) and len(told) == len(parameter["value"]) and all(map(is_interval, told))


def read_findings(file):
    content = read(file, "findings")
    for finding in content["findings"]:
        for name, parameter in finding["parameters"].items():
            if not isinstance(parameter, dict) or "value" not in parameter or not has_interval(parameter):
                raise ValueError(f"{file}: findings: {finding['cause']}: {name}: must have a value, and two numbers as ci95")
        gain = finding.get("gain") or {}
        power = (gain.get("explained_power") or {}) if isinstance(gain, dict) else None
        if not isinstance(power, dict) or not all(power.get(key) is None or is_number(power[key])
                                                  for key in ("before", "after")):
            raise ValueError(f"{file}: findings: {finding['cause']}: gain: explained_power must hold numbers")
    return content


def main():
    if len(sys.argv) != 3 or sys.argv[1].startswith("-"):
        print(__doc__, file=sys.stderr if sys.argv[1:] not in (["--help"], ["-h"]) else sys.stdout)
        return 0 if sys.argv[1:] in (["--help"], ["-h"]) else 2
    try:
        right, lines = judge(read(sys.argv[1], "effects"), read_findings(sys.argv[2]))
    except ValueError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print("\n".join(lines))
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
