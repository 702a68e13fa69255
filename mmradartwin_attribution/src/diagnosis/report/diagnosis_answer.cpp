#include "diagnosis/report/diagnosis_answer.h"

#include <array>
#include <cctype>
#include <cmath>
#include <vector>

#include "diagnosis/report/finding_words.h"
#include "mmradartwin_dsp/text.h"

namespace mmradartwin::diagnosis::report {
namespace {

std::string pointerOf(std::size_t finding, const std::string& key) {
  return "/findings/" + std::to_string(finding) + "/" + key;
}

std::string asSentence(std::string text) {
  if (text.empty()) return text;
  text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  if (text.back() != '.') text += '.';
  return text;
}

/// "With it the twin explains 94 % of the power, without 75 %."
std::string gainSentence(const Findings& all, const page::PageNumbers& numbers, const std::string& with) {
  if (!all.findings.front().gain && !all.findings.back().gain) {
    return "What the twin gains by it cannot be measured with fewer than two places.";
  }
  std::size_t first = all.findings.size(), last = 0;
  for (std::size_t i = 0; i < all.findings.size(); ++i) {
    if (!all.findings[i].gain || std::isnan(all.findings[i].gain->explained_power.after)) continue;
    first = std::min(first, i);
    last = i;
  }
  if (first == all.findings.size()) return "It changes the single frames and no averaged map.";
  const std::string key = "gain/explained_power/";
  std::string sentence = "With " + with + " the twin explains " + numbers.percent(pointerOf(last, key + "after")) +
                         " of the power, without " + numbers.percent(pointerOf(first, key + "before")) + ".";
  const double low = numbers.value(pointerOf(last, key + "difference_ci95/0"));
  if (first == last && low <= 0) sentence += " That gain in power may be chance.";
  return sentence;
}

/// What is told of an unknown that stands alone: that it is one, and what it looks like.
std::string unknownSentences(const Finding& finding, const std::string& wrong) {
  if (!finding.description) return wrong;
  const std::string said_already = "no cause of the catalogue explains this; ";
  std::string looks = *finding.description;
  if (looks.rfind("nothing matches", 0) == 0) return htmlEscape(asSentence(looks));
  if (looks.rfind(said_already, 0) == 0) looks.erase(0, said_already.size());
  return wrong + " " + htmlEscape(asSentence(looks));
}

std::string nothingFound(const Diagnosis& diagnosis, const page::PageNumbers& summary) {
  if (!diagnosis.has_twin) {
    return "Nothing is wrong with frames and channels. There was no scene to compare them with.";
  }
  const std::string explains = "the twin explains " + summary.percent("/explained_power") + " of the measured power";
  if (diagnosis.tried.empty()) return asSentence(explains) + " Which cause could explain more was not looked for.";
  return "Nothing stands out: " + explains + ", and none of " + summary.count("/tried") +
         " explanations that were tried is more than chance.";
}

}  // namespace

std::string candidatesHtml(const Finding& finding, std::size_t index, const page::PageNumbers& numbers) {
  if (finding.candidates.size() < 2) return "";
  std::string html = "One of these it is, and the recording does not tell which:";
  for (std::size_t k = 0; k < finding.candidates.size(); ++k) {
    html += (k == 0 ? " " : ", ") + htmlEscape(finding.candidates[k].cause);
    for (const FindingParameter& p : finding.candidates[k].parameters) html += " " + htmlEscape(shownParameter(p));
    html += " (" + numbers.percent(pointerOf(index, "candidates/" + std::to_string(k) + "/probability")) + ")";
  }
  return html + ".";
}

std::string diagnosisAnswer(const Diagnosis& diagnosis, const CauseWords& words, const nlohmann::json& findings,
                            const nlohmann::json& summary) {
  const page::PageNumbers numbers(findings, "findings.json"), of_summary(summary, "summary.json");
  const std::vector<Finding>& found = diagnosis.findings.findings;
  if (found.empty()) return nothingFound(diagnosis, of_summary);
  std::string answer;
  if (found.size() > 1) {
    static const std::array<const char*, 7> kCounts = {"", "", "Two", "Three", "Four", "Five", "Six"};
    const std::string count = found.size() < kCounts.size() ? kCounts[found.size()] : std::to_string(found.size());
    answer = count + " things are wrong. ";
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i].cause == "unknown") {
      answer +=
          i == 0 ? unknownSentences(found[i], words.wrong(found[i], i, numbers)) : "What remains has no known cause.";
    } else if (found[i].candidates.size() > 1) {
      answer += candidatesHtml(found[i], i, numbers) + " The likeliest: " + words.wrong(found[i], i, numbers);
    } else {
      answer += words.wrong(found[i], i, numbers);
    }
    answer += " ";
  }
  if (!diagnosis.has_twin) return answer + "There was no scene to compare the echoes with.";
  const char* with = found.size() == 1 ? "it" : found.size() == 2 ? "both" : "all of them";
  return answer + gainSentence(diagnosis.findings, numbers, with);
}

}  // namespace mmradartwin::diagnosis::report
