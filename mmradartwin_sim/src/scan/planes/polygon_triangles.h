#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace mmradartwin {

/// Triangles of a polygon with holes, whose corners alone they use: outline counter-clockwise, holes clockwise, corners
/// numbered through outline and holes. By ear clipping after each hole is joined to what lies around it (Eberly,
/// Triangulation by Ear Clipping, 2008). Empty where the outline bounds nothing.
std::vector<std::array<int, 3>> trianglesOf(const std::vector<Eigen::Vector2d>& outline,
                                            const std::vector<std::vector<Eigen::Vector2d>>& holes);

double signedAreaOf(const std::vector<Eigen::Vector2d>& loop);

}  // namespace mmradartwin
