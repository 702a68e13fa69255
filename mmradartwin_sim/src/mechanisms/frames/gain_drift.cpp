#include <algorithm>
#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

const std::string kGainDrift = "gain_drift";

/// A gain that changes with time, not place: at a rate, or by steps at times or at equal parts of the session's poses.
class GainDrift : public Mechanism, public ReceiveStage {
 public:
  const std::string& name() const override { return kGainDrift; }
  std::vector<ParameterSpec> parameters() const override {
    return {tried(numberSpec("db_per_hour", "dB/h", -1000, 1000, 0, "give this or steps_db"), 0, 5),
            optionalNumbersSpec("steps_db", "dB", -100, 100, "steps of the gain in time order"),
            optionalNumbersSpec("steps_s", "s", 0, 1e6, "when after the first pose, rising; else between equal parts")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    db_per_hour_ = values.number("db_per_hour");
    steps_db_ = values.numbers("steps_db");
    if (db_per_hour_ != 0 && !steps_db_.empty()) {
      throw InputError("mechanism gain_drift: give one of db_per_hour and steps_db, not both");
    }
    steps_s_ = values.numbers("steps_s");
    if (!steps_s_.empty() && steps_s_.size() != steps_db_.size()) {
      throw InputError("mechanism gain_drift: steps_s has " + std::to_string(steps_s_.size()) + " times and steps_db " +
                       std::to_string(steps_db_.size()) + " steps; give one time for each");
    }
    if (!std::is_sorted(steps_s_.begin(), steps_s_.end())) {
      throw InputError("mechanism gain_drift: steps_s has to rise");
    }
  }
  int rank() const override { return 12; }
  void receive(const PoseContext& context, ComplexGrid& x) const override {
    double gain_db = db_per_hour_ * context.session_s / 3600;
    const std::size_t part = static_cast<std::size_t>(context.pose_index) * (steps_db_.size() + 1) /
                             static_cast<std::size_t>(context.pose_count);
    for (std::size_t i = 0; i < steps_db_.size(); ++i) {
      if (steps_s_.empty() ? i < part : steps_s_[i] <= context.session_s) gain_db += steps_db_[i];
    }
    x *= std::pow(10.0, gain_db / 20);
  }

 private:
  double db_per_hour_ = 0;
  std::vector<double> steps_db_, steps_s_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(GainDrift)

}  // namespace mmradartwin
