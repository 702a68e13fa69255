#include "physics/reflections.h"

#include <algorithm>
#include <cmath>

#include "physics/aperture.h"
#include "physics/polarisation.h"

namespace mmradartwin {

std::complex<double> reflectAlong(const PoseContext& context, const ElementsInMap& elements,
                                  const PerInteraction<Eigen::Vector3d>& vertices, double total_m, int corner,
                                  PathRecord& record) {
  const double wavelength = context.radar.wavelength_m();
  Eigen::Vector3d from = elements.p, in = (vertices.front() - from).normalized();
  ComplexVector field = verticalField(elements.up, in).cast<std::complex<double>>();
  std::complex<double> weight = 1;
  double before_m = 0;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Facet& facet = context.scene.facets[static_cast<std::size_t>(record.facets[i])];
    const Material& material = context.scene.actors[static_cast<std::size_t>(facet.actor)].material;
    before_m += (vertices[i] - from).norm();
    from = vertices[i];
    record.actors.push_back(facet.actor);
    record.reflection_cosine.push_back(std::min(1.0, std::abs(in.dot(facet.normal))));
    field = reflectField(field, in, facet.normal, material, context.frequency_hz);
    weight *= specularShare(material);
    const int at = static_cast<int>(i);
    if (corner < 0 || (at != corner && at != corner + 1)) {
      weight *= apertureFactor(facet, vertices[i], in, before_m, total_m - before_m, wavelength);
    }
    in -= 2 * in.dot(facet.normal) * facet.normal;
  }
  return weight * (verticalField(elements.up, in).cast<std::complex<double>>().transpose() * field)(0);
}

}  // namespace mmradartwin
