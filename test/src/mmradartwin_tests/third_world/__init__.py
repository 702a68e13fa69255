"""A third world: rooms of rough patches whose echoes are sums of physical optics, measured by a radar that is not ideal.

It shares the writer of session files with the generator of this package, and no tracing, physics or radar with it.
"""
