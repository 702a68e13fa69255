#include <cmath>

#include "mmradartwin_dsp/input_error.h"
#include "receiver_builtin.h"

namespace mmradartwin {
namespace {

const std::string kName = "gain_drift";

/// A gain that changes with time, not place: at a rate, or by steps at equal parts of the session's poses.
class GainDrift : public Mechanism {
 public:
  const std::string& name() const override { return kName; }
  std::vector<ParameterSpec> parameters() const override {
    return {tried(numberSpec("db_per_hour", "dB/h", -1000, 1000, 0, "give this or steps_db"), 0, 5),
            optionalListSpec("steps_db", "dB", -100, 100, "steps of the gain in time order, between equal parts")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    db_per_hour_ = values.number("db_per_hour");
    steps_db_ = values.numbers("steps_db");
    if (db_per_hour_ != 0 && !steps_db_.empty()) {
      throw InputError("mechanism gain_drift: give one of db_per_hour and steps_db, not both");
    }
  }
  int rank() const override { return 12; }
  void receive(const PoseContext& context, ComplexGrid& x) const override {
    double gain_db = db_per_hour_ * context.session_s / 3600;
    const std::size_t passed = static_cast<std::size_t>(context.pose_index) * (steps_db_.size() + 1) /
                               static_cast<std::size_t>(context.pose_count);
    for (std::size_t i = 0; i < std::min(passed, steps_db_.size()); ++i) gain_db += steps_db_[i];
    x *= std::pow(10.0, gain_db / 20);
  }
  bool hasReceiveStage() const override { return true; }

 private:
  double db_per_hour_ = 0;
  std::vector<double> steps_db_;
};

}  // namespace

std::unique_ptr<Mechanism> makeGainDrift() { return std::make_unique<GainDrift>(); }

}  // namespace mmradartwin
