#include "mmradartwin_attribution/diagnosis_report.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <map>
#include <sstream>

#include "diagnosis/catalogue/default_mechanism.h"
#include "diagnosis/report/finding_figure.h"
#include "mmradartwin_attribution/report.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/map_picture.h"

namespace mmradartwin {

using namespace diagnosis;

namespace {

namespace fs = std::filesystem;

std::string shown(double value, int digits = 3) {
  if (std::isnan(value)) return "-";
  std::ostringstream out;
  out << std::setprecision(digits) << value;
  return out.str();
}

std::string shown(const FindingParameter& p) {
  std::ostringstream out;
  out << p.name << " = ";
  if (const auto* number = std::get_if<double>(&p.value)) {
    out << shown(*number, 4) << (p.unit == "1" ? "" : " " + p.unit);
    if (!p.ci95.empty()) out << " (" << shown(p.ci95[0][0], 4) << " to " << shown(p.ci95[0][1], 4) << ")";
  } else if (const auto* text = std::get_if<std::string>(&p.value)) {
    out << *text;
  } else if (const auto* numbers = std::get_if<std::vector<double>>(&p.value)) {
    for (std::size_t i = 0; i < numbers->size(); ++i) out << (i ? ", " : "") << shown((*numbers)[i]);
    if (p.unit != "1") out << " " << p.unit;
  } else if (const auto* texts = std::get_if<std::vector<std::string>>(&p.value)) {
    for (std::size_t i = 0; i < texts->size(); ++i) out << (i ? ", " : "") << (*texts)[i];
  }
  return out.str();
}

/// What its mechanism needs beyond the cause's parameters: the shape of an object, when a gain steps and so on. Lists
/// of laws are left to findings.json, what stands as it does without being said is left out.
std::vector<std::string> shownBesides(const Finding& f) {
  std::vector<std::string> words;
  if (!f.mechanism || f.cause == "unknown") return words;
  const std::vector<CauseParameter>& own = causeDescription(f.cause).parameters;
  const Parameters standard = defaultMechanism(f.mechanism->mechanism).values;
  for (const auto& item : f.mechanism->values.all()) {
    const auto is_own = [&](const CauseParameter& p) { return p.name == item.first; };
    if (f.parameter(item.first) != nullptr || std::any_of(own.begin(), own.end(), is_own)) continue;  // told, or not it
    const auto* numbers = std::get_if<std::vector<double>>(&item.second);
    const auto* texts = std::get_if<std::vector<std::string>>(&item.second);
    if ((numbers && numbers->empty()) || (texts && texts->empty())) continue;
    const auto usual = standard.all().find(item.first);
    if (usual != standard.all().end() && usual->second == item.second) continue;
    words.push_back(shown(FindingParameter{item.first, "1", item.second, {}}));
  }
  return words;
}

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

std::vector<GainRow> gainRows(const FindingGain& g) {
  return {{"explained power", &g.explained_power},
          {"log-likelihood per pose", &g.log_likelihood_per_pose},
          {"recall", &g.recall},
          {"recall, near", &g.recall_band[0]},
          {"recall, mid", &g.recall_band[1]},
          {"recall, far", &g.recall_band[2]},
          {"Q1 energy", &g.q1},
          {"Q2 energy", &g.q2},
          {"Q3 median, dB", &g.q3_median_db},
          {"C1", &g.classes[0]},
          {"C2", &g.classes[1]},
          {"C3", &g.classes[2]},
          {"C4", &g.classes[3]},
          {"C5", &g.classes[4]}};
}

/// A field of a CSV line (RFC 4180).
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + "\"";
}

std::string joined(const std::vector<std::string>& names) {
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "" : ";") + name;
  return all;
}

/// Level, range and azimuth of a record, separated by `between`; empty fields where there is none.
std::string shown(const std::optional<RecordState>& s, const std::string& between) {
  if (!s) return between + between;
  return shown(s->amplitude_db, 4) + between + shown(s->range_m, 4) + between + shown(s->azimuth_deg, 4);
}

std::string recordsCsv(const std::vector<ChangedRecord>& records) {
  std::string csv =
      "pose,event,actors,amplitude_before_db,range_before_m,azimuth_before_deg,amplitude_after_db,range_after_m,"
      "azimuth_"
      "after_deg\n";
  for (const ChangedRecord& r : records) {
    csv += quoted(r.pose) + "," + r.event + "," + quoted(joined(r.actors)) + "," + shown(r.before, ",") + "," +
           shown(r.after, ",") + "\n";
  }
  return csv;
}

std::string recordsTable(std::vector<ChangedRecord> records) {
  constexpr std::size_t kShown = 10;
  std::stable_sort(records.begin(), records.end(),
                   [](const ChangedRecord& a, const ChangedRecord& b) { return a.strongest_db() > b.strongest_db(); });
  std::ostringstream html;
  html << "<table><tr><th>strongest paths that it changes</th><th>pose</th><th>dB "
          "before</th><th>m</th><th>deg</th><th>dB "
          "after</th><th>m</th><th>deg</th></tr>";
  for (std::size_t i = 0; i < std::min(kShown, records.size()); ++i) {
    const ChangedRecord& r = records[i];
    html << "<tr><td>" << r.event << ", " << escaped(joined(r.actors)) << "</td><td>" << escaped(r.pose) << "</td><td>"
         << shown(r.before, "</td><td>") << "</td><td>" << shown(r.after, "</td><td>") << "</td></tr>";
  }
  html << "</table>";
  return html.str();
}

void save(const std::string& file, const std::string& text) {
  std::ofstream out(file);
  out << text;
  out.flush();
  if (!out) throw InputError(file + ": cannot be written; check free space and rights");
}

void makeFolder(const std::string& directory) {
  std::error_code error;
  fs::create_directories(directory, error);
  if (error) throw InputError(directory + ": cannot be created (" + error.message() + "); choose another --output");
}

/// Takes away the figures and lists of an earlier diagnosis, which its findings.json names: beside a new one they would
/// tell of what was not found.
void removeEarlier(const fs::path& directory) {
  Findings earlier;
  try {
    earlier = readFindings((directory / "findings.json").string());
  } catch (const InputError&) {
    return;  // there is none, or it is someone else's
  }
  for (const Finding& f : earlier.findings) {
    const fs::path figure = f.figure.value_or("");
    if (figure.parent_path() != "figures") continue;
    std::error_code ignored;
    fs::remove(directory / figure, ignored);
    fs::remove(directory / "records" / figure.stem().concat(".csv"), ignored);
  }
}

}  // namespace

DiagnosisReport::DiagnosisReport(const std::string& directory) : directory_(directory) { makeFolder(directory); }

std::string diagnosisText(const Diagnosis& d) {
  std::ostringstream out;
  out << "Verdict: " << d.findings.verdict() << ", " << d.findings.poses << " poses at " << d.findings.locations
      << " locations";
  if (d.has_twin) {
    out << "; the twin as given explains " << shown(d.explained_power) << " of the measured power";
  }
  out << "\n";
  for (const ComparedTwin& t : d.compared) {
    out << t.file << " explains the same channels " << shown(std::abs(t.log_likelihood_gain), 5) << " nats "
        << (t.log_likelihood_gain < 0 ? "less" : "more") << " likely (" << shown(t.log_likelihood_gain_ci95[0], 5)
        << " to " << shown(t.log_likelihood_gain_ci95[1], 5) << " more by places) and " << shown(t.explained_power)
        << " of the measured power\n";
  }
  int i = 0;
  for (const Finding& f : d.findings.findings) {
    out << ++i << ". " << f.cause << " (" << className(causeDescription(f.cause).residual_class) << ")";
    for (const FindingParameter& p : f.parameters) out << ", " << shown(p);
    for (const std::string& more : shownBesides(f)) out << ", " << more;
    out << "\n";
    if (f.description) out << "   " << *f.description << "\n";
    if (f.gain) {
      const bool in_maps = !std::isnan(f.gain->explained_power.after);
      const GainMetric& e = in_maps ? f.gain->explained_power : f.gain->log_likelihood_per_pose;
      out << "   " << (in_maps ? "explained power" : "log-likelihood of the frames per pose") << " on held-out places "
          << shown(e.before) << " -> " << shown(e.after);
      if (e.difference_ci95) {
        out << " (difference " << shown((*e.difference_ci95)[0]) << " to " << shown((*e.difference_ci95)[1])
            << ", 95 %)";
      }
      if (!std::isnan(f.gain->recall.after)) {
        out << ", recall " << shown(f.gain->recall.before) << " -> " << shown(f.gain->recall.after);
      }
      out << "\n";
    }
    if (f.candidates.size() > 1) {
      out << "   not told apart:";
      for (const CauseProbability& c : f.candidates) out << " " << c.cause << " (" << shown(c.probability, 2) << ")";
      if (f.experiment) out << "; to tell: " << *f.experiment;
      out << "\n";
    }
  }
  return out.str();
}

void DiagnosisReport::write(const Diagnosis& diagnosis, const std::vector<std::string>& command) const {
  removeEarlier(directory_);
  Findings findings = diagnosis.findings;
  if (!findings.findings.empty()) makeFolder(directory_ + "/figures");
  std::map<std::string, int> times;
  std::vector<std::string> names;  // of a finding's files
  for (Finding& f : findings.findings) {
    const int time = ++times[f.cause];
    names.push_back(f.cause + (time > 1 ? "_" + std::to_string(time) : ""));
    f.figure = "figures/" + names.back() + ".png";
    writePicture(drawFinding(f, diagnosis.plan), directory_ + "/" + *f.figure);
    if (f.records.empty()) continue;
    makeFolder(directory_ + "/records");
    save(directory_ + "/records/" + names.back() + ".csv", recordsCsv(f.records));
  }
  if (diagnosis.has_twin) {
    findings.extended_twin = "twin.extended.yaml";
    save(directory_ + "/twin.extended.yaml", diagnosis.extended.toYaml());
  }
  writeFindings(findings, directory_ + "/findings.json");
  std::ostringstream tried;
  tried << "round,hypothesis,promised_nats,gain_nats,gain_without_best_place_nats,inflation,held_out_nats,false_alarm_"
           "rate,fitted,verdict\n";
  for (const TriedHypothesis& t : diagnosis.tried) {
    tried << t.round << "," << quoted(t.label) << "," << shown(t.screened_nats, 6) << ",";
    if (std::isnan(t.gain)) {
      tried << ",,,,,,";
    } else {
      tried << shown(t.gain, 6) << "," << shown(t.gain_without_best_place, 6) << "," << shown(t.overdispersion, 4)
            << "," << shown(t.held_out_gain, 6) << "," << shown(t.false_alarm_rate, 3) << "," << quoted(t.fitted)
            << ",";
    }
    tried << (t.verdict.empty() ? "" : quoted(t.verdict)) << "\n";
  }
  save(directory_ + "/tried.csv", tried.str());

  std::ostringstream html;
  html << "<!doctype html><meta charset=\"utf-8\"><title>Diagnosis</title><style>body{font:15px "
          "sans-serif;max-width:60em;"
          "margin:2em auto;color:#222}table{border-collapse:collapse;margin:.5em 0}td,th{padding:.2em "
          ".8em;text-align:right;"
          "border-bottom:1px solid #ddd}td:first-child,th:first-child{text-align:left}h2{margin-top:1.5em}"
          ".bar{background:#48c;height:.8em;display:inline-block}</style><h1>What the simulation gets wrong</h1>";
  html << "<p>Verdict <b>" << findings.verdict() << "</b>; " << findings.poses << " poses at " << findings.locations
       << " locations; held out: " << escaped(findings.held_out) << ". ";
  if (diagnosis.has_twin) {
    html << "The twin as given explains " << shown(diagnosis.explained_power) << " of the measured power. "
         << "<a href=\"twin.extended.yaml\">twin.extended.yaml</a>, ";
  }
  html << "<a href=\"findings.json\">findings.json</a></p>";
  if (!diagnosis.problems.empty()) {
    html << "<p>Left out:</p><ul>";
    for (const PoseProblem& problem : diagnosis.problems) html << "<li>" << escaped(problem.message) << "</li>";
    html << "</ul>";
  }
  int i = 0;
  for (const Finding& f : findings.findings) {
    const CauseDescription& cause = causeDescription(f.cause);
    html << "<h2>" << ++i << ". " << f.cause << " (" << className(cause.residual_class)
         << ")</h2><p>Action: " << escaped(cause.action()) << "</p><ul>";
    for (const FindingParameter& p : f.parameters) html << "<li>" << escaped(shown(p)) << "</li>";
    for (const std::string& more : shownBesides(f)) html << "<li>" << escaped(more) << "</li>";
    html << "</ul>";
    if (f.description) html << "<p>" << escaped(*f.description) << "</p>";
    html << "<p>Evidence: " << shown(f.evidence.log_likelihood_gain, 4) << " nats, false alarms at most "
         << shown(f.evidence.false_alarm_rate, 2);
    if (f.evidence.runner_up) {
      html << "; next: " << *f.evidence.runner_up << ", " << shown(f.evidence.margin.value_or(0), 4) << " nats less";
    }
    html << "</p>";
    if (f.candidates.size() > 1) {
      html << "<p>Not told apart:";
      for (const CauseProbability& c : f.candidates) html << " " << c.cause << " (" << shown(c.probability, 2) << ")";
      if (f.experiment) html << ". To tell: " << escaped(*f.experiment);
      html << "</p>";
    }
    for (const FindingPlace& place : f.where) {
      if (place.x_m && place.y_m) {
        html << "<p>At x = " << shown(*place.x_m) << " m, y = " << shown(*place.y_m) << " m in map</p>";
      }
      if (place.range_m && place.azimuth_deg) {
        html << "<p>Cells that carry it: " << shown((*place.range_m)[0]) << " to " << shown((*place.range_m)[1])
             << " m, " << shown((*place.azimuth_deg)[0]) << " to " << shown((*place.azimuth_deg)[1]) << " deg</p>";
      }
      if (!place.actors.empty()) html << "<p>Actor: " << escaped(place.actors.front()) << "</p>";
      if (!place.poses.empty()) {
        html << "<p>Poses that carry it most:";
        for (const std::string& pose : place.poses) html << " " << escaped(pose);
        html << "</p>";
      }
    }
    html << "<p><a href=\"" << *f.figure << "\"><img style=\"max-width:100%\" src=\"" << *f.figure
         << "\" alt=\"figure of " << f.cause << "\"></a></p>";
    if (f.gain) {
      html << "<table><tr><th>on held-out places</th><th>before</th><th>after</th><th>difference, 95 %</th></tr>";
      for (const GainRow& row : gainRows(*f.gain)) {
        if (std::isnan(row.metric->before) && std::isnan(row.metric->after)) continue;
        html << "<tr><td>" << row.name << "</td><td>" << shown(row.metric->before, 4) << "</td><td>"
             << shown(row.metric->after, 4) << "</td><td>";
        if (row.metric->difference_ci95) {
          html << shown((*row.metric->difference_ci95)[0]) << " to " << shown((*row.metric->difference_ci95)[1]);
        }
        html << "</td></tr>";
      }
      html << "</table>";
    }
    if (!f.records.empty()) {
      const std::string file = "records/" + names[static_cast<std::size_t>(i) - 1] + ".csv";
      html << recordsTable(f.records) << "<p>All of them: <a href=\"" << file << "\">" << file << "</a></p>";
    }
  }
  html << "<h2>Hypotheses</h2><p>Nats that the score test promised, and those that were "
          "fitted.</p><table><tr><th>hypothesis"
          "</th><th>round</th><th>promised</th><th>gain</th><th>what became of it</th><th></th></tr>";
  double most = 1;
  for (const TriedHypothesis& t : diagnosis.tried) most = std::max(most, t.screened_nats);
  int rows = 0;
  for (const TriedHypothesis& t : diagnosis.tried) {
    if (t.screened_nats < 1 || ++rows > 60) continue;
    html << "<tr><td>" << escaped(t.label) << "</td><td>" << t.round + 1 << "</td><td>" << shown(t.screened_nats, 4)
         << "</td><td>" << shown(t.gain, 4) << "</td><td>" << escaped(t.verdict)
         << "</td><td><span class=\"bar\" style=\"width:" << 10 * std::sqrt(std::max(0.0, t.screened_nats) / most)
         << "em\"></span></td></tr>";
  }
  html << "</table><h2>Run</h2><p>mmradartwin " << escaped(packageVersion()) << "</p><pre>";
  for (const std::string& word : command) html << escaped(word) << " ";
  html << "</pre>";
  save(directory_ + "/index.html", html.str());
}

}  // namespace mmradartwin
