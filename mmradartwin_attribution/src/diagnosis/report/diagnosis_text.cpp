#include <cmath>
#include <sstream>

#include "diagnosis/report/finding_words.h"
#include "mmradartwin_attribution/diagnosis_report.h"

namespace mmradartwin {

using namespace diagnosis;

namespace {

std::string gainText(const FindingGain& gain) {
  std::ostringstream out;
  const bool in_maps = !std::isnan(gain.explained_power.after);
  const GainMetric& metric = in_maps ? gain.explained_power : gain.log_likelihood_per_pose;
  out << "   " << (in_maps ? "explained power" : "log-likelihood of the frames per pose") << " on held-out places "
      << shownNumber(metric.before) << " -> " << shownNumber(metric.after);
  if (metric.difference_ci95) {
    out << " (difference " << shownNumber((*metric.difference_ci95)[0]) << " to "
        << shownNumber((*metric.difference_ci95)[1]) << ", 95 %)";
  }
  if (!std::isnan(gain.recall.after)) {
    out << ", recall " << shownNumber(gain.recall.before) << " -> " << shownNumber(gain.recall.after);
  }
  out << "\n";
  return out.str();
}

std::string findingText(const Finding& finding, int number) {
  std::ostringstream out;
  out << number << ". " << finding.cause << " (" << className(causeDescription(finding.cause).residual_class) << ")";
  for (const FindingParameter& parameter : finding.parameters) out << ", " << shownParameter(parameter);
  for (const std::string& more : shownBesides(finding)) out << ", " << more;
  out << "\n";
  if (finding.description) out << "   " << *finding.description << "\n";
  if (finding.gain) out << gainText(*finding.gain);
  if (finding.candidates.size() > 1) {
    out << "   not told apart:";
    for (const CauseProbability& candidate : finding.candidates) {
      out << " " << shownCandidate(candidate);
    }
    if (finding.experiment) out << "; to tell: " << *finding.experiment;
    out << "\n";
  }
  return out.str();
}

}  // namespace

std::string diagnosisText(const Diagnosis& diagnosis) {
  std::ostringstream out;
  out << "Verdict: " << diagnosis.findings.verdict() << ", " << diagnosis.findings.poses << " poses at "
      << diagnosis.findings.locations << " locations";
  if (diagnosis.has_twin) {
    out << "; the twin as given explains " << shownNumber(diagnosis.explained_power) << " of the measured power";
  }
  out << "\n";
  for (const ComparedTwin& twin : diagnosis.compared) {
    out << twin.file << " explains the same channels " << shownNumber(std::abs(twin.log_likelihood_gain), 5) << " nats "
        << (twin.log_likelihood_gain < 0 ? "less" : "more") << " likely ("
        << shownNumber(twin.log_likelihood_gain_ci95[0], 5) << " to "
        << shownNumber(twin.log_likelihood_gain_ci95[1], 5) << " more by places) and "
        << shownNumber(twin.explained_power) << " of the measured power\n";
  }
  for (const std::string& sentence : shownJudgedBy(diagnosis)) out << sentence << "\n";
  int number = 0;
  for (const Finding& finding : diagnosis.findings.findings) out << findingText(finding, ++number);
  return out.str();
}

}  // namespace mmradartwin
