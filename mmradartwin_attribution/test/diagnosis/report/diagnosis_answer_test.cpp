#include "diagnosis/report/diagnosis_answer.h"

#include <gtest/gtest.h>

#include <limits>

#include "diagnosis/report/diagnosis_page.h"
#include "mmradartwin_dsp/input_error.h"
#include "page/shipped_templates.h"

namespace mmradartwin::diagnosis::report {
namespace {

Finding named(const std::string& cause, std::vector<FindingParameter> parameters) {
  Finding finding;
  finding.cause = cause;
  finding.parameters = std::move(parameters);
  finding.candidates = {{cause, 1.0}};
  return finding;
}

Finding pattern() {
  Finding finding = named("element_pattern", {{"cos_exponent", "1", 1.948, {{{1.849, 2.043}}}}});
  finding.gain.emplace();
  finding.gain->explained_power = {0.7512, 0.9437, {{0.15, 0.22}}};
  return finding;
}

Finding bias() {
  Finding finding = named("range_bias", {{"range_m", "m", 0.05125, {{{0.0498, 0.0527}}}}});
  finding.gain.emplace();
  finding.gain->explained_power = {0.9437, 0.9601, {{0.01, 0.02}}};
  return finding;
}

Finding unknown(const std::string& description) {
  Finding finding = named("unknown", {});
  finding.description = description;
  return finding;
}

std::string answerOf(std::vector<Finding> findings, bool has_twin = true, std::size_t tried = 48) {
  Diagnosis d;
  d.has_twin = has_twin;
  d.explained_power = 0.9637;
  d.tried.resize(tried);
  d.findings.findings = std::move(findings);
  const CauseWords words(page::templatesOf(""));
  return page::shownText(diagnosisAnswer(d, words, nlohmann::json::parse(toJson(d.findings)),
                                         diagnosisSummary(d, RunDescription(), nullptr)));
}

TEST(DiagnosisAnswer, OfOneCause) {
  EXPECT_EQ(
      answerOf({pattern()}),
      "The antennas' directivity is missing: cos^1.95 (1.85 to 2.04). With it the twin explains 94.4 % of the power, "
      "without 75 %.");
}

TEST(DiagnosisAnswer, OfSeveralCauses) {
  EXPECT_EQ(
      answerOf({pattern(), bias()}),
      "Two things are wrong. The antennas' directivity is missing: cos^1.95 (1.85 to 2.04). All echoes lie farther "
      "than the scene says by 0.0512 m (0.0498 to 0.0527) (below zero: nearer). With both the twin explains 96.0 % "
      "of the power, without 75 %.");
}

TEST(DiagnosisAnswer, OfNamesThatAreNotToldApart) {
  Finding finding = pattern();
  finding.candidates = {{"element_pattern", 0.8125}, {"if_highpass", 0.1875}};
  EXPECT_EQ(
      answerOf({finding}),
      "One of these it is, and the recording does not tell which: element_pattern (81 %), if_highpass (19 %). The "
      "likeliest: The antennas' directivity is missing: cos^1.95 (1.85 to 2.04). With it the twin explains 94.4 % of "
      "the power, without 75 %.");
}

TEST(DiagnosisAnswer, OfAnUnknown) {
  EXPECT_EQ(
      answerOf({unknown("no cause of the catalogue explains this; what it looks like: a ripple")}),
      "Something is wrong that no known cause explains. What it looks like: a ripple. What the twin gains by it cannot "
      "be measured with fewer than two places.");
  EXPECT_EQ(answerOf({unknown("nothing matches: the twin explains 0.1 of the measured power")}).substr(0, 17),
            "Nothing matches: ");
}

TEST(DiagnosisAnswer, OfAnUnknownBesideACause) {
  const std::string answer = answerOf({pattern(), unknown("a ripple")});
  EXPECT_EQ(
      answer,
      "Two things are wrong. The antennas' directivity is missing: cos^1.95 (1.85 to 2.04). What remains has no known "
      "cause. With both the twin explains 94.4 % of the power, without 75 %.");
}

TEST(DiagnosisAnswer, OfNothing) {
  EXPECT_EQ(
      answerOf({}),
      "Nothing stands out: the twin explains 96.4 % of the measured power, and none of 48 explanations that were tried "
      "is more than chance.");
  EXPECT_EQ(answerOf({}, true, 0),
            "The twin explains 96.4 % of the measured power. Which cause could explain more was not looked for.");
  EXPECT_EQ(answerOf({}, false), "Nothing is wrong with frames and channels. There was no scene to compare them with.");
}

TEST(DiagnosisAnswer, OfAGainThatMayBeChance) {
  Finding finding = pattern();
  finding.gain->explained_power.difference_ci95 = {{-0.01, 0.02}};
  const std::string answer = answerOf({finding}), end = "That gain in power may be chance.";
  EXPECT_EQ(answer.substr(answer.size() - end.size()), end);
}

TEST(DiagnosisAnswer, OfFramesAlone) {
  Finding finding = named("phase_drift", {{"rad_per_frame", "rad", 0.125, {{{0.12, 0.13}}}}});
  finding.gain.emplace();
  const std::string answer = answerOf({finding});
  EXPECT_EQ(answer.rfind("Frames turn against each other by 0.125 rad (0.12 to 0.13) from one to the next", 0), 0u)
      << answer;
  EXPECT_NE(answer.find("It changes the single frames and no averaged map."), std::string::npos) << answer;
}

/// A value of every kind that a cause's parameters have.
Parameters::Value anyValue(const CauseParameter& parameter) {
  switch (parameter.kind) {
    case ParameterKind::kNumber:
      return 1.5;
    case ParameterKind::kText:
      return std::string("wall_<north>");
    case ParameterKind::kNumbers:
      return std::vector<double>{1.5, 2.5};
    default:
      return std::vector<std::string>{"wall_<north>", "wall_east"};
  }
}

TEST(CauseWords, HaveARowForEachCauseAndShowItsParameters) {
  const std::string causes = page::shippedTemplate("causes.md");
  const CauseWords words(page::templatesOf(""));
  for (const CauseDescription& cause : causeDescriptions()) {
    EXPECT_NE(causes.find("\n| " + cause.name + " | "), std::string::npos) << cause.name;
    Diagnosis d;
    Finding finding = named(cause.name, {});
    for (const CauseParameter& p : cause.parameters) finding.parameters.push_back({p.name, p.unit, anyValue(p), {}});
    d.findings.findings = {finding};
    nlohmann::json json;  // as findings.json has them
    for (const CauseParameter& p : cause.parameters) {
      json["findings"][0]["parameters"][p.name]["value"] =
          std::visit([](const auto& v) { return nlohmann::json(v); }, anyValue(p));
    }
    const page::PageNumbers numbers(json, "findings.json");
    const std::string wrong = words.wrong(finding, 0, numbers), to_do = words.toDo(finding, 0, numbers);
    EXPECT_EQ(wrong.back(), '.') << wrong;
    EXPECT_EQ(to_do.back(), '.') << to_do;
    EXPECT_EQ(wrong.find("<north>"), std::string::npos) << wrong;
    if (cause.parameters.empty()) continue;
    const bool shown =
        wrong.find("data-of") != std::string::npos || wrong.find("wall_&lt;north&gt;") != std::string::npos;
    EXPECT_TRUE(shown || cause.name == "element_pattern") << wrong;
  }
}

TEST(CauseWords, ErrorsNameTheLine) {
  const auto errorOf = [](const std::string& row) {
    const auto text = [&](const std::string&) { return "words\n\n|---|---|---|\n" + row + "\n| * | a | b |\n"; };
    try {
      const CauseWords words{page::TemplateText(text)};
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(errorOf("| range_bias | {{rnge_m}} | b |").substr(0, 80),
            "causes.md:4: there is no name 'rnge_m'; did you mean 'range_m'? known here: acti");
  EXPECT_EQ(errorOf("| range_bais | a | b |").substr(0, 74),
            "causes.md:4: there is no cause 'range_bais'; did you mean 'range_bias'? kn");
  EXPECT_EQ(errorOf("| range_bias | a |"), "causes.md:4: a row has three cells: cause, what is wrong, what to do");
  EXPECT_EQ(errorOf("| range_bias | a | b |"), "");
}

}  // namespace
}  // namespace mmradartwin::diagnosis::report
