"""Scans of known rooms as phones, scanners and reconstructions leave them. Nothing here is shared with the product."""
