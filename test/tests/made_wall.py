"""A wall at x = 5.22 m, 6 m wide and 2.6 m high, as a PLY file."""

WALL = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 2
property list uchar int vertex_indices
end_header
5.22 -3 0
5.22 3 0
5.22 3 2.6
5.22 -3 2.6
3 0 2 1
3 0 3 2
"""
