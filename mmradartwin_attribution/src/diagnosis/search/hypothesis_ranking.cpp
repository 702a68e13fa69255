#include "diagnosis/search/hypothesis_ranking.h"

#include <algorithm>
#include <map>
#include <optional>

#include "diagnosis/search/back_projection.h"
#include "diagnosis/search/latent_patterns.h"
#include "diagnosis/search/law_screen.h"
#include "diagnosis/search/object_search.h"
#include "diagnosis/search/replica_screen.h"

namespace mmradartwin::diagnosis::search {
namespace {

constexpr std::size_t kScreenPoses = 44;  ///< a part of the session ranks hypotheses well enough
constexpr std::size_t kFewestPoses = 12;
constexpr std::size_t kLawPoses = 66;   ///< whose paths are scored for laws without a name
constexpr std::size_t kSecondLook = 9;  ///< hypotheses that are looked at on more poses, geometries on all
constexpr std::size_t kSecondLookPoses = 66;
constexpr std::size_t kSuspects = 6;       ///< actors whose geometry is tried
constexpr std::size_t kNeighbours = 2;     ///< of a place where an object seems to stand, that may be the object
constexpr double kOutOfPlace = 1.2;        ///< nats of an actor's own errors from which on it is looked for elsewhere
constexpr double kElsewhere = 5;           ///< the same of its echoes nearer or farther away,
constexpr std::size_t kMostElsewhere = 2;  ///< and how many are by that

}  // namespace

std::vector<int> HypothesisRanking::spread(std::size_t wanted) const {
  const std::size_t count = context_.data.poses.size();
  wanted = std::min(count, wanted);
  std::vector<int> poses;
  for (std::size_t i = 0; i < wanted; ++i) poses.push_back(static_cast<int>(i * count / wanted));
  return poses;
}

std::vector<RangeShift> HypothesisRanking::shifted(const ModelState& state) {
  context_.report("actors that stand elsewhere", 0);
  std::vector<RangeShift> shifts = screen_.nearerOrFarther(state, spread(kScreenPoses));
  const auto plain = [](const RangeShift& s) { return s.nats >= kElsewhere; };
  shifts.erase(std::partition_point(shifts.begin(), shifts.end(), plain), shifts.end());
  return shifts;
}

std::vector<Screened> HypothesisRanking::rank(const std::vector<Hypothesis>& all, const ModelState& state,
                                              const std::vector<RangeShift>& shifted) {
  const auto suspects = screen_.suspects(state);
  std::set<std::string> suspicious;
  for (std::size_t i = 0; i < std::min(kSuspects, suspects.size()); ++i) {
    suspicious.insert(context_.twin.scene().actors[static_cast<std::size_t>(suspects[i].first)].name);
  }
  std::set<int> out_of_place;
  for (const auto& [actor, nats] : suspects) {
    if (nats > kOutOfPlace && out_of_place.size() < kMostOutOfPlace) out_of_place.insert(actor);
  }
  // The more numbers a hypothesis has, the more evaluations, and the fewer poses rank it.
  const auto some = [&](const Hypothesis& h) {
    return spread(std::max(kFewestPoses, kScreenPoses / (1 + h.coordinates.size() / 3)));
  };
  /// Whom it moves, where that one is looked for elsewhere; -1 of all others.
  const auto outOfPlace = [&](const Hypothesis& h) {
    const int actor = context_.twin.scene().actorIndex(h.subject);
    return h.isMove() && out_of_place.count(actor) > 0 ? actor : -1;
  };
  const auto look = [&](const Hypothesis& h, const std::vector<int>& poses) {
    const int actor = outOfPlace(h);
    return actor >= 0 ? screen_.around(state, h, actor, poses) : screen_.screen(state, h, poses);
  };
  const auto lookAtSome = [&](const Hypothesis& h) { return look(h, spread(kScreenPoses)); };
  const auto better = [](const Screened& a, const Screened& b) { return a.screened_nats > b.screened_nats; };
  const auto bestOf = [&](std::size_t most, const std::vector<ProjectedPlace>& places,
                          Hypothesis (*at)(const ProjectedPlace&)) {
    std::vector<Screened> best;
    for (const ProjectedPlace& place : places) best.push_back(lookAtSome(at(place)));
    std::stable_sort(best.begin(), best.end(), better);
    best.resize(std::min(most, best.size()));
    return best;
  };
  for (std::size_t i = 0; i < std::min(kMostElsewhere, shifted.size()); ++i) {
    suspicious.insert(context_.twin.scene().actors[static_cast<std::size_t>(shifted[i].actor)].name);
    out_of_place.insert(shifted[i].actor);
  }
  context_.report("objects that the twin lacks", 0);
  std::vector<Screened> placed = bestOf(kMostObjects, projectBack(context_.twin, context_.likelihood, state), objectAt);
  const std::size_t objects = placed.size();
  for (Screened& s : bestOf(1, projectLateBack(context_.twin, context_.likelihood, state), lateEchoAt))
    placed.push_back(std::move(s));
  context_.echoes.setBaseline(state.mechanisms);
  for (std::size_t i = 0; i < objects && placed[i].screened_nats > (i == 0 ? kWorthAnObject : kWorthALaw); ++i) {
    // It may be one of the scene's that stands elsewhere.
    const NamedParameters& m = placed[i].hypothesis.mechanism;
    std::vector<int> near = objectsNear(context_.twin.scene(), m.values.number("x_m"), m.values.number("y_m"));
    near.resize(std::min(near.size(), kNeighbours));
    for (int actor : near) suspicious.insert(context_.twin.scene().actors[static_cast<std::size_t>(actor)].name);
    out_of_place.insert(near.begin(), near.end());
  }
  std::vector<Screened> screened;
  std::map<std::string, std::size_t> looked_at;  // poses
  for (std::size_t i = 0; i < all.size(); ++i) {
    context_.report("trying " + all[i].label(), static_cast<double>(i) / static_cast<double>(all.size()));
    const bool of_actor = context_.twin.scene().actorIndex(all[i].subject) >= 0;
    const double numbers = static_cast<double>(all[i].coordinates.size());
    const std::vector<double> typical(all[i].coordinates.size(), 1.0);
    // Each of these traces the session anew: of actors without suspicion, what is there or not on a few poses, and
    // nothing else.
    const bool costly =
        of_actor && suspicious.count(all[i].subject) == 0 && context_.echoes.altersGeometry(all[i].at(typical));
    if (costly && (!all[i].isOneSided() || no_use_.count(all[i].label()) > 0)) continue;
    std::vector<int> poses = costly ? spread(kFewestPoses) : some(all[i]);
    Screened s = look(all[i], poses);
    if (outOfPlace(all[i]) >= 0) poses = spread(context_.data.poses.size());  // what it promises is of all
    if (costly && !(s.screened_nats > 0)) no_use_.insert(all[i].label());
    // What chance promises: half a nat per number on the poses looked at, scaled up like the rest.
    s.screened_nats -=
        0.5 * numbers * static_cast<double>(context_.data.poses.size()) / static_cast<double>(poses.size());
    looked_at[s.hypothesis.label()] = poses.size();
    screened.push_back(std::move(s));
    context_.echoes.setBaseline(state.mechanisms);
  }
  std::stable_sort(screened.begin(), screened.end(), better);
  // Geometry before materials: what is wrong with all ranges or directions stands in every latent, and its score is
  // small for that.
  std::size_t kept = 0;
  screened.erase(std::remove_if(screened.begin(), screened.end(),
                                [&](const Screened& s) { return ++kept > kSecondLook && !s.hypothesis.isGeometry(); }),
                 screened.end());
  for (Screened& s : screened) {
    context_.report("looking again at " + s.hypothesis.label(), 0);
    const double numbers = static_cast<double>(s.hypothesis.coordinates.size());
    const std::vector<int> poses = spread(numbers > 3                 ? kScreenPoses
                                          : s.hypothesis.isGeometry() ? context_.data.poses.size()
                                                                      : kSecondLookPoses);
    if (looked_at[s.hypothesis.label()] < poses.size()) {
      s = screen_.screen(state, s.hypothesis, poses);
      s.screened_nats -=
          0.5 * numbers * static_cast<double>(context_.data.poses.size()) / static_cast<double>(poses.size());
      context_.echoes.setBaseline(state.mechanisms);
    }
    s.screened_nats -= numbers;
  }
  // A hypothesis that something else points at: with the start that it gives.
  const auto suggest = [&screened](Screened s) {
    const auto same = std::find_if(screened.begin(), screened.end(), [&](const Screened& other) {
      return other.hypothesis.label() == s.hypothesis.label();
    });
    if (same == screened.end()) {
      screened.push_back(std::move(s));
    } else {
      same->screened_nats = std::max(same->screened_nats, s.screened_nats);
      same->starts.push_back(s.starts.front());
    }
  };
  context_.report("laws without a name", 0);
  ScreenedLaws laws = screenLaws(context_.twin, context_.likelihood, state, spread(kLawPoses));
  const auto isNoName = [&](const Screened& s) {
    return s.hypothesis.form() == MechanismForm::kGainOverTime && !laws.gains_follow_time;
  };
  screened.erase(std::remove_if(screened.begin(), screened.end(), isNoName), screened.end());
  for (Screened& s : laws.laws) {
    if (std::optional<Screened> named = namedLike(s, all); named && !isNoName(*named)) suggest(std::move(*named));
    if (const std::optional<Screened> box = s.screened_nats > kWorthALaw ? boxThatHides(s) : std::nullopt) {
      screened.push_back(screen_.amongStarts(state, *box, spread(kScreenPoses)));
    }
    screened.push_back(std::move(s));
  }
  context_.report("replicas of echoes", 0);
  for (Screened& s :
       screenReplicas(context_.twin, context_.likelihood, state, spread(kLawPoses), kWorthALaw, lookAtSome)) {
    screened.push_back(std::move(s));
  }
  context_.report("errors that poses and actors share", 0);
  for (Screened& s : sharedLatents(context_.echoes, state, context_.likelihood.spread(), context_.pose_accuracy, all,
                                   spread(kScreenPoses))) {
    suggest(std::move(s));
  }
  context_.echoes.setBaseline(state.mechanisms);
  for (Screened& s : placed) {
    freePlace(context_.data, s);
    screened.push_back(std::move(s));
  }
  std::stable_sort(screened.begin(), screened.end(), better);
  return screened;
}

}  // namespace mmradartwin::diagnosis::search
