#include "diagnosis/unexplained_frames.h"

#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "diagnosis/echoes/expected_echoes.h"
#include "diagnosis/gain/held_out_gain.h"
#include "diagnosis/receiver/receiver_findings.h"
#include "diagnosis/receiver/strongest_echo.h"

namespace mmradartwin::diagnosis {
namespace {

constexpr double kCountsPerFullScale = 32768;  ///< of a 16-bit converter, to either side

}  // namespace

void addUnexplained(const std::vector<FrameFinding>& frames, const ChannelData& data,
                    const std::vector<NamedParameters>& stated, Findings& findings,
                    std::vector<NamedParameters>& extended) {
  for (const FrameFinding& frame : frames) {
    Finding finding = findingOf(frame);
    if (finding.mechanism && finding.mechanism->values.has("level_db")) {
      // The examiner gives levels over one ADC count, the twin over the strongest echo; data are in full scales.
      const double over_db = 20 * std::log10(kCountsPerFullScale * strongestMeasured(data));
      finding.mechanism->values.set("level_db", finding.mechanism->values.number("level_db") - over_db);
    }
    if (!differsFromStated(finding, stated)) continue;
    if (finding.mechanism) replaceOrAppend(*finding.mechanism, extended);
    if (!findings.findings.empty() && findings.findings.back().cause == "unknown") {
      std::optional<std::string>& description = findings.findings.back().description;
      description = description.value_or("") + "; besides: " + frame.description;
      continue;
    }
    addGainInNats(data, frame.nats_by_pose, finding);
    findings.findings.push_back(std::move(finding));
  }
}

}  // namespace mmradartwin::diagnosis
