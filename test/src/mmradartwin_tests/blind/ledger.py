"""Truths of a blind test, sealed before the diagnosis runs.

Every truth is a file of its own; the ledger holds its SHA-256, one JSON object a line, each line with the SHA-256 of
the line before, so that nothing can be taken out or changed later without being seen.
"""
import hashlib
import json
import os
import time


class LedgerError(ValueError):
    """A truth or the ledger is not what was sealed."""


def canonical(truth):
    """Bytes of a truth: keys sorted, so that equal truths have equal hashes."""
    return (json.dumps(truth, sort_keys=True, indent=1) + "\n").encode("utf-8")


class Ledger:
    """Of one output directory: ledger.jsonl and truth/KEY.json.

    LedgerError on opening where a line of the ledger does not follow from those before it.
    """

    def __init__(self, directory):
        self.file = os.path.join(directory, "ledger.jsonl")
        self.folder = os.path.join(directory, "truth")
        os.makedirs(self.folder, exist_ok=True)
        self.hashes, self.last = {}, ""
        if os.path.exists(self.file):
            with open(self.file, "rb") as stream:
                data = stream.read()
            whole = data[:data.rfind(b"\n") + 1]
            if len(whole) < len(data):    # the machine stopped while it was written, before any diagnosis
                os.truncate(self.file, len(whole))
            for number, line in enumerate(whole.splitlines(keepends=True), 1):
                self._take(line, number)

    def _take(self, line, number):
        try:
            entry = json.loads(line)
            key, digest, previous = entry["key"], entry["sha256"], entry["previous"]
        except (ValueError, KeyError, TypeError):
            raise LedgerError(f"{self.file}: line {number} is no entry; start again with another --output") from None
        if previous != self.last or key in self.hashes:
            raise LedgerError(f"{self.file}: line {number} does not follow from those before it; the ledger was "
                              "changed after it was written: start again with another --output")
        self.hashes[key] = digest
        self.last = hashlib.sha256(line).hexdigest()

    def truth_file(self, key):
        """Where the truth of a trial stands."""
        return os.path.join(self.folder, key + ".json")

    def seal(self, key, truth):
        """Writes a truth and enters its hash. A trial that was interrupted may be sealed again, with the same truth."""
        data = canonical(truth)
        digest = hashlib.sha256(data).hexdigest()
        if key in self.hashes and self.hashes[key] != digest:
            raise LedgerError(f"{self.file}: trial {key} was sealed with another truth; the generator has changed "
                              "since: start again with another --output or --seed")
        with open(self.truth_file(key), "wb") as out:
            out.write(data)
        if key in self.hashes:
            return
        entry = {"key": key, "sha256": digest, "time": round(time.time(), 3), "previous": self.last}
        line = (json.dumps(entry) + "\n").encode("utf-8")
        with open(self.file, "ab") as out:
            out.write(line)
            out.flush()
            os.fsync(out.fileno())
        self._take(line, len(self.hashes) + 1)

    def open(self, key):
        """The truth of a sealed trial; LedgerError where it was not sealed, is gone or was changed."""
        if key not in self.hashes:
            raise LedgerError(f"{self.file}: trial {key} was never sealed")
        try:
            with open(self.truth_file(key), "rb") as file:
                data = file.read()
        except FileNotFoundError:
            raise LedgerError(f"{self.truth_file(key)}: is missing; the ledger has its hash") from None
        if hashlib.sha256(data).hexdigest() != self.hashes[key]:
            raise LedgerError(f"{self.truth_file(key)}: is not what was sealed; its result cannot be used")
        return json.loads(data)
