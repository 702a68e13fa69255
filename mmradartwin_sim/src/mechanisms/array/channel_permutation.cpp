#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

const std::string kChannelPermutation = "channel_permutation";

/// Virtual channels delivered in another order.
class ChannelPermutation : public Mechanism, public ReceiveStage {
 public:
  const std::string& name() const override { return kChannelPermutation; }
  std::vector<ParameterSpec> parameters() const override {
    ParameterSpec order =
        optionalNumbersSpec("order", "1", 0, 1023, "order[i] is the true channel delivered in place i");
    order.required = true;
    return {order};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig& radar) override {
    const std::vector<double>& order = values.numbers("order");
    const std::size_t channels = static_cast<std::size_t>(radar.channels());
    std::vector<bool> met(channels, false);
    order_.clear();
    for (double o : order) {
      const std::size_t channel = static_cast<std::size_t>(o);
      if (static_cast<double>(channel) != o || channel >= channels || met[channel] || order.size() != channels) break;
      met[channel] = true;
      order_.push_back(static_cast<Eigen::Index>(channel));
    }
    if (order_.size() != channels) {
      throw InputError("mechanism channel_permutation: key order: must hold every channel 0 to " +
                       std::to_string(channels - 1) + " once");
    }
  }
  int rank() const override { return 29; }
  void receive(const PoseContext&, ComplexGrid& x) const override {
    const ComplexGrid ordered = x;
    for (Eigen::Index i = 0; i < x.rows(); ++i) x.row(i) = ordered.row(order_[static_cast<std::size_t>(i)]);
  }

 private:
  std::vector<Eigen::Index> order_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(ChannelPermutation)

}  // namespace mmradartwin
