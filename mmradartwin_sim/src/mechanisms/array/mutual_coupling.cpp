#include <cmath>
#include <complex>

#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

const std::string kMutualCoupling = "mutual_coupling";

/// Neighbouring receive elements feed each other: y = C x within the receivers of each transmitter, C symmetric and
/// Toeplitz with ones on its diagonal. Beside it stands level_db at phase_deg, decay_db less and phase_deg more for
/// every element further; or the complex shares of the next and the second element as numbers, which a diagnosis can
/// follow from nothing: no level and phase are known where there is no coupling.
class MutualCoupling : public Mechanism, public ReceiveStage {
 public:
  const std::string& name() const override { return kMutualCoupling; }
  std::vector<ParameterSpec> parameters() const override {
    const auto share = [](const char* name, const char* meaning) {
      return tried(numberSpec(name, "1", -1, 1, 0, meaning), 0, 0.05);
    };
    return {numberSpec("level_db", "dB", -200, 0, -200, "of the next element's signal; give this or shares"),
            numberSpec("decay_db", "dB", 0, 200, 6, "less for every element further, with level_db"),
            numberSpec("phase_deg", "deg", -360, 360, 0, "per element of distance, with level_db"),
            share("next_real", "share of the next element's signal, in phase"),
            share("next_imaginary", "the same, a quarter turn ahead"),
            share("second_real", "share of the second element's signal, in phase"),
            share("second_imaginary", "the same, a quarter turn ahead")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig& radar) override {
    const Eigen::Index receivers = radar.receivers();
    const double level_db = values.number("level_db"), decay_db = values.number("decay_db");
    const double phase_rad = values.number("phase_deg") * M_PI / 180;
    const std::complex<double> next(values.number("next_real"), values.number("next_imaginary"));
    const std::complex<double> second(values.number("second_real"), values.number("second_imaginary"));
    if (level_db > -200 && (next != 0.0 || second != 0.0)) {
      throw InputError(
          "mechanism mutual_coupling: give level_db or shares of elements (next_real and so on), not both");
    }
    coupling_ = Eigen::MatrixXcd::Identity(receivers, receivers);
    for (Eigen::Index i = 0; i < receivers; ++i) {
      for (Eigen::Index j = 0; j < receivers; ++j) {
        const double apart = static_cast<double>(std::abs(i - j));
        if (i == j) continue;
        if (level_db > -200) {
          coupling_(i, j) = std::polar(std::pow(10.0, (level_db - (apart - 1) * decay_db) / 20), apart * phase_rad);
        } else {
          coupling_(i, j) = apart == 1 ? next : apart == 2 ? second : 0.0;
        }
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

 private:
  Eigen::MatrixXcd coupling_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(MutualCoupling)

}  // namespace mmradartwin
