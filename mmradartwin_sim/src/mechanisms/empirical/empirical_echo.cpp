#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "mechanisms/base/point_echo.h"

namespace mmradartwin {
namespace {

const std::string kEmpiricalEcho = "empirical_echo";

/// A point that answers alike in all directions, later than its distance says: a tag with a delay line, something that
/// rings, a way behind a panel. It hides nothing.
class EmpiricalEcho : public Mechanism, public PathStage {
 public:
  const std::string& name() const override { return kEmpiricalEcho; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override {
    return {numberSpec("x_m", "m", -1e4, 1e4, "map"), numberSpec("y_m", "m", -1e4, 1e4, "map"),
            numberSpec("height_m", "m", -100, 100, 1.2, "map"),
            numberSpec("rcs_dbsm", "dBsm", -200, 60, "radar cross section"),
            numberSpec("behind_m", "m", 0, 100, 0, "one-way range of the echo less the distance of the point")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    place_ = {values.number("x_m"), values.number("y_m"), values.number("height_m")};
    cross_section_m2_ = std::pow(10.0, values.number("rcs_dbsm") / 10);
    behind_m_ = values.number("behind_m");
  }
  void addPaths(const PoseContext& context, std::vector<PathRecord>& records) const override {
    std::optional<PointEcho> echo = pointEcho(context, place_, cross_section_m2_);
    if (!echo || echo->distance_m + behind_m_ > context.max_range_m) return;
    echo->record.event = &kEmpiricalEcho;
    setContribution(context.radar, echo->amplitude, echo->record);
    lengthen(context.radar, 2 * behind_m_, echo->record);
    records.push_back(std::move(echo->record));
  }

 private:
  Eigen::Vector3d place_;
  double cross_section_m2_ = 0, behind_m_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(EmpiricalEcho)

}  // namespace mmradartwin
