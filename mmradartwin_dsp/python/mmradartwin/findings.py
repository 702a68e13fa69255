"""findings.json of a diagnosis."""
from dataclasses import dataclass
import json
import os

import numpy as np

from mmradartwin.input_error import InputError
from mmradartwin.strict_yaml import read_text
from mmradartwin.tables import read_table

FORMAT = "mmradartwin_findings/1"
RECORDS_HEADER = ("pose,event,actors,amplitude_before_db,range_before_m,azimuth_before_deg,amplitude_after_db,range_after_m,"
                  "azimuth_after_deg")


@dataclass(frozen=True)
class Parameter:
    """One parameter of a finding, under the name and in the unit of its cause."""
    value: object              # float, float64 [n] of a list, str or list of str; NaN where the recording does not tell it
    unit: str                  # "" of a text
    ci95: np.ndarray = None    # [low, high], of a list [n][low, high]; None where there is none


@dataclass(frozen=True)
class Finding:
    """One entry of findings.json."""
    cause: str
    residual_class: str        # C1 to C5
    action: str
    parameters: dict           # Parameter by name
    mechanism: dict            # as it stands in the extended twin, None where nothing simulates it
    probability: dict          # by candidate cause: more than one where the data cannot tell them apart
    evidence: dict
    gain: dict                 # None with fewer than two locations
    where: list
    description: str           # "" where there is none
    changed_paths: dict        # columns of records/<cause>.csv by name, texts as lists; None without that file


@dataclass(frozen=True)
class Findings:
    """A findings.json."""
    verdict: str               # none, named or unknown
    poses: int
    locations: int
    findings: list             # Finding, by gain
    document: dict             # the whole of it


def read_findings(file):
    """Reads findings.json, or that of a folder, with records/ beside it; raises InputError."""
    if os.path.isdir(file):
        file = os.path.join(file, "findings.json")
    return findings_of(read_text(file), file)


def findings_of(text, file):
    """The findings of a text; file names it in errors."""
    try:
        document = json.loads(text)
    except json.JSONDecodeError as error:
        raise InputError(f"{file}: is no JSON ({error})") from None
    form = document.get("format") if isinstance(document, dict) else None
    if form != FORMAT:
        raise InputError(f"{file}: key format: '{form}' is unknown; allowed: {FORMAT}")
    try:
        return Findings(document["verdict"], document["poses"]["count"], document["poses"]["locations"],
                        [_finding(entry, os.path.dirname(file)) for entry in document["findings"]], document)
    except KeyError as error:
        raise InputError(f"{file}: key {error.args[0]} is missing") from None


def _finding(entry, folder):
    return Finding(cause=entry["cause"], residual_class=entry["class"], action=entry["action"],
                   parameters={name: _parameter(value) for name, value in entry["parameters"].items()},
                   mechanism=entry["mechanism"],
                   probability={candidate["cause"]: candidate["probability"] for candidate in entry["candidates"]},
                   evidence=entry["evidence"], gain=entry["gain"], where=entry["where"],
                   description=entry.get("description") or "", changed_paths=_changed_paths(entry, folder))


def _parameter(entry):
    value, ci95 = entry["value"], entry.get("ci95")
    if value is None or isinstance(value, (int, float)):
        value = float("nan") if value is None else float(value)
    elif isinstance(value, list) and not any(isinstance(one, str) for one in value):
        value = np.array(value, float)
    return Parameter(value, entry.get("unit", ""), None if ci95 is None else np.array(ci95, float))


def _changed_paths(entry, folder):
    name = os.path.splitext(os.path.basename(entry.get("figure") or ""))[0]
    file = os.path.join(folder, "records", name + ".csv")
    if not name or not os.path.exists(file):
        return None
    return read_table(file, RECORDS_HEADER, numbers=RECORDS_HEADER.split(",")[3:], empty_is_nan=True)
