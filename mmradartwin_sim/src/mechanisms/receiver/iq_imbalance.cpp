#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

const std::string kIqImbalance = "iq_imbalance";

/// I and Q of unequal gain or not quite in quadrature: x + beta conj(x), an image at (R_max - R, -azimuth). Each
/// receiver has a mixer of its own: beta is one number, or one per receiver.
class IqImbalance : public Mechanism, public ReceiveStage {
 public:
  const std::string& name() const override { return kIqImbalance; }
  std::vector<ParameterSpec> parameters() const override {
    return {tried(orPerReceiver(numberSpec("image_db", "dB", -200, 0, "of the image against its host")), -200, -25),
            orPerReceiver(numberSpec("phase_deg", "deg", -360, 360, 0, "of beta"))};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig& radar) override {
    const std::vector<double> image_db = perReceiver(values, "image_db", radar),
                              phase_deg = perReceiver(values, "phase_deg", radar);
    beta_.resize(radar.receivers());
    for (Eigen::Index r = 0; r < beta_.size(); ++r) {
      const auto i = static_cast<std::size_t>(r);
      beta_[r] = std::polar(std::pow(10.0, image_db[i] / 20), phase_deg[i] * M_PI / 180);
    }
  }
  int rank() const override { return 10; }  // in the mixer, after what belongs to the channels
  void receive(const PoseContext&, ComplexGrid& x) const override {
    for (Eigen::Index k = 0; k < x.rows(); ++k) x.row(k) += beta_[k % beta_.size()] * x.row(k).conjugate().eval();
  }

 private:
  static std::vector<double> perReceiver(const Parameters& values, const char* key, const RadarConfig& radar) {
    const auto receivers = static_cast<std::size_t>(radar.receivers());
    const auto* list = std::get_if<std::vector<double>>(&values.all().at(key));
    if (list == nullptr) return std::vector<double>(receivers, values.number(key));
    if (list->size() != receivers) {
      throw InputError("mechanism iq_imbalance: key " + std::string(key) + ": has " + std::to_string(list->size()) +
                       " numbers; the radar has " + std::to_string(receivers) +
                       " receivers; give one number, or one per receiver");
    }
    return *list;
  }

  Eigen::VectorXcd beta_;  // [receivers]
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(IqImbalance)

}  // namespace mmradartwin
