#include "physics/image_record.h"

#include <algorithm>
#include <cmath>

#include "physics/aperture.h"
#include "physics/polarisation.h"

namespace mmradartwin {
void addImageRecord(const PoseContext& context, const ElementsInMap& elements, const ImagePath& path,
                    const PathEvent& event, double cutoff, std::vector<PathRecord>& records, const GrazedEdges* edges) {
  const double wavelength = context.radar.wavelength_m();
  const int order = static_cast<int>(path.facets.size());
  const double total = (path.image - elements.p).norm();
  Eigen::Vector3d in = (path.vertices.front() - elements.p).normalized();
  const Eigen::Vector3d arrival = (path.vertices.back() - elements.p).normalized();
  ComplexVector field = verticalField(elements.up, in).cast<std::complex<double>>();
  std::complex<double> weight = event.level * wavelength / (4 * M_PI * total);
  double before = 0;
  Eigen::Vector3d from = elements.p;
  PathRecord record;
  for (int i = 0; i < order; ++i) {
    const Facet& facet = context.scene.facets[path.facets[i]];
    const Material& material = context.scene.actors[facet.actor].material;
    const Eigen::Vector3d leg = path.vertices[i] - from;
    in = leg.normalized();
    before += leg.norm();
    record.reflection_cosine.push_back(std::min(1.0, std::abs(in.dot(facet.normal))));
    field = reflectField(field, in, facet.normal, material, context.frequency_hz);
    const std::complex<double> aperture =
        apertureFactor(facet, path.vertices[i], in, before, total - before, wavelength);
    weight *= specularShare(material) * aperture;
    from = path.vertices[i];
    record.actors.push_back(facet.actor);
  }
  weight *= (verticalField(elements.up, arrival).cast<std::complex<double>>().transpose() * field)(0);
  if (edges) weight *= edges->factor(context, legsOf(context.scene, elements.p, path.facets, path.met));
  if (std::abs(weight) < cutoff || !(std::abs(weight) > 0)) return;
  record.event = &event.name;
  record.facets = path.facets;
  record.vertices = path.met;
  const Eigen::Matrix3d to_radar = context.T_map_radar.linear().transpose();
  record.departure = to_radar * (path.met.front() - elements.p).normalized();
  record.arrival = to_radar * (path.met.back() - elements.p).normalized();
  record.bounces = order;
  record.length_m = elements.lengthsByImage([&](Eigen::Vector3d t) {
    for (int id : path.facets) t = mirror(t, context.scene.facets[id]);
    return t;
  });
  setContribution(context.radar, std::conj(weight), record);
  records.push_back(std::move(record));
}

}  // namespace mmradartwin
