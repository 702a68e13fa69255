#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "diagnosis/likelihood/echo_field.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis::likelihood {

/// Echoes that a receiver which mixes ranges (images, harmonics) makes of one pose's paths beside their own tones. Each
/// strong path is sent through the receiver alone, and the strongest ones in pairs: a product of two paths is as strong
/// as each one's own.
class ReceiverMixture {
 public:
  /// Response that was collected before.
  struct Kept {
    double tone = 1;                        ///< factor by which the path's own tone stays
    std::shared_ptr<const EchoGroup> rest;  ///< what else comes of it; null for nothing
    std::size_t used = 0;                   ///< last call that used it
  };
  /// Responses by a signature of everything that they follow from.
  using Cache = std::unordered_map<std::size_t, Kept>;

  /// linear: the twin without the mechanisms that mix ranges. receiver: a key that tells one receiver from another.
  /// cache: of this pose alone. call: rises from call to call.
  ReceiverMixture(const Twin& twin, const Twin& linear, std::size_t receiver, const Pose& pose, Cache& cache,
                  std::size_t call);
  /// Finds the strong paths among the traced ones, and scales each to what the receiver leaves in its tone.
  void scaleTones(std::vector<PathRecord>& paths, const EchoCollector& collector);
  /// Adds everything that the receiver makes beside these tones.
  void addTo(EchoCollector& collector);

 private:
  /// A strong path and what the receiver makes of it alone.
  struct Alone {
    PathRecord path;
    std::size_t signature;
    PathRecord received = {};
    ComplexGrid x = {}, rest = {};  ///< [M][N] samples of all, and of all but its tone
    double tone = 1;                ///< factor of its own tone
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
  ComplexGrid nothing_;  ///< samples that come without any path
  std::vector<Alone> alone_;
};

}  // namespace mmradartwin::diagnosis::likelihood
