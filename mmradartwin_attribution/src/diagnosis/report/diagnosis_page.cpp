#include "diagnosis/report/diagnosis_page.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "diagnosis/report/finding_words.h"
#include "mmradartwin_attribution/report.h"

namespace mmradartwin::diagnosis::report {
namespace {

constexpr std::size_t kMostRecords = 10;  ///< of a finding's table; all of them stand in its CSV file
constexpr int kMostHypotheses = 60;       ///< of the table; all of them stand in tried.csv
constexpr double kLeastShown_nats = 1;    ///< promise of the weakest hypothesis of the table
constexpr double kBarWidth_em = 10;       ///< of the hypothesis that promised most

std::string escaped(const std::string& text) {
  std::string out;
  for (char c : text) {
    if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";
    } else if (c == '&') {
      out += "&amp;";
    } else {
      out += c;
    }
  }
  return out;
}

struct GainRow {
  const char* name;
  const GainMetric* metric;
};

std::vector<GainRow> gainRows(const FindingGain& gain) {
  return {{"explained power", &gain.explained_power},
          {"log-likelihood per pose", &gain.log_likelihood_per_pose},
          {"recall", &gain.recall},
          {"recall, near", &gain.recall_band[0]},
          {"recall, mid", &gain.recall_band[1]},
          {"recall, far", &gain.recall_band[2]},
          {"Q1 energy", &gain.q1},
          {"Q2 energy", &gain.q2},
          {"Q3 median, dB", &gain.q3_median_db},
          {"C1", &gain.classes[0]},
          {"C2", &gain.classes[1]},
          {"C3", &gain.classes[2]},
          {"C4", &gain.classes[3]},
          {"C5", &gain.classes[4]}};
}

void writeAccuracy(const Findings& findings, std::ostream& html) {
  html << "<p>Stated accuracy of the ground (1 sigma), by which the session is judged:";
  const char* separator = " ";
  for (const AccuracyKey& key : accuracyKeys()) {
    html << separator << key.name << " " << shownNumber(findings.accuracy.*key.member);
    const auto estimate = findings.estimated.find(key.name);
    if (estimate != findings.estimated.end()) {
      html << " (the session shows " << shownNumber(estimate->second.value) << ")";
    }
    separator = ", ";
  }
  html << ".</p>";
  for (const std::string& sentence : shownFarWorse(findings)) html << "<p><b>" << escaped(sentence) << "</b></p>";
}

void writeHead(const Diagnosis& diagnosis, std::ostream& html) {
  html << "<!doctype html><meta charset=\"utf-8\"><title>Diagnosis</title><style>body{font:15px "
          "sans-serif;max-width:60em;"
          "margin:2em auto;color:#222}table{border-collapse:collapse;margin:.5em 0}td,th{padding:.2em "
          ".8em;text-align:right;"
          "border-bottom:1px solid #ddd}td:first-child,th:first-child{text-align:left}h2{margin-top:1.5em}"
          ".bar{background:#48c;height:.8em;display:inline-block}</style><h1>What the simulation gets wrong</h1>";
  html << "<p>Verdict <b>" << diagnosis.findings.verdict() << "</b>; " << diagnosis.findings.poses << " poses at "
       << diagnosis.findings.locations << " locations; held out: " << escaped(diagnosis.findings.held_out) << ". ";
  if (diagnosis.has_twin) {
    html << "The twin as given explains " << shownNumber(diagnosis.explained_power) << " of the measured power. "
         << "<a href=\"twin.extended.yaml\">twin.extended.yaml</a>, ";
  }
  html << "<a href=\"findings.json\">findings.json</a></p>";
  if (diagnosis.has_twin) writeAccuracy(diagnosis.findings, html);
  if (diagnosis.problems.empty()) return;
  html << "<p>Left out:</p><ul>";
  for (const PoseProblem& problem : diagnosis.problems) html << "<li>" << escaped(problem.message) << "</li>";
  html << "</ul>";
}

void writeEvidence(const Finding& finding, std::ostream& html) {
  html << "<p>Evidence: " << shownNumber(finding.evidence.log_likelihood_gain, 4) << " nats, false alarms at most "
       << shownNumber(finding.evidence.false_alarm_rate, 2);
  if (finding.evidence.runner_up) {
    html << "; next: " << *finding.evidence.runner_up << ", " << shownNumber(finding.evidence.margin.value_or(0), 4)
         << " nats less";
  }
  html << "</p>";
  if (finding.candidates.size() < 2) return;
  html << "<p>Not told apart:";
  for (const CauseProbability& candidate : finding.candidates) {
    html << " " << escaped(shownCandidate(candidate));
  }
  if (finding.experiment) html << ". To tell: " << escaped(*finding.experiment);
  html << "</p>";
}

void writePlace(const FindingPlace& place, std::ostream& html) {
  if (place.x_m && place.y_m) {
    html << "<p>At x = " << shownNumber(*place.x_m) << " m, y = " << shownNumber(*place.y_m) << " m in map</p>";
  }
  if (place.range_m && place.azimuth_deg) {
    html << "<p>Cells that carry it: " << shownNumber((*place.range_m)[0]) << " to " << shownNumber((*place.range_m)[1])
         << " m, " << shownNumber((*place.azimuth_deg)[0]) << " to " << shownNumber((*place.azimuth_deg)[1])
         << " deg</p>";
  }
  if (!place.actors.empty()) html << "<p>Actor: " << escaped(place.actors.front()) << "</p>";
  if (place.poses.empty()) return;
  html << "<p>Poses that carry it most:";
  for (const std::string& pose : place.poses) html << " " << escaped(pose);
  html << "</p>";
}

void writeGain(const FindingGain& gain, std::ostream& html) {
  html << "<table><tr><th>on held-out places</th><th>before</th><th>after</th><th>difference, 95 %</th></tr>";
  for (const GainRow& row : gainRows(gain)) {
    if (std::isnan(row.metric->before) && std::isnan(row.metric->after)) continue;
    html << "<tr><td>" << row.name << "</td><td>" << shownNumber(row.metric->before, 4) << "</td><td>"
         << shownNumber(row.metric->after, 4) << "</td><td>";
    if (row.metric->difference_ci95) {
      html << shownNumber((*row.metric->difference_ci95)[0]) << " to "
           << shownNumber((*row.metric->difference_ci95)[1]);
    }
    html << "</td></tr>";
  }
  html << "</table>";
}

void writeRecords(std::vector<ChangedRecord> records, std::ostream& html) {
  std::stable_sort(records.begin(), records.end(),
                   [](const ChangedRecord& a, const ChangedRecord& b) { return a.strongest_db() > b.strongest_db(); });
  html << "<table><tr><th>strongest paths that it changes</th><th>pose</th><th>dB "
          "before</th><th>m</th><th>deg</th><th>dB "
          "after</th><th>m</th><th>deg</th></tr>";
  for (std::size_t i = 0; i < std::min(kMostRecords, records.size()); ++i) {
    const ChangedRecord& record = records[i];
    html << "<tr><td>" << record.event << ", " << escaped(joined(record.actors)) << "</td><td>" << escaped(record.pose)
         << "</td><td>" << shownRecord(record.before, "</td><td>") << "</td><td>"
         << shownRecord(record.after, "</td><td>") << "</td></tr>";
  }
  html << "</table>";
}

void writeFinding(const Finding& finding, std::size_t number, const FindingFiles& files, std::ostream& html) {
  const CauseDescription& cause = causeDescription(finding.cause);
  html << "<h2>" << number << ". " << finding.cause << " (" << className(cause.residual_class)
       << ")</h2><p>Action: " << escaped(cause.action()) << "</p><ul>";
  for (const FindingParameter& parameter : finding.parameters) {
    html << "<li>" << escaped(shownParameter(parameter)) << "</li>";
  }
  for (const std::string& more : shownBesides(finding)) html << "<li>" << escaped(more) << "</li>";
  html << "</ul>";
  if (finding.description) html << "<p>" << escaped(*finding.description) << "</p>";
  writeEvidence(finding, html);
  for (const FindingPlace& place : finding.where) writePlace(place, html);
  html << "<p><a href=\"" << files.figure << "\"><img style=\"max-width:100%\" src=\"" << files.figure
       << "\" alt=\"figure of " << finding.cause << "\"></a></p>";
  if (finding.gain) writeGain(*finding.gain, html);
  if (files.records.empty()) return;
  writeRecords(finding.records, html);
  html << "<p>All of them: <a href=\"" << files.records << "\">" << files.records << "</a></p>";
}

void writeHypotheses(const std::vector<TriedHypothesis>& tried, std::ostream& html) {
  html << "<h2>Hypotheses</h2><p>Nats that the score test promised, and those that were "
          "fitted.</p><table><tr><th>hypothesis"
          "</th><th>round</th><th>promised</th><th>gain</th><th>what became of it</th><th></th></tr>";
  double most_nats = 1;
  for (const TriedHypothesis& hypothesis : tried) most_nats = std::max(most_nats, hypothesis.screened_nats);
  int rows = 0;
  for (const TriedHypothesis& hypothesis : tried) {
    if (hypothesis.screened_nats < kLeastShown_nats || ++rows > kMostHypotheses) continue;
    html << "<tr><td>" << escaped(hypothesis.label) << "</td><td>" << hypothesis.round + 1 << "</td><td>"
         << shownNumber(hypothesis.screened_nats, 4) << "</td><td>" << shownNumber(hypothesis.gain, 4) << "</td><td>"
         << escaped(hypothesis.verdict) << "</td><td><span class=\"bar\" style=\"width:"
         << kBarWidth_em * std::sqrt(std::max(0.0, hypothesis.screened_nats) / most_nats) << "em\"></span></td></tr>";
  }
  html << "</table>";
}

}  // namespace

std::string diagnosisPage(const Diagnosis& diagnosis, const std::vector<FindingFiles>& files,
                          const std::vector<std::string>& command) {
  std::ostringstream html;
  writeHead(diagnosis, html);
  for (std::size_t i = 0; i < diagnosis.findings.findings.size(); ++i) {
    writeFinding(diagnosis.findings.findings[i], i + 1, files[i], html);
  }
  writeHypotheses(diagnosis.tried, html);
  html << "<h2>Run</h2><p>mmradartwin " << escaped(packageVersion()) << "</p><pre>";
  for (const std::string& word : command) html << escaped(word) << " ";
  html << "</pre>";
  return html.str();
}

}  // namespace mmradartwin::diagnosis::report
