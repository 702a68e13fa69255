#pragma once

#include <complex>
#include <string>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/receive_grid.h"

namespace mmradartwin {

/// Errors of the virtual channels as a calibration found them, which the measured branch takes out before the angle
/// transform. A twin that has the same error as `channel_phase_error` must not be compared with what was corrected.
struct ChannelCorrection {
  std::string file;               ///< it was read from, for errors
  std::vector<double> phase_deg;  ///< [M] x_k arrives turned by this
  std::vector<double> gain_db;    ///< [M] and this much stronger
  std::complex<double> error(std::size_t k) const;
};

/// Reads a channels.yaml strictly: `format: mmradartwin_channels/1`, `phase_deg` and `gain_db`, a number per virtual
/// channel each. Throws InputError.
ChannelCorrection loadChannelCorrection(const std::string& file);
/// Throws InputError where the radar has another number of virtual channels.
void requireChannelsOf(const RadarConfig& radar, const ChannelCorrection& correction);
/// Both.
ChannelCorrection loadChannelCorrection(const std::string& file, const RadarConfig& radar);
/// The text of a channels.yaml that reads back as `correction`.
std::string toYaml(const ChannelCorrection& correction);

/// Divides each channel of x [M][N] by its error.
void correctChannels(const ChannelCorrection& correction, ComplexGrid& x);

}  // namespace mmradartwin
