#include "diagnosis/search/hypothesis_ranking.h"

#include <algorithm>
#include <map>
#include <optional>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/search/back_projection.h"
#include "diagnosis/search/latent_patterns.h"
#include "diagnosis/search/law_screen.h"
#include "diagnosis/search/object_search.h"
#include "diagnosis/search/replica_screen.h"
#include "diagnosis/search/transmitter_delay.h"

namespace mmradartwin::diagnosis::search {
namespace {

constexpr std::size_t kScreenPoses = 44;      ///< poses that rank hypotheses
constexpr std::size_t kFewestPoses = 12;      ///< for costly hypotheses, or those of many numbers
constexpr std::size_t kLawPoses = 66;         ///< poses at which paths are measured for laws without a name
constexpr std::size_t kSecondLook = 9;        ///< hypotheses that are screened again on more poses
constexpr std::size_t kSecondLookPoses = 66;  ///< number of these poses; geometries are screened on all
constexpr std::size_t kSuspects = 6;          ///< actors whose geometry is tried
constexpr std::size_t kNeighbours = 2;        ///< actors near a place where an object seems to stand
constexpr std::size_t kMostElsewhere = 2;     ///< actors that are searched for by a shift of their echoes
constexpr double kGainPerNumber_nats = 0.5;   ///< expected gain per number by chance

bool hasMoreScreenedNats(const Screened& a, const Screened& b) { return a.screened_nats > b.screened_nats; }

/// Screens of one round.
class Looks {
 public:
  Looks(DiagnosisContext& context, HypothesisScreen& screen, const std::vector<Hypothesis>& all,
        const ModelState& state)
      : context_(context), screen_(screen), all_(all), state_(state) {}

  /// Chooses the actors whose geometry is tried, and those that are searched for at other places.
  void suspect(const std::vector<RangeShift>& shifted);
  /// Searches for objects and late points that the twin lacks. Actors near an object become suspicious.
  void placeObjects();
  /// Screens every hypothesis, then the best ones on more poses. without_gain: see HypothesisRanking.
  void lookAtAll(std::set<std::string>& without_gain);
  void lookAgain();
  void addLaws();
  void addReplicas();
  void addDelays();
  void addSharedLatents();
  void addPlaced();
  /// All hypotheses that were screened, highest screened gain first.
  std::vector<Screened> ranked();

 private:
  std::vector<int> spread(std::size_t wanted) const { return evenlySpread(context_.data.poses.size(), wanted); }
  const std::string& nameOf(int actor) const {
    return context_.twin.scene().actors[static_cast<std::size_t>(actor)].name;
  }
  /// Actor that a hypothesis moves and that is searched for at other places; else -1.
  int outOfPlace(const Hypothesis& hypothesis) const;
  Screened look(const Hypothesis& hypothesis, const std::vector<int>& poses);
  Screened lookAtSome(const Hypothesis& hypothesis) { return look(hypothesis, spread(kScreenPoses)); }
  std::vector<Screened> bestOf(std::size_t most, const std::vector<ProjectedPlace>& places,
                               Hypothesis (*hypothesisAt)(const ProjectedPlace&));
  /// Subtracts the gain by chance: half a nat per number on the poses of the screen, scaled to all poses.
  void takeOffChance(std::size_t poses, Screened& screened) const;
  /// Adds a hypothesis that another screen suggests, or adds its start to a known hypothesis.
  void suggest(Screened screened);

  DiagnosisContext& context_;
  HypothesisScreen& screen_;
  const std::vector<Hypothesis>& all_;
  const ModelState& state_;
  std::set<std::string> suspicious_;  ///< actors whose geometry is tried
  std::set<int> out_of_place_;        ///< actors that are searched for at other places
  std::vector<Screened> placed_;      ///< objects and late points
  std::vector<Screened> boxes_;       ///< boxes that a side shows
  std::vector<Screened> screened_;
  std::map<std::string, std::size_t> looked_at_;  ///< number of poses, by label
};

void Looks::suspect(const std::vector<RangeShift>& shifted) {
  const auto suspects = screen_.suspects(state_);
  for (std::size_t i = 0; i < std::min(kSuspects, suspects.size()); ++i) {
    suspicious_.insert(nameOf(suspects[i].first));
  }
  for (const auto& [actor, nats] : suspects) {
    if (nats > bounds::kLeastNatsOutOfPlace && out_of_place_.size() < kMostOutOfPlace) out_of_place_.insert(actor);
  }
  for (std::size_t i = 0; i < std::min(kMostElsewhere, shifted.size()); ++i) {
    suspicious_.insert(nameOf(shifted[i].actor));
    out_of_place_.insert(shifted[i].actor);
  }
}

int Looks::outOfPlace(const Hypothesis& hypothesis) const {
  const int actor = context_.twin.scene().actorIndex(hypothesis.subject);
  return hypothesis.isMove() && out_of_place_.count(actor) > 0 ? actor : -1;
}

Screened Looks::look(const Hypothesis& hypothesis, const std::vector<int>& poses) {
  const int actor = outOfPlace(hypothesis);
  return actor >= 0 ? screen_.around(state_, hypothesis, actor, poses) : screen_.screen(state_, hypothesis, poses);
}

std::vector<Screened> Looks::bestOf(std::size_t most, const std::vector<ProjectedPlace>& places,
                                    Hypothesis (*hypothesisAt)(const ProjectedPlace&)) {
  std::vector<Screened> best;
  for (const ProjectedPlace& place : places) best.push_back(lookAtSome(hypothesisAt(place)));
  std::stable_sort(best.begin(), best.end(), hasMoreScreenedNats);
  best.resize(std::min(most, best.size()));
  return best;
}

void Looks::placeObjects() {
  context_.report("objects that the twin lacks", 0);
  placed_ = bestOf(kMostObjects, projectBack(context_.twin, context_.likelihood, state_), objectAt);
  const std::size_t objects = placed_.size();
  for (Screened& s : bestOf(1, projectLateBack(context_.twin, context_.likelihood, state_), lateEchoAt)) {
    placed_.push_back(std::move(s));
  }
  for (const ProjectedPlace& side : projectSidesBack(context_.twin, context_.likelihood, state_)) {
    if (!(side.screened_nats > bounds::kLeastNatsOfLaw)) break;
    boxes_.push_back(screen_.amongStarts(state_, boxFacing(context_.data, side), spread(kScreenPoses)));
  }
  context_.echoes.setBaseline(state_.mechanisms);
  for (std::size_t i = 0; i < objects; ++i) {
    const double least_nats = i == 0 ? bounds::kLeastNatsOfObject : bounds::kLeastNatsOfLaw;
    if (!(placed_[i].screened_nats > least_nats)) break;
    // The object may be an actor of the scene that stands elsewhere.
    const NamedParameters& m = placed_[i].hypothesis.mechanism;
    std::vector<int> near = objectsNear(context_.twin.scene(), m.values.number("x_m"), m.values.number("y_m"));
    near.resize(std::min(near.size(), kNeighbours));
    for (int actor : near) suspicious_.insert(nameOf(actor));
    out_of_place_.insert(near.begin(), near.end());
  }
}

void Looks::takeOffChance(std::size_t poses, Screened& screened) const {
  const double numbers = static_cast<double>(screened.hypothesis.coordinates.size());
  screened.screened_nats -=
      kGainPerNumber_nats * numbers * static_cast<double>(context_.data.poses.size()) / static_cast<double>(poses);
}

void Looks::lookAtAll(std::set<std::string>& without_gain) {
  for (std::size_t i = 0; i < all_.size(); ++i) {
    const Hypothesis& hypothesis = all_[i];
    if (hypothesis.form() == MechanismForm::kTransmitterDelay) continue;  // has starts of its own
    context_.report("trying " + hypothesis.label(), static_cast<double>(i) / static_cast<double>(all_.size()));
    const bool of_actor = context_.twin.scene().actorIndex(hypothesis.subject) >= 0;
    const std::vector<double> typical(hypothesis.coordinates.size(), 1.0);
    // A costly hypothesis traces the session again. For actors without suspicion only one-sided hypotheses are tried,
    // on a few poses.
    const bool costly = of_actor && suspicious_.count(hypothesis.subject) == 0 &&
                        context_.echoes.altersGeometry(hypothesis.at(typical));
    if (costly && (!hypothesis.isOneSided() || without_gain.count(hypothesis.label()) > 0)) continue;
    // A hypothesis of more numbers needs more evaluations, so that fewer poses rank it.
    std::vector<int> poses =
        spread(costly ? kFewestPoses : std::max(kFewestPoses, kScreenPoses / (1 + hypothesis.coordinates.size() / 3)));
    Screened s = look(hypothesis, poses);
    // around() scales its gain to all poses.
    if (outOfPlace(hypothesis) >= 0) poses = spread(context_.data.poses.size());
    if (costly && !(s.screened_nats > 0)) without_gain.insert(hypothesis.label());
    takeOffChance(poses.size(), s);
    looked_at_[s.hypothesis.label()] = poses.size();
    screened_.push_back(std::move(s));
    context_.echoes.setBaseline(state_.mechanisms);
  }
  std::stable_sort(screened_.begin(), screened_.end(), hasMoreScreenedNats);
}

void Looks::lookAgain() {
  // All geometries are kept: latents absorb most of an error of all ranges or directions, which makes its score small.
  std::size_t kept = 0;
  screened_.erase(std::remove_if(screened_.begin(), screened_.end(),
                                 [&](const Screened& s) { return ++kept > kSecondLook && !s.hypothesis.isGeometry(); }),
                  screened_.end());
  for (Screened& screened : screened_) {
    context_.report("looking again at " + screened.hypothesis.label(), 0);
    const double numbers = static_cast<double>(screened.hypothesis.coordinates.size());
    const std::vector<int> poses = spread(numbers > 3                        ? kScreenPoses
                                          : screened.hypothesis.isGeometry() ? context_.data.poses.size()
                                                                             : kSecondLookPoses);
    if (looked_at_[screened.hypothesis.label()] < poses.size()) {
      screened = screen_.screen(state_, screened.hypothesis, poses);
      takeOffChance(poses.size(), screened);
      context_.echoes.setBaseline(state_.mechanisms);
    }
    screened.screened_nats -= numbers;
  }
}

void Looks::suggest(Screened screened) {
  const auto same = std::find_if(screened_.begin(), screened_.end(), [&](const Screened& other) {
    return other.hypothesis.label() == screened.hypothesis.label();
  });
  if (same == screened_.end()) {
    screened_.push_back(std::move(screened));
  } else {
    same->screened_nats = std::max(same->screened_nats, screened.screened_nats);
    same->starts.push_back(screened.starts.front());
  }
}

void Looks::addLaws() {
  context_.report("laws without a name", 0);
  ScreenedLaws laws = screenLaws(context_.twin, context_.likelihood, state_, spread(kLawPoses));
  const auto isNoName = [&](const Screened& s) {
    return s.hypothesis.form() == MechanismForm::kGainOverTime && !laws.gains_follow_time;
  };
  screened_.erase(std::remove_if(screened_.begin(), screened_.end(), isNoName), screened_.end());
  for (Screened& s : laws.laws) {
    if (std::optional<Screened> named = namedLike(s, all_); named && !isNoName(*named)) suggest(std::move(*named));
    screened_.push_back(std::move(s));
  }
  for (const HidingPlace& place : laws.hiding) {
    if (!(place.screened_nats > bounds::kLeastNatsOfLaw)) break;
    screened_.push_back(screen_.amongStarts(state_, boxAbout(place), spread(kScreenPoses)));
  }
}

void Looks::addReplicas() {
  context_.report("replicas of echoes", 0);
  for (Screened& s : screenReplicas(context_.twin, context_.likelihood, state_, spread(kLawPoses),
                                    bounds::kLeastNatsOfLaw, [this](const Hypothesis& h) { return lookAtSome(h); })) {
    screened_.push_back(std::move(s));
  }
}

void Looks::addDelays() {
  context_.report("transmitters that come late", 0);
  std::vector<double> delays_m;
  for (const Hypothesis& h : all_) {
    if (h.form() != MechanismForm::kTransmitterDelay) continue;
    if (delays_m.empty()) delays_m = transmitterDelays_m(context_.data);
    Screened s = screen_.amongStarts(state_, *delayed(h, delays_m), spread(kScreenPoses));
    takeOffChance(std::min(kScreenPoses, context_.data.poses.size()), s);
    screened_.push_back(std::move(s));
  }
}

void Looks::addSharedLatents() {
  context_.report("errors that poses and actors share", 0);
  for (Screened& s : sharedLatents(context_.echoes, state_, context_.likelihood.spread(), context_.pose_accuracy, all_,
                                   spread(kScreenPoses))) {
    suggest(std::move(s));
  }
}

void Looks::addPlaced() {
  context_.echoes.setBaseline(state_.mechanisms);
  for (Screened& s : boxes_) screened_.push_back(std::move(s));
  for (Screened& s : placed_) {
    freePlace(context_.data, s);
    screened_.push_back(std::move(s));
  }
}

std::vector<Screened> Looks::ranked() {
  std::stable_sort(screened_.begin(), screened_.end(), hasMoreScreenedNats);
  return std::move(screened_);
}

}  // namespace

std::vector<RangeShift> HypothesisRanking::shifted(const ModelState& state) {
  context_.report("actors that stand elsewhere", 0);
  std::vector<RangeShift> shifts =
      screen_.nearerOrFarther(state, evenlySpread(context_.data.poses.size(), kScreenPoses));
  const auto far = [](const RangeShift& s) { return s.nats >= bounds::kLeastNatsElsewhere; };
  shifts.erase(std::partition_point(shifts.begin(), shifts.end(), far), shifts.end());
  return shifts;
}

std::vector<Screened> HypothesisRanking::rank(const std::vector<Hypothesis>& all, const ModelState& state,
                                              const std::vector<RangeShift>& shifted) {
  Looks looks(context_, screen_, all, state);
  looks.suspect(shifted);
  looks.placeObjects();
  looks.lookAtAll(without_gain_);
  looks.lookAgain();
  looks.addLaws();
  looks.addReplicas();
  looks.addDelays();
  looks.addSharedLatents();
  looks.addPlaced();
  return looks.ranked();
}

}  // namespace mmradartwin::diagnosis::search
