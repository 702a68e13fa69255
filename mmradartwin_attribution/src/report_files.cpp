#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

#include "mmradartwin_attribution/report.h"
#include "mmradartwin_dsp/statistics.h"
#include "mmradartwin_dsp/text.h"
#include "mmradartwin_dsp/units.h"

namespace mmradartwin {
namespace {

// A text file that reports when it could not be written.
class OutputFile {
 public:
  explicit OutputFile(const std::string& file) : file_(file), out_(file, std::ios::trunc) {}
  std::ofstream& stream() { return out_; }
  void close() {
    out_.close();
    if (!out_) throw std::runtime_error(file_ + ": cannot be written; check folder, rights and free space");
  }

 private:
  std::string file_;
  std::ofstream out_;
};

std::string number(double value, int digits = 3) { return fixedNumber(value, digits); }

nlohmann::json json(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr); }

nlohmann::json json(const LedgerSummary& s) {
  nlohmann::json j;
  j["poses"] = s.poses;
  for (const ResidualMetric& metric : kResidualMetrics) j[metric.name] = json(s.*metric.member);
  for (int i = 0; i < 3; ++i) {
    const char* bands[] = {"near", "mid", "far"};
    j["recall_by_band"][bands[i]] = {
        {"recall", json(s.recall_band[i])}, {"active", s.active[i]}, {"recalled", s.recalled[i]}};
    j["top"].push_back(json(s.top[i]));
  }
  j["q3_cells"] = s.q3_cells;
  for (int i = 0; i < 5; ++i) {
    j["classes"]["C" + std::to_string(i + 1)] = {{"count", s.class_count[i]}, {"share", json(s.class_share[i])}};
  }
  return j;
}

std::string pictureLink(const ReportWriter& writer, const std::string& pose) {
  return "pictures/" + std::filesystem::path(writer.pictureFile(pose)).filename().string();
}

}  // namespace

void ReportWriter::writePoses(const Evaluation& evaluation, const AttributionConfig& config) const {
  OutputFile file(directory_ + "/poses.csv");
  std::ofstream& out = file.stream();
  out << "pose,location,stamp,x_m,y_m,z_m,heading_deg,frames,regions,active,recalled,active_near,recalled_near,active_"
         "mid,"
         "recalled_mid,active_far,recalled_far";
  for (int k : config.top_k) out << ",top" << k << "_hits,top" << k << "_count";
  for (const PoseColumn& column : poseColumns()) out << ',' << column.name;
  out << ",c1,c2,c3,c4,c5,measured_peak_dbfs,"
         "outer_active,outer_recalled,outer_peak_db,agreement,agreement_channel_conjugated,agreement_iq_conjugated,"
         "conjugated_better\n";
  for (const PoseResult& p : evaluation.poses) {
    if (!p.used) continue;
    const FieldMetrics &m = p.attribution.central, &o = p.attribution.outer;
    const Eigen::Vector3d t = p.pose.T_map_radar.translation(), x = p.pose.T_map_radar.linear().col(0);
    out << csvField(p.pose.name) << ',' << csvField(p.pose.location) << ',' << formatStamp(p.pose.stamp_ns) << ','
        << number(t.x(), 4) << ',' << number(t.y(), 4) << ',' << number(t.z(), 4) << ','
        << number(std::atan2(x.y(), x.x()) / kDegree, 2) << ',' << p.frames << ',' << p.attribution.regions.size()
        << ',' << m.active[0] + m.active[1] + m.active[2] << ',' << m.recalled[0] + m.recalled[1] + m.recalled[2];
    for (int i = 0; i < 3; ++i) out << ',' << m.active[i] << ',' << m.recalled[i];
    for (int i = 0; i < 3; ++i) out << ',' << m.top_hits[i] << ',' << m.top_count[i];
    for (const PoseColumn& column : poseColumns()) out << ',' << column.text(m);
    for (int count : m.class_count) out << ',' << count;
    const ConventionCheck& c = p.attribution.convention;
    out << ',' << number(p.attribution.measured.peak_db) << ',' << o.active[0] + o.active[1] + o.active[2] << ','
        << o.recalled[0] + o.recalled[1] + o.recalled[2] << ',' << number(o.measured_peak_db) << ','
        << number(c.as_recorded, 4) << ',' << number(c.channel_conjugated, 4) << ',' << number(c.iq_conjugated, 4)
        << ',' << (c.conjugatedBetter() ? 1 : 0) << '\n';
  }
  file.close();
}

void ReportWriter::writeResiduals(const Evaluation& evaluation) const {
  OutputFile file(directory_ + "/residuals.csv"), record_file(directory_ + "/residual_records.csv");
  std::ofstream &out = file.stream(), &records = record_file.stream();
  out << "pose,class,label,action,material_change,stronger,range_m,azimuth_deg,measured_db,simulated_db,actor,material,"
         "region_kind,records\n";
  records << "pose,record,event,range_m,azimuth_dep_deg,azimuth_arr_deg,bounces,amplitude_db\n";
  for (const PoseResult& p : evaluation.poses) {
    for (const Residual& r : p.attribution.residuals) {
      out << csvField(p.pose.name) << ',' << className(r.residual_class) << ',' << classLabel(r.residual_class) << ','
          << csvField(classAction(r.residual_class)) << ','
          << (materialChangeAdmissible(r.residual_class) ? "yes" : "no") << ','
          << (r.measured_stronger ? "measured" : "simulated") << ',' << number(r.range_m) << ','
          << number(r.azimuth_rad / kDegree, 2) << ',' << number(r.measured_db, 2) << ',' << number(r.simulated_db, 2)
          << ',' << csvField(r.actor) << ',' << csvField(r.material) << ','
          << (r.region >= 0 ? regionKindName(p.attribution.regions[r.region].kind) : "") << ',';
      for (std::size_t i = 0; i < r.records.size(); ++i) out << (i ? ";" : "") << r.records[i];
      out << '\n';
    }
    for (const auto& [index, record] : p.residual_records) {
      records << csvField(p.pose.name) << ',' << index << ',' << (record.event ? *record.event : "") << ','
              << number(record.length_m.front() / 2) << ','
              << number(std::atan2(record.departure.y(), record.departure.x()) / kDegree, 2) << ','
              << number(std::atan2(record.arrival.y(), record.arrival.x()) / kDegree, 2) << ',' << record.bounces << ','
              << number(20 * std::log10(record.amplitude), 2) << '\n';
    }
  }
  file.close();
  record_file.close();
}

void ReportWriter::writeRegions(const Evaluation& evaluation) const {
  OutputFile file(directory_ + "/regions.csv");
  std::ofstream& out = file.stream();
  out << "pose,range_m,azimuth_deg,kind,actor,material,field,measured_strong,simulated_strong,support_db,x_m,y_m,z_m\n";
  for (const PoseResult& p : evaluation.poses) {
    for (const ResponseRegion& r : p.attribution.regions) {
      out << csvField(p.pose.name) << ',' << number(r.range_m) << ',' << number(r.azimuth_rad / kDegree, 2) << ','
          << regionKindName(r.kind) << ',' << csvField(r.actor) << ',' << csvField(r.material) << ','
          << (r.field == Field::kCentral ? "central" : "outer") << ',' << (r.measured_strong ? 1 : 0) << ','
          << (r.simulated_strong ? 1 : 0) << ',' << (r.kind == RegionKind::kExtent ? "" : number(r.support_db, 1))
          << ',' << number(r.point.x()) << ',' << number(r.point.y()) << ',' << number(r.point.z()) << '\n';
    }
  }
  file.close();
}

void ReportWriter::writeSummary(const Evaluation& evaluation, const AttributionConfig& config,
                                const RunDescription& run) const {
  nlohmann::json j;
  j["format"] = "mmradartwin_evaluation/1";
  j["version"] = run.version;
  j["command"] = run.command;
  j["recording"] = run.recording;
  j["simulated"] = run.simulated;
  j["central"] = json(evaluation.central);
  j["central"]["max_azimuth_deg"] = config.max_azimuth_rad / kDegree;
  j["outer"] = json(evaluation.outer);
  j["outer"].erase("classes");
  j["convention"] = {{"poses_where_conjugated_agrees_better", evaluation.conjugated_better}};
  j["duplicates"] = evaluation.duplicates;
  j["problems"] = nlohmann::json::array();
  for (const PoseProblem& p : evaluation.problems) j["problems"].push_back({{"pose", p.pose}, {"message", p.message}});
  j["configuration"] = {{"attribution", "attribution.yaml"}, {"radar", "radar.yaml"}};
  if (!run.twin_yaml.empty()) j["configuration"]["twin"] = "twin.yaml";
  j["inputs"] = nlohmann::json::array();
  for (const InputFile& f : run.inputs) j["inputs"].push_back({{"file", f.file}, {"sha256", f.sha256}});
  OutputFile file(directory_ + "/summary.json");
  file.stream() << j.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
  file.close();
}

namespace {

/// Writes the command, the configuration and the inputs of the evaluation.
void writeHowToRepeat(const RunDescription& run, std::ostream& out) {
  out << "<h2>How to repeat this</h2>\n<pre>";
  for (const std::string& word : run.command) out << htmlEscape(word) << ' ';
  out << "</pre>\n<p>Files: <a href=\"table.txt\">table.txt</a>, <a href=\"summary.json\">summary.json</a>, <a "
         "href=\"poses.csv\">poses.csv</a>, <a href=\"residuals.csv\">residuals.csv</a>, <a "
         "href=\"residual_records.csv\">residual_records.csv</a>, <a href=\"regions.csv\">regions.csv</a></p>\n"
      << "<details><summary>attribution.yaml</summary><pre>" << htmlEscape(run.attribution_yaml) << "</pre></details>\n"
      << "<details><summary>radar.yaml</summary><pre>" << htmlEscape(run.radar_yaml) << "</pre></details>\n";
  if (!run.twin_yaml.empty()) {
    out << "<details><summary>twin.yaml</summary><pre>" << htmlEscape(run.twin_yaml) << "</pre></details>\n";
  }
  out << "<details><summary>" << run.inputs.size() << " input files (SHA-256)</summary><pre>";
  for (const InputFile& f : run.inputs) out << f.sha256 << "  " << htmlEscape(f.file) << '\n';
  out << "</pre></details>\n</body></html>\n";
}

}  // namespace

void ReportWriter::writeHtml(const Evaluation& evaluation, const AttributionConfig& config,
                             const RunDescription& run) const {
  OutputFile file(directory_ + "/index.html");
  std::ofstream& out = file.stream();
  out << "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>mmradartwin evaluation</title>\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><style>\n"
         "body{font:15px/1.45 system-ui,sans-serif;max-width:1400px;margin:2em auto;padding:0 1em;color:#222}\n"
         "table{border-collapse:collapse;margin:1em 0}td,th{padding:.25em .9em;text-align:left;vertical-align:top}\n"
         "thead tr{border-top:2px solid #222;border-bottom:1px solid #222}tbody{border-bottom:2px solid #222}\n"
         "td.n{text-align:right;font-variant-numeric:tabular-nums}img{max-width:100%;height:auto}\n"
         "figure{margin:1.5em 0;padding:.6em;border:1px solid #ddd}figcaption{font-size:.92em;color:#444}\n"
         "nav{columns:12 "
         "5em;font-size:.9em}code,pre{background:#f4f4f4;font-size:.88em}pre{padding:.8em;overflow:auto}\n"
         ".warn{background:#fff3d6;padding:.6em 1em}</style></head><body>\n<h1>Measured and simulated radar, "
         "compared</h1>\n";
  out << "<p>" << evaluation.central.poses << " poses of <code>" << htmlEscape(run.recording)
      << "</code>, simulated side: <code>" << htmlEscape(run.simulated) << "</code>. Version "
      << htmlEscape(run.version) << ".</p>\n";
  out << "<h2>Evaluation summary, central field of view &plusmn;" << number(config.max_azimuth_rad / kDegree, 0)
      << "&deg;</h2>\n<table><thead><tr><th>Target</th><th>Metric</th><th>Result</th></tr></thead><tbody>\n";
  for (const auto& row : tableRows(evaluation.central, config.top_k)) {
    out << "<tr><td>" << htmlEscape(row[0]) << "</td><td>" << htmlEscape(row[1]) << "</td><td>" << htmlEscape(row[2])
        << "</td></tr>\n";
  }
  out << "</tbody></table>\n<p>Recall: overall; near (" << number(config.min_range_m, 2) << "&ndash;"
      << number(config.near_limit_m, 1) << " m) / mid (&ndash;" << number(config.far_limit_m, 1)
      << " m) / far. The background figure is a sanity check and claims nothing.</p>\n"
      << "<h2>Residual classes and what they "
         "permit</h2>\n<table><thead><tr><th>Class</th><th>Residuals</th><th>Share</th>"
         "<th>Action or limitation tag</th></tr></thead><tbody>\n";
  for (int i = 0; i < 5; ++i) {
    const auto c = static_cast<ResidualClass>(i + 1);
    const double share = evaluation.central.class_share[i];
    out << "<tr><td>" << className(c) << " " << classLabel(c) << "</td><td class=\"n\">"
        << evaluation.central.class_count[i] << "</td><td class=\"n\">"
        << (std::isnan(share) ? "&ndash;" : number(100 * share, 0) + " %") << "</td><td>" << htmlEscape(classAction(c))
        << "</td></tr>\n";
  }
  out << "</tbody></table>\n<p>Material changes are admissible for C2 alone. The routing follows windows and "
         "thresholds; it "
         "does not name causes.</p>\n";
  std::istringstream text(reportText(evaluation, config));
  out << "<pre>" << htmlEscape(text.str()) << "</pre>\n";
  if (!evaluation.problems.empty()) {
    out << "<div class=\"warn\"><b>Poses that could not be used</b><ul>\n";
    for (const PoseProblem& p : evaluation.problems) out << "<li>" << htmlEscape(p.message) << "</li>\n";
    out << "</ul></div>\n";
  }
  out << "<h2>Coverage</h2>\n<p><img src=\"coverage.png\" alt=\"The scene from above with the radar's places\"></p>\n";
  out << "<h2>Poses</h2>\n<p>White boxes: expected regions where both branches respond. Magenta boxes: residuals, on "
         "the "
         "branch that is stronger.</p>\n<nav>";
  for (const PoseResult& p : evaluation.poses) {
    if (p.used) out << "<a href=\"#pose-" << htmlEscape(p.pose.name) << "\">" << htmlEscape(p.pose.name) << "</a><br>";
  }
  out << "</nav>\n";
  for (const PoseResult& p : evaluation.poses) {
    if (!p.used) continue;
    const FieldMetrics& m = p.attribution.central;
    out << "<figure id=\"pose-" << htmlEscape(p.pose.name) << "\"><img loading=\"lazy\" src=\""
        << htmlEscape(pictureLink(*this, p.pose.name)) << "\" alt=\"measured, simulated and residual map of pose "
        << htmlEscape(p.pose.name) << "\"><figcaption>Pose " << htmlEscape(p.pose.name) << ": "
        << m.recalled[0] + m.recalled[1] + m.recalled[2] << " of " << m.active[0] + m.active[1] + m.active[2]
        << " measured regions recalled, Q1 " << number(m.q1_energy) << ", Q2 " << number(m.q2_energy)
        << ", C1&ndash;C5 " << m.class_count[0] << "/" << m.class_count[1] << "/" << m.class_count[2] << "/"
        << m.class_count[3] << "/" << m.class_count[4] << "</figcaption></figure>\n";
  }
  writeHowToRepeat(run, out);
  file.close();
}

void ReportWriter::write(const Evaluation& evaluation, const AttributionConfig& config,
                         const RunDescription& run) const {
  writePoses(evaluation, config);
  writeResiduals(evaluation);
  writeRegions(evaluation);
  writeSummary(evaluation, config, run);
  const auto text = [&](const std::string& name, const std::string& content) {
    OutputFile file(directory_ + "/" + name);
    file.stream() << content;
    file.close();
  };
  text("table.txt", reportText(evaluation, config));
  text("attribution.yaml", run.attribution_yaml);
  text("radar.yaml", run.radar_yaml);
  if (!run.twin_yaml.empty()) text("twin.yaml", run.twin_yaml);
  writeHtml(evaluation, config, run);
}

}  // namespace mmradartwin
