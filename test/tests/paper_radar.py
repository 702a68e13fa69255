"""radar.yaml of the paper's radar, for any loops and frame period."""

PAPER_RADAR = """device: awr2243
carrier_hz: 77.0e+9
slope_hz_per_s: 75.0e+12
samples_per_chirp: 64
sample_rate_hz: 5.0e+6
adc_start_s: 6.0e-6
loops_per_frame: {loops}
frame_period_s: {frame_period_s}
tx_position_m: [[0, 0, 0], [0, 0.0077867, 0]]
rx_position_m: [[0, 0, 0], [0, 0.0019467, 0], [0, 0.0038934, 0], [0, 0.0058401, 0]]
"""
