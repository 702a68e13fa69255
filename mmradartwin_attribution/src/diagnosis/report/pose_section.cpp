#include "diagnosis/report/pose_section.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "mmradartwin_attribution/pose_picture.h"
#include "page/page_picture.h"

namespace mmradartwin::diagnosis::report {
namespace {

using page::PageNumbers;
using page::PageValue;
using page::PageValues;

constexpr std::size_t kWorst = 2;  ///< poses that are shown as the worst

int sumOf(const std::array<int, 3>& counts) { return std::accumulate(counts.begin(), counts.end(), 0); }

nlohmann::json figuresOf(const Evaluation& evaluation, const PoseResult& pose) {
  const double share = evaluation.explainedShare(pose);
  return {{"explained_power", std::isfinite(share) ? nlohmann::json(share) : nlohmann::json(nullptr)},
          {"active", sumOf(pose.attribution.central.active)},
          {"recalled", sumOf(pose.attribution.central.recalled)}};
}

/// Results of the poses that could be compared, by name.
std::map<std::string, const PoseResult*> usedPoses(const Evaluation& evaluation) {
  std::map<std::string, const PoseResult*> used;
  for (const PoseResult& pose : evaluation.poses) {
    if (pose.used) used[pose.pose.name] = &pose;
  }
  return used;
}

std::string matchedText(const PageNumbers& numbers, const std::string& at) {
  return numbers.count(at + "/recalled") + " of " + numbers.count(at + "/active");
}

std::string figuresSentence(const PageNumbers& numbers, const std::string& at, const std::string& twin) {
  return twin + " explains " + numbers.percent(at + "/explained_power") + " of the pose's power; " +
         matchedText(numbers, at) + " expected places match.";
}

PageValue pictureOf(const cv::Mat& picture, const std::string& what, const std::string& pose) {
  return PageValue::html(page::pictureHtml(picture, what + " of pose " + pose));
}

/// A pose's maps with both twins, to one scale of range.
PageValues shownPose(const DiagnosedPoses& poses, const PoseResult& given, const PoseResult* corrected,
                     const PageNumbers& numbers, const std::string& at) {
  const std::string& name = given.pose.name;
  PoseFanStyle style;
  style.numbers = false;
  style.range_m = std::max(shownRange_m(poses.field, given), corrected ? shownRange_m(poses.field, *corrected) : 0);
  const auto fans = drawPoseFans(poses.field, given, style);
  PageValues item = {{"pose", name},
                     {"measured", pictureOf(fans[0], "measured map", name)},
                     {"simulated", pictureOf(fans[1], "map of the twin as given", name)},
                     {"difference", pictureOf(fans[2], "twin as given minus measured", name)},
                     {"sentence", PageValue::html(figuresSentence(numbers, at + "/given", "The twin as given"))}};
  std::vector<PageValues> with;
  if (corrected) {
    const auto after = drawPoseFans(poses.field, *corrected, style);
    with.push_back({{"simulated", pictureOf(after[1], "map of the corrected twin", name)},
                    {"difference", pictureOf(after[2], "corrected twin minus measured", name)},
                    {"sentence", PageValue::html(figuresSentence(numbers, at + "/corrected", "The corrected twin"))}});
  }
  item["corrected"] = std::move(with);
  return item;
}

std::vector<PageValues> poseRows(const PageNumbers& numbers, const std::map<std::string, std::size_t>& index) {
  std::vector<PageValues> rows;
  for (const nlohmann::json& name : numbers.values()["worst_first"]) {
    const std::string at = "/poses/" + std::to_string(index.at(name));
    std::vector<PageValues> corrected;
    if (!numbers.values().at(nlohmann::json::json_pointer(at))["corrected"].is_null()) {
      corrected.push_back({{"share", PageValue::html(numbers.percent(at + "/corrected/explained_power"))},
                           {"matched", PageValue::html(matchedText(numbers, at + "/corrected"))}});
    }
    rows.push_back({{"pose", name.get<std::string>()},
                    {"given", PageValue::html(numbers.percent(at + "/given/explained_power"))},
                    {"matched", PageValue::html(matchedText(numbers, at + "/given"))},
                    {"corrected", std::move(corrected)}});
  }
  return rows;
}

}  // namespace

void addPoseSummary(const DiagnosedPoses& poses, nlohmann::json& summary) {
  std::map<std::string, const PoseResult*> corrected;
  if (poses.corrected) corrected = usedPoses(*poses.corrected);
  std::vector<std::pair<double, std::string>> order;
  summary["poses"] = nlohmann::json::array();
  for (const PoseResult& pose : poses.given.poses) {
    if (!pose.used) continue;
    const auto after = corrected.find(pose.pose.name);
    summary["poses"].push_back({{"pose", pose.pose.name},
                                {"location", pose.pose.location},
                                {"given", figuresOf(poses.given, pose)},
                                {"corrected", after == corrected.end() ? nlohmann::json(nullptr)
                                                                       : figuresOf(*poses.corrected, *after->second)}});
    const double share = poses.given.explainedShare(pose);
    order.emplace_back(std::isfinite(share) ? share : INFINITY, pose.pose.name);
  }
  std::stable_sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  summary["worst_first"] = nlohmann::json::array();
  for (const auto& [share, name] : order) summary["worst_first"].push_back(name);
}

void addPoseValues(const DiagnosedPoses* poses, const PageNumbers& summary, PageValues& values) {
  values["has_poses"] = false;
  values["has_corrected"] = false;
  values["shown_poses"] = std::vector<PageValues>();
  values["poses"] = std::vector<PageValues>();
  if (!poses || summary.values()["poses"].empty()) return;
  std::map<std::string, const PoseResult*> corrected;
  const std::map<std::string, const PoseResult*> given = usedPoses(poses->given);
  if (poses->corrected) corrected = usedPoses(*poses->corrected);
  std::map<std::string, std::size_t> index;
  for (const nlohmann::json& pose : summary.values()["poses"]) index.emplace(pose["pose"], index.size());
  const nlohmann::json& order = summary.values()["worst_first"];
  std::vector<std::pair<std::size_t, std::string>> chosen;  // place in the order, and what it is called
  for (std::size_t i = 0; i < std::min(kWorst, order.size()); ++i) {
    chosen.emplace_back(i, i == 0 ? "worst" : "second worst");
  }
  if (order.size() > kWorst) chosen.emplace_back(order.size() - 1, "best");
  std::vector<PageValues> items;
  for (const auto& [place, rank] : chosen) {
    const std::string name = order[place];
    const auto after = corrected.find(name);
    PageValues item = shownPose(*poses, *given.at(name), after == corrected.end() ? nullptr : after->second, summary,
                                "/poses/" + std::to_string(index.at(name)));
    item["rank"] = rank;
    items.push_back(std::move(item));
  }
  values["has_poses"] = true;
  values["has_corrected"] = poses->corrected.has_value();
  values["shown_poses"] = std::move(items);
  values["poses"] = poseRows(summary, index);
}

}  // namespace mmradartwin::diagnosis::report
