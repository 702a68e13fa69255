#include "physics/reflections.h"

#include <algorithm>
#include <cmath>

#include "physics/aperture.h"
#include "physics/polarisation.h"

namespace mmradartwin {

std::complex<double> reflectAlong(const PoseContext& context, const ElementsInMap& elements,
                                  const PerInteraction<Eigen::Vector3d>& vertices, double total_m, int corner,
                                  std::complex<double> weight, PathRecord& record) {
  const double wavelength = context.radar.wavelength_m();
  Eigen::Vector3d from = elements.p, in = (vertices.front() - from).normalized();
  ComplexVector field = verticalField(elements.up, in).cast<std::complex<double>>();
  double before_m = 0;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Facet& facet = context.scene.facets[static_cast<std::size_t>(record.facets[i])];
    const Material& material = context.scene.actors[static_cast<std::size_t>(facet.actor)].material;
    const int at = static_cast<int>(i);
    const bool in_corner = corner >= 0 && (at == corner || at == corner + 1);
    const Eigen::Vector3d leg = vertices[i] - from;
    if (!in_corner || at == corner) in = leg.normalized();  // the other facet of a corner is met at the same point
    before_m += leg.norm();
    from = vertices[i];
    record.actors.push_back(facet.actor);
    record.reflection_cosine.push_back(std::min(1.0, std::abs(in.dot(facet.normal))));
    field = reflectField(field, in, facet.normal, material, context.frequency_hz);
    std::complex<double> aperture = 1;
    if (!in_corner) aperture = apertureFactor(facet, vertices[i], in, before_m, total_m - before_m, wavelength);
    weight *= specularShare(material) * aperture;
    in -= 2 * in.dot(facet.normal) * facet.normal;
  }
  const Eigen::Vector3d arrival = (vertices.back() - elements.p).normalized();
  return weight * (verticalField(elements.up, arrival).cast<std::complex<double>>().transpose() * field)(0);
}

}  // namespace mmradartwin
