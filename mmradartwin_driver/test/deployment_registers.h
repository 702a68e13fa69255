#pragma once

#include "awr2243/awr2243_quantised.h"

namespace mmradartwin {

/// The paper's deployment in the device's units.
inline Awr2243Registers deploymentRegisters() {
  Awr2243Registers registers;
  registers.start_frequency = 1435384036;
  registers.slope = 1553;
  registers.idle = 700;
  registers.adc_start = 600;
  registers.ramp_end = 2000;
  registers.samples = 64;
  registers.sample_rate_ksps = 5000;
  registers.rx_gain_db = 40;
  registers.rx_mask = 0xF;
  registers.chirp_tx_mask = {1, 4};
  registers.loops = 1;
  registers.frame_period = 10000000;
  return registers;
}

}  // namespace mmradartwin
