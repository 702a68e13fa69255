#pragma once

#include <string>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

struct ImportedSettings {
  RadarConfig radar;
  std::vector<std::string> assumed;  ///< lines: what the files do not say, and what radar.yaml has instead
};

/// Reads the settings of TI's tools, known by what the files hold: a mmWave Studio Lua script, mmWave Studio's XML
/// (which keeps the chirps that were set last only, so that a frame of several transmitters needs another file) or JSON
/// (*.mmwave.json; a setup.json names one), the commands of the mmWave SDK's demos (profile.cfg), and the DCA1000's
/// cf.json (its lanes), in any combination as long as one of them holds the radar's profile, chirps and frame.
///
/// A script is run, without access to anything but its own text, and what it gives to ar1.* counts. It is told that it
/// runs on the device that `device` or another file names. Two places that contradict each other are an error, as is
/// everything whose meaning is not known for certain: a profile that changes from chirp to chirp, several transmitters
/// at once (BPM, DDMA), shifted phases, real samples, fewer than 16 bits, further packets, advanced frames.
///
/// No file of TI's says where the antennas are: positions are those of the BOOST boards, receivers half a wavelength
/// (at the chirp's start) apart; with three transmitters TX0 at 0, TX2 four and TX1 two halves along y, TX1 one half
/// higher; with two, TX1 four halves along y. A device with other antennas (AOP, ODS) is refused. They are listed in
/// `assumed`. `device` names it where no file does. Argument orders: mmWave Studio's own help on the ar1 functions, and
/// mmWaveLink's structures. Throws InputError.
ImportedSettings importSettings(const std::vector<std::string>& files, const std::string& device = "");

/// radar.yaml with what was assumed as comments at its head.
std::string toYaml(const ImportedSettings& settings);

}  // namespace mmradartwin
