#include "diagnosis/unexplained_frames.h"

#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "diagnosis/gain/held_out_gain.h"
#include "diagnosis/likelihood/expected_echoes.h"
#include "diagnosis/receiver/receiver_findings.h"
#include "diagnosis/receiver/strongest_echo.h"

namespace mmradartwin::diagnosis {

void addUnexplained(const std::vector<FrameFinding>& frames, const ChannelData& data,
                    const std::vector<NamedParameters>& stated, Findings& findings,
                    std::vector<NamedParameters>& extended) {
  for (const FrameFinding& frame : frames) {
    Finding f = findingOf(frame);
    if (f.mechanism && f.mechanism->values.has("level_db")) {
      // Of full scale, as the data are, and over the strongest echo.
      const double over_db = 20 * std::log10(32768 * strongestMeasured(data));
      f.mechanism->values.set("level_db", f.mechanism->values.number("level_db") - over_db);
    }
    if (!differsFromStated(f, stated)) continue;
    if (f.mechanism) replaceOrAppend(*f.mechanism, extended);
    if (!findings.findings.empty() && findings.findings.back().cause == "unknown") {
      std::optional<std::string>& said = findings.findings.back().description;
      said = said.value_or("") + "; besides: " + frame.description;
      continue;
    }
    addGainInNats(data, frame.nats_by_pose, f);
    findings.findings.push_back(std::move(f));
  }
}

}  // namespace mmradartwin::diagnosis
