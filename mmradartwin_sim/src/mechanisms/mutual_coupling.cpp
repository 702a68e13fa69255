#include <cmath>

#include "receiver_builtin.h"

namespace mmradartwin {
namespace {

const std::string kName = "mutual_coupling";

/// Neighbouring receive elements feed each other: y = C x within the receivers of each transmitter, C symmetric and
/// Toeplitz with ones on its diagonal, level_db beside it and decay_db less for every element further.
class MutualCoupling : public Mechanism {
 public:
  const std::string& name() const override { return kName; }
  std::vector<ParameterSpec> parameters() const override {
    return {tried(numberSpec("level_db", "dB", -200, 0, "of the next element's signal"), -200, -25),
            numberSpec("decay_db", "dB", 0, 200, 6, "less for every element further"),
            numberSpec("phase_deg", "deg", -360, 360, 0, "per element of distance")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig& radar) override {
    const Eigen::Index receivers = radar.receivers();
    const double level_db = values.number("level_db"), decay_db = values.number("decay_db");
    const double phase_rad = values.number("phase_deg") * M_PI / 180;
    coupling_.resize(receivers, receivers);
    for (Eigen::Index i = 0; i < receivers; ++i) {
      for (Eigen::Index j = 0; j < receivers; ++j) {
        const double apart = static_cast<double>(std::abs(i - j));
        coupling_(i, j) =
            i == j ? 1.0 : std::polar(std::pow(10.0, (level_db - (apart - 1) * decay_db) / 20), apart * phase_rad);
      }
    }
  }
  int rank() const override { return -10; }  // in the antennas, before any gain or phase of a channel
  void receive(const PoseContext&, ComplexGrid& x) const override {
    const Eigen::Index receivers = coupling_.rows();
    for (Eigen::Index first = 0; first + receivers <= x.rows(); first += receivers) {
      x.middleRows(first, receivers) = (coupling_ * x.middleRows(first, receivers)).eval();
    }
  }
  bool hasReceiveStage() const override { return true; }

 private:
  Eigen::MatrixXcd coupling_;
};

}  // namespace

std::unique_ptr<Mechanism> makeMutualCoupling() { return std::make_unique<MutualCoupling>(); }

}  // namespace mmradartwin
