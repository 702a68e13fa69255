#include "echoes/image_record.h"

#include <cmath>

#include "physics/reflections.h"

namespace mmradartwin {

void addImageRecord(const PoseContext& context, const ElementsInMap& elements, const ImagePath& path,
                    const PathEvent& event, double cutoff, std::vector<PathRecord>& records, const GrazedEdges* edges) {
  const double wavelength = context.radar.wavelength_m();
  const double total = (path.image - elements.p).norm();
  PathRecord record;
  record.facets = path.facets;
  std::complex<double> weight =
      reflectAlong(context, elements, path.vertices, total, -1, event.level * wavelength / (4 * M_PI * total), record);
  if (edges) weight *= edges->factor(context, legsOf(context.scene, elements.p, path.facets, path.met));
  if (std::abs(weight) < cutoff || !(std::abs(weight) > 0)) return;
  record.event = &event.name;
  record.vertices = path.met;
  const Eigen::Matrix3d to_radar = context.T_map_radar.linear().transpose();
  record.departure = to_radar * (path.met.front() - elements.p).normalized();
  record.arrival = to_radar * (path.met.back() - elements.p).normalized();
  record.bounces = static_cast<int>(path.facets.size());
  record.length_m = elements.lengthsByImage([&](Eigen::Vector3d t) {
    for (int id : path.facets) t = mirror(t, context.scene.facets[id]);
    return t;
  });
  setContribution(context.radar, std::conj(weight), record);
  records.push_back(std::move(record));
}

}  // namespace mmradartwin
