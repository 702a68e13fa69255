#include <algorithm>

#include "mechanisms/base/built_in_mechanism.h"
#include "stages/random_draw.h"

namespace mmradartwin {
namespace {

const std::string kPacketLoss = "packet_loss";
constexpr std::size_t kPacketBytes = 1456;  // of the DCA1000, counted from the start of the recording

/// Packets lost on the way, filled with zeros and not flagged.
class PacketLoss : public Mechanism, public TransportStage {
 public:
  const std::string& name() const override { return kPacketLoss; }
  std::vector<ParameterSpec> parameters() const override {
    return {numberSpec("lost_fraction", "1", 0, 1, "of packets")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    fraction_ = values.number("lost_fraction");
  }
  void transport(const PayloadContext& context, std::vector<std::uint8_t>& payload) const override {
    const std::uint64_t key = drawKey(context.draw, 0x6C6F7374);
    for (std::size_t packet = 0; packet * kPacketBytes < payload.size(); ++packet) {
      if (drawUniform(drawKey(key, packet)) >= fraction_) continue;
      const auto begin = payload.begin() + static_cast<std::ptrdiff_t>(packet * kPacketBytes);
      std::fill(begin, begin + static_cast<std::ptrdiff_t>(std::min<std::size_t>(kPacketBytes, payload.end() - begin)),
                std::uint8_t{0});
    }
  }

 private:
  double fraction_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(PacketLoss)

}  // namespace mmradartwin
