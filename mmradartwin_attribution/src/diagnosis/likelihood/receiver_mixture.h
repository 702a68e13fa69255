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

/// What a receiver that mixes ranges (images, harmonics) makes of one pose's paths beside their own tones. Each of the
/// strong paths is sent through it alone, and the strongest ones in pairs: what two make together is as strong as what
/// each makes of itself.
class ReceiverMixture {
 public:
  /// A response that was collected before, by all that it follows from.
  struct Kept {
    double tone = 1;                        ///< factor by which the path's own tone stays
    std::shared_ptr<const EchoGroup> rest;  ///< none where nothing else comes of it
    std::size_t used = 0;                   ///< when, in calls
  };
  using Cache = std::unordered_map<std::size_t, Kept>;

  /// `linear`: the twin without what mixes. `receiver`: tells one receiver that mixes from another. `cache` is this
  /// pose's alone, `call` rises from call to call.
  ReceiverMixture(const Twin& twin, const Twin& linear, std::size_t receiver, const Pose& pose, Cache& cache,
                  std::size_t call);
  /// Finds the strong ones among the paths as they were traced, and scales them to what stays in their tones.
  void scaleTones(std::vector<PathRecord>& paths, const EchoCollector& collector);
  /// Adds all that the receiver makes beside these tones.
  void addTo(EchoCollector& collector);

 private:
  struct Alone {
    PathRecord path;
    std::size_t signature;
    PathRecord received = {};
    ComplexGrid x = {}, rest = {};
    double tone = 1;
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
  ComplexGrid nothing_;  ///< what comes without any path
  std::vector<Alone> alone_;
};

}  // namespace mmradartwin::diagnosis::likelihood
