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

std::complex<double> perpendicularReflection(const Material& material, double frequency_hz) {
  return specularShare(material) * fresnel(material, 1, frequency_hz).te;
}

std::complex<double> reflectionOf(const Eigen::Vector3d& up, const Eigen::Vector3d& out, const Eigen::Vector3d& arrival,
                                  const PerInteraction<Eigen::Vector3d>& normals,
                                  const PerInteraction<const Material*>& materials, double frequency_hz) {
  Eigen::Vector3d in = out;
  ComplexVector field = verticalField(up, in).cast<std::complex<double>>();
  double share = 1;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    field = reflectField(field, in, normals[i], *materials[i], frequency_hz);
    in -= 2 * in.dot(normals[i]) * normals[i];
    share *= specularShare(*materials[i]);
  }
  return share * (verticalField(up, arrival).cast<std::complex<double>>().transpose() * field)(0);
}

bool replaceReflection(std::complex<double> before, std::complex<double> now, PathRecord& record) {
  constexpr double kNothing = 1e-6;  // what is left of less has too few digits, or was not recorded
  if (!(std::abs(before) > kNothing)) return false;
  scaleRecord(std::conj(now / before), record);
  return true;
}

MaterialsOfPath::MaterialsOfPath(const Scene& scene, const std::vector<Material>& of_actors_before,
                                 const PathRecord& record) {
  for (int actor : record.actors) {
    const auto a = static_cast<std::size_t>(actor);
    before.push_back(&of_actors_before[a]);
    now.push_back(&scene.actors[a].material);
    changed = changed || !sameSurface(*before.back(), *now.back());
  }
}

}  // namespace mmradartwin
