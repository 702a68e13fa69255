#pragma once

#include <optional>
#include <string>
#include <vector>

namespace mmradartwin {

/// What stored poses are sorted by.
struct PoseScore {
  double recall = 0, q1_energy = 0, q2_energy = 0, residual_rms_db = 0;  ///< NaN where a pose has none
};

enum class PoseOrder { kRecorded, kRecall, kQ1Energy, kQ2Energy, kResidual };
/// "recorded", "recall", "q1_energy", "q2_energy", "residual_rms_db".
const std::vector<std::string>& poseOrderNames();
std::optional<PoseOrder> poseOrderOf(const std::string& name);
const std::string& poseOrderName(PoseOrder order);
/// Indices of the poses: as recorded, or the worst first; equal ones as recorded, and those without a score last.
std::vector<std::size_t> orderedPoses(const std::vector<PoseScore>& poses, PoseOrder order);

/// A walk through stored poses, in an order.
class PoseWalk {
 public:
  /// Throws InputError where there is none.
  explicit PoseWalk(std::vector<PoseScore> poses);
  /// The shown pose stays.
  void setOrder(PoseOrder order);
  void showFirst();
  void show(std::size_t index);
  /// So many on in the order; beyond one end it goes on at the other.
  void step(long count);

  PoseOrder order() const { return order_; }
  std::size_t index() const { return sequence_[rank_]; }
  std::size_t rank() const { return rank_; }
  std::size_t count() const { return sequence_.size(); }

 private:
  std::vector<PoseScore> poses_;
  PoseOrder order_ = PoseOrder::kRecorded;
  std::vector<std::size_t> sequence_;
  std::size_t rank_ = 0;
};

}  // namespace mmradartwin
