"""The blind protocol: hides effects in sessions, seals the truth, runs the diagnosis and scores what it returns."""
