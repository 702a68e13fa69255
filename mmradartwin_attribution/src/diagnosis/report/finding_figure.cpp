#include "diagnosis/report/finding_figure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <set>
#include <string>

#include "mmradartwin_dsp/map_picture.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin::diagnosis::report {
namespace {

constexpr int kHeight_px = 470;
constexpr double kLargeLetters = 1.7;  ///< of the parts one by one, against those of the whole figure
constexpr double kLimit_db = 12;       ///< end of the maps' colour scale
const cv::Scalar kPaper(255, 255, 255), kInk(40, 40, 40), kSoft(205, 205, 205), kWall(150, 150, 150),
    kBlue(200, 100, 20), kRed(30, 30, 220), kFaint(170, 170, 240);

/// A part of the map, drawn with x to the right and y up.
class PlanView {
 public:
  PlanView(const Eigen::AlignedBox2d& shown, double letters)
      : shown_(shown),
        letters_(letters),
        margin_px_(static_cast<int>(34 * letters)),
        px_per_m_((kHeight_px - 2 * margin_px_) / std::max(shown.sizes().x() / kWidest, shown.sizes().y())),
        picture_(kHeight_px, 2 * margin_px_ + static_cast<int>(px_per_m_ * shown.sizes().x()), CV_8UC3, kPaper) {}
  cv::Point at(const Eigen::Vector2d& p_m) const {
    return {margin_px_ + static_cast<int>(std::lround(px_per_m_ * (p_m.x() - shown_.min().x()))),
            kHeight_px - margin_px_ - static_cast<int>(std::lround(px_per_m_ * (p_m.y() - shown_.min().y())))};
  }
  void line(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m, const cv::Scalar& color, int width_px) {
    cv::line(picture_, at(from_m), at(to_m), color, width_px, cv::LINE_AA);
  }
  void text(const std::string& words, const cv::Point& at_px, const cv::Scalar& color) {
    cv::putText(picture_, words, at_px, cv::FONT_HERSHEY_SIMPLEX, 0.4 * letters_, color, letters_ > 1.5 ? 2 : 1,
                cv::LINE_AA);
  }
  /// A shift of a text by so much at the usual size of letters.
  cv::Point beside(double x_px, double y_px) const { return {cvRound(x_px * letters_), cvRound(y_px * letters_)}; }
  int margin_px() const { return margin_px_; }
  double px_per_m() const { return px_per_m_; }
  cv::Mat& picture() { return picture_; }

 private:
  static constexpr double kWidest = 1.6;  ///< width over height
  Eigen::AlignedBox2d shown_;
  double letters_;
  int margin_px_;
  double px_per_m_;
  cv::Mat picture_;
};

/// Whole metres around walls, stations and places.
Eigen::AlignedBox2d extent(const SurveyPlan& plan, const std::vector<Eigen::Vector2d>& places) {
  Eigen::AlignedBox2d box;
  for (const SurveyPlan::Wall& w : plan.walls) box.extend(w.from_m).extend(w.to_m);
  for (const SurveyPlan::Station& s : plan.stations) box.extend(s.at_m);
  for (const Eigen::Vector2d& p : places) box.extend(p);
  return {(box.min().array() - 0.5).floor().matrix(), (box.max().array() + 0.5).ceil().matrix()};
}

void drawGrid(PlanView& view, const Eigen::AlignedBox2d& shown) {
  const double step = std::max(1.0, std::ceil(shown.sizes().maxCoeff() / 12));
  for (double x = shown.min().x(); x <= shown.max().x(); x += step) {
    view.line({x, shown.min().y()}, {x, shown.max().y()}, kSoft, 1);
    const std::string number = cv::format("%g", x);
    const double half_px = 4.0 * static_cast<double>(number.size());
    view.text(number, view.at({x, shown.min().y()}) + view.beside(-half_px, 15), kInk);
  }
  for (double y = shown.min().y(); y <= shown.max().y(); y += step) {
    view.line({shown.min().x(), y}, {shown.max().x(), y}, kSoft, 1);
    view.text(cv::format("%g", y), view.at({shown.min().x(), y}) + view.beside(-20, 4), kInk);
  }
}

/// Move of an actor in the floor plane, by a mechanism actor_moved that leaves its middle at `to_m`.
Eigen::Isometry2d moveOf(const NamedParameters& moved, const Eigen::Vector2d& to_m) {
  const Eigen::Vector2d by_m(moved.values.number("dx_m"), moved.values.number("dy_m"));
  return Eigen::Translation2d(to_m) * Eigen::Rotation2Dd(moved.values.number("dyaw_deg") * M_PI / 180) *
         Eigen::Translation2d(by_m - to_m);
}

std::set<std::string> actorsOf(const Finding& f) {
  std::set<std::string> names;
  for (const FindingPlace& place : f.where) names.insert(place.actors.begin(), place.actors.end());
  for (const FindingParameter& p : f.parameters) {
    if (const auto* text = std::get_if<std::string>(&p.value)) names.insert(*text);
    if (const auto* texts = std::get_if<std::vector<std::string>>(&p.value)) names.insert(texts->begin(), texts->end());
  }
  return names;
}

cv::Mat drawPlan(const Finding& f, const SurveyPlan& plan, double letters) {
  std::vector<Eigen::Vector2d> places;
  std::set<std::string> poses;
  for (const FindingPlace& place : f.where) {
    if (place.x_m && place.y_m) places.emplace_back(*place.x_m, *place.y_m);
    poses.insert(place.poses.begin(), place.poses.end());
  }
  const std::set<std::string> actors = actorsOf(f);
  const Eigen::AlignedBox2d shown = extent(plan, places);
  PlanView view(shown, letters);
  drawGrid(view, shown);
  for (const SurveyPlan::Wall& w : plan.walls) view.line(w.from_m, w.to_m, kWall, 1);
  const bool moved = traitsOf(f.cause).form == MechanismForm::kActorMoved && f.mechanism && places.size() == 1;
  for (const SurveyPlan::Wall& w : plan.walls) {
    if (actors.count(w.actor) == 0) continue;
    view.line(w.from_m, w.to_m, moved ? kFaint : kRed, 2);
    if (!moved) continue;
    const Eigen::Isometry2d move = moveOf(*f.mechanism, places.front());
    view.line(move * w.from_m, move * w.to_m, kRed, 2);
  }
  for (const SurveyPlan::Station& s : plan.stations) {
    const bool carries = poses.count(s.pose) > 0;
    const cv::Scalar& color = carries ? kBlue : kWall;
    cv::circle(view.picture(), view.at(s.at_m), carries ? 4 : 2, color, cv::FILLED, cv::LINE_AA);
    view.line(s.at_m, s.at_m + s.boresight * 14 / view.px_per_m(), color, carries ? 2 : 1);
  }
  for (const Eigen::Vector2d& p : places) {
    cv::drawMarker(view.picture(), view.at(p), kRed, cv::MARKER_TILTED_CROSS, 14, 2, cv::LINE_AA);
    const auto [x_m, y_m] = f.placeError_m();
    const double x = view.px_per_m() * x_m, y = view.px_per_m() * y_m;
    if (places.size() > 1 || !(x > 0) || !(y > 0) || std::max(x, y) > kHeight_px) continue;
    cv::ellipse(view.picture(), view.at(p), cv::Size(static_cast<int>(x) + 1, static_cast<int>(y) + 1), 0, 0, 360, kRed,
                1, cv::LINE_AA);
  }
  if (letters > 1) return view.picture();  // what the colours mean stands beside it
  view.text(std::string("map [m]") + (poses.empty() ? "" : "; blue: poses that carry it most") +
                (moved                              ? "; red: where it stands"
                 : actors.empty() && places.empty() ? ""
                                                    : "; red: what it is about"),
            {view.margin_px(), 18}, kInk);
  return view.picture();
}

/// Maps without and with the finding; empty ones where it has none.
std::array<cv::Mat, 2> drawMaps(const Finding& finding, double letters) {
  if (!finding.maps) return {};
  FanStyle style;
  style.diverging = true;
  style.max_db = kLimit_db;
  style.min_db = -kLimit_db;
  style.height_px = kHeight_px;
  style.letters = letters;
  style.max_range_m = std::min(10.0, std::ceil(finding.maps->axes.range_m.back()));
  if (letters == 1) style.title = "simulated - measured, without it";
  const cv::Mat before = drawFan(finding.maps->axes, finding.maps->before_db, style);
  if (letters == 1) style.title = "with " + finding.cause;
  return {before, drawFan(finding.maps->axes, finding.maps->after_db, style)};
}

}  // namespace

cv::Mat drawFinding(const Finding& finding, const SurveyPlan& plan) {
  const cv::Mat survey = drawPlan(finding, plan, 1);
  if (!finding.maps) return survey;
  const auto [before, after] = drawMaps(finding, 1);
  cv::Mat all;
  cv::hconcat(std::vector<cv::Mat>{before, after, survey}, all);
  return all;
}

FindingParts drawFindingParts(const Finding& finding, const SurveyPlan& plan) {
  const auto [before, after] = drawMaps(finding, kLargeLetters);
  return {before, after, drawPlan(finding, plan, kLargeLetters)};
}

}  // namespace mmradartwin::diagnosis::report
