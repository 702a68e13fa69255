#include "physics/elements_in_map.h"

namespace mmradartwin {

ElementsInMap::ElementsInMap(const PoseContext& context)
    : p(context.T_map_radar.translation()), up(context.T_map_radar.linear().col(2)), sides(context.scene, p) {
  for (const auto& t : context.radar.tx_position_m) tx.push_back(context.T_map_radar * t);
  for (const auto& r : context.radar.rx_position_m) rx.push_back(context.T_map_radar * r);
}

PerChannel<double> ElementsInMap::lengthsVia(const Eigen::Vector3d& point) const {
  PerChannel<double> lengths;
  lengths.reserve(tx.size() * rx.size());
  for (const auto& t : tx) {
    const double out = (point - t).norm();
    for (const auto& r : rx) lengths.push_back(out + (point - r).norm());
  }
  return lengths;
}

}  // namespace mmradartwin
