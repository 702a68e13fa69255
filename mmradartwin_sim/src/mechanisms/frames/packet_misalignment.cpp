#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"
#include "stages/random_draw.h"

namespace mmradartwin {
namespace {

const std::string kPacketMisalignment = "packet_misalignment";
constexpr std::size_t kSlippedPacketBytes = 1456;

/// In one pose a packet was lost and not filled: all that follows slips, and the recording runs on for as long.
class PacketMisalignment : public Mechanism, public TransportStage {
 public:
  const std::string& name() const override { return kPacketMisalignment; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override {
    return {textSpec("pose", true, "", "name of the pose"),
            integerSpec("packet", "1", -1, 1e9, -1, "number of the packet from 0; -1: one of the first half")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    pose_ = values.text("pose");
    packet_ = static_cast<long long>(values.number("packet"));
    if (pose_.empty()) throw InputError("mechanism packet_misalignment: key pose: is empty; give a pose's name");
  }
  int rank() const override { return 1; }  // what arrived, lost packets filled or not, is then cut
  std::string onlyPose() const override { return pose_; }
  std::size_t surplusBytes() const override { return kSlippedPacketBytes; }
  void transport(const PayloadContext& context, std::vector<std::uint8_t>& payload) const override {
    if (context.pose != pose_) return;
    const std::size_t packets = payload.size() / kSlippedPacketBytes;
    std::size_t packet = static_cast<std::size_t>(packet_);
    if (packet_ < 0) {
      packet = static_cast<std::size_t>(drawUniform(drawKey(context.draw, 0x736C6970)) *
                                        static_cast<double>(std::max<std::size_t>(1, packets / 2)));
    }
    if (packet >= packets) {
      throw InputError("mechanism packet_misalignment: key packet: " + std::to_string(packet) + " is beyond pose " +
                       pose_ + ", which has " + std::to_string(packets) + " packets");
    }
    const auto begin = payload.begin() + static_cast<std::ptrdiff_t>(packet * kSlippedPacketBytes);
    payload.erase(begin, begin + static_cast<std::ptrdiff_t>(kSlippedPacketBytes));
  }

 private:
  std::string pose_;
  long long packet_ = -1;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(PacketMisalignment)

}  // namespace mmradartwin
