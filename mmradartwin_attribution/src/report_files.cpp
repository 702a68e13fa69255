#include <cmath>
#include <fstream>
#include <iomanip>

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
         "conjugated_better,explained_power\n";
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
        << ',' << (c.conjugatedBetter() ? 1 : 0) << ',' << number(evaluation.explainedShare(p), 5) << '\n';
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

}  // namespace mmradartwin
