#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "diagnosis/echoes/echo_field.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis::echoes {

/// Echoes that a receiver which mixes ranges (images, harmonics) generates from one pose's paths, besides their own
/// tones. Each strong path is sent through the receiver alone. The strongest ones are also sent in pairs, as products
/// of two paths are as strong as those of one.
class ReceiverMixture {
 public:
  /// Response that was collected earlier.
  struct Kept {
    double tone = 1;                        ///< factor on the path's own tone
    std::shared_ptr<const EchoGroup> rest;  ///< all other echoes of it; null for none
    std::size_t used = 0;                   ///< last call that used it
  };
  /// Responses by a signature of everything that determines them.
  using Cache = std::unordered_map<std::size_t, Kept>;

  /// linear: the twin without the mechanisms that mix ranges. receiver: identifies the receiver. cache: of this pose
  /// only. call: rises from call to call.
  ReceiverMixture(const Twin& twin, const Twin& linear, std::size_t receiver, const Pose& pose, Cache& cache,
                  std::size_t call);
  /// Finds the strong paths among the traced ones, and scales each to the tone that the receiver leaves.
  void scaleTones(std::vector<PathRecord>& paths, const EchoCollector& collector);
  /// Adds everything that the receiver generates besides these tones.
  void addTo(EchoCollector& collector);

 private:
  /// A strong path and the receiver's response to it alone.
  struct Alone {
    PathRecord path;
    std::size_t signature;
    PathRecord received = {};
    ComplexGrid x = {}, rest = {};  ///< [M][N] samples of the response, and of the response without its tone
    double tone = 1;                ///< factor on its own tone
    bool sent = false;
  };
  ComplexGrid through(const Twin& receiver, const std::vector<PathRecord>& paths) const;
  void send(Alone& path) const;
  std::shared_ptr<const EchoGroup> groupOf(const PathRecord& record, const ComplexGrid& x,
                                           EchoCollector& collector) const;

  const Twin &twin_, &linear_;
  const RadarConfig& radar_;
  const Pose& pose_;
  Cache& cache_;
  std::size_t call_, receiver_;
  ComplexGrid nothing_;  ///< samples without any path
  std::vector<Alone> alone_;
};

}  // namespace mmradartwin::diagnosis::echoes
