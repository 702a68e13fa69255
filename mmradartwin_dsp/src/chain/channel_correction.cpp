#include "mmradartwin_dsp/channel_correction.h"

#include <cmath>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/strict_yaml.h"

namespace mmradartwin {
namespace {

const char* const kFormat = "mmradartwin_channels/1";

}  // namespace

std::complex<double> ChannelCorrection::error(std::size_t k) const {
  return std::polar(std::pow(10.0, gain_db[k] / 20), phase_deg[k] * M_PI / 180);
}

ChannelCorrection loadChannelCorrection(const std::string& file) {
  YamlMap yaml = YamlMap::load(file);
  yaml.choice("format", {kFormat});
  ChannelCorrection correction;
  correction.file = file;
  correction.phase_deg = yaml.numbers("phase_deg", -360, 360);
  correction.gain_db = yaml.numbers("gain_db", -60, 60);
  if (correction.phase_deg.size() != correction.gain_db.size()) {
    yaml.fail("gain_db", "has " + std::to_string(correction.gain_db.size()) + " numbers, phase_deg " +
                             std::to_string(correction.phase_deg.size()) + "; give one per virtual channel in both");
  }
  yaml.rejectUnknownKeys();
  return correction;
}

void requireChannelsOf(const RadarConfig& radar, const ChannelCorrection& correction) {
  if (correction.phase_deg.size() == static_cast<std::size_t>(radar.channels())) return;
  throw InputError(correction.file + ": key phase_deg: has " + std::to_string(correction.phase_deg.size()) +
                   " numbers; the radar has " + std::to_string(radar.channels()) +
                   " virtual channels: give the file that was calibrated with this radar");
}

ChannelCorrection loadChannelCorrection(const std::string& file, const RadarConfig& radar) {
  ChannelCorrection correction = loadChannelCorrection(file);
  requireChannelsOf(radar, correction);
  return correction;
}

std::string toYaml(const ChannelCorrection& correction) {
  std::ostringstream out;
  out << "format: " << kFormat << "\n";
  const auto list = [&out](const char* key, const std::vector<double>& values) {
    out << key << ": [";
    for (std::size_t k = 0; k < values.size(); ++k) out << (k ? ", " : "") << yamlNumber(values[k]);
    out << "]\n";
  };
  list("phase_deg", correction.phase_deg);
  list("gain_db", correction.gain_db);
  return out.str();
}

void correctChannels(const ChannelCorrection& correction, ComplexGrid& x) {
  for (Eigen::Index k = 0; k < x.rows(); ++k) x.row(k) /= correction.error(static_cast<std::size_t>(k));
}

}  // namespace mmradartwin
