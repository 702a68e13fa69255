#include "mmradartwin_attribution/pose_walk.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

/// The greater, the worse.
double badness(const PoseScore& pose, PoseOrder order) {
  switch (order) {
    case PoseOrder::kRecorded:
      return 0;
    case PoseOrder::kRecall:
      return -pose.recall;
    case PoseOrder::kQ1Energy:
      return pose.q1_energy;
    case PoseOrder::kQ2Energy:
      return pose.q2_energy;
    case PoseOrder::kResidual:
      return pose.residual_rms_db;
  }
  return 0;
}

}  // namespace

const std::vector<std::string>& poseOrderNames() {
  static const std::vector<std::string> names = {"recorded", "recall", "q1_energy", "q2_energy", "residual_rms_db"};
  return names;
}

std::optional<PoseOrder> poseOrderOf(const std::string& name) {
  const auto& names = poseOrderNames();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return static_cast<PoseOrder>(found - names.begin());
}

const std::string& poseOrderName(PoseOrder order) { return poseOrderNames()[static_cast<std::size_t>(order)]; }

std::vector<std::size_t> orderedPoses(const std::vector<PoseScore>& poses, PoseOrder order) {
  std::vector<std::size_t> sequence(poses.size());
  std::iota(sequence.begin(), sequence.end(), std::size_t{0});
  std::stable_sort(sequence.begin(), sequence.end(), [&](std::size_t a, std::size_t b) {
    const double x = badness(poses[a], order), y = badness(poses[b], order);
    if (std::isnan(x) || std::isnan(y)) return !std::isnan(x) && std::isnan(y);
    return x > y;
  });
  return sequence;
}

PoseWalk::PoseWalk(std::vector<PoseScore> poses) : poses_(std::move(poses)) {
  if (poses_.empty()) throw InputError("no pose was compared: there is nothing to show");
  sequence_ = orderedPoses(poses_, order_);
}

void PoseWalk::setOrder(PoseOrder order) {
  const std::size_t shown = index();
  order_ = order;
  sequence_ = orderedPoses(poses_, order_);
  show(shown);
}

void PoseWalk::showFirst() { rank_ = 0; }

void PoseWalk::show(std::size_t index) {
  rank_ = static_cast<std::size_t>(std::find(sequence_.begin(), sequence_.end(), index) - sequence_.begin());
}

void PoseWalk::step(long count) {
  const long poses = static_cast<long>(sequence_.size());
  rank_ = static_cast<std::size_t>(((static_cast<long>(rank_) + count % poses) % poses + poses) % poses);
}

}  // namespace mmradartwin
