#include "diagnosis/report/cause_words.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/text.h"
#include "page/shipped_templates.h"

namespace mmradartwin::diagnosis::report {
namespace {

constexpr const char* kFile = "causes.md";
constexpr const char* kOthers = "*";  ///< the row of causes that have none
constexpr const char* kOfAll = "cause action values";

/// Cells of a row of a table in Markdown; none where it is no row.
std::vector<std::string> cellsOf(const std::string& line) {
  std::vector<std::string> cells;
  if (line.rfind("| ", 0) != 0) return cells;
  std::size_t from = 2;
  for (std::size_t at = line.find(" |", from); at != std::string::npos; at = line.find(" |", from)) {
    cells.push_back(line.substr(from, at - from));
    from = std::min(at + 3, line.size());
  }
  return cells;
}

page::PageNames namesOf(const std::string& cause) {
  page::PageNames names = page::pageNames(kOfAll);
  if (cause == kOthers) return names;
  for (const CauseParameter& parameter : causeDescription(cause).parameters) {
    names.names.push_back(parameter.name);
    names.names.push_back("with_" + parameter.name);
    names.lists["with_" + parameter.name] = {};
  }
  return names;
}

/// A cell as a template whose errors name its line; `code` in Markdown's way becomes HTML.
page::PageTemplate cellTemplate(const std::string& cell, const std::string& file, int line,
                                const page::PageNames& names) {
  std::string text(static_cast<std::size_t>(line - 1), '\n');
  bool code = false;
  for (char c : cell) {
    if (c == '`') {
      text += code ? "</code>" : "<code>";
      code = !code;
    } else {
      text += c;
    }
  }
  return {file, [&](const std::string&) { return text; }, names, page::docsGlossary()};
}

std::string withoutLines(const std::string& text) {
  return text.substr(std::min(text.find_first_not_of('\n'), text.size()));
}

std::string unitText(const std::string& unit) {
  if (unit.empty() || unit == "1") return "";
  return unit == "deg" ? "\u00b0" : " " + unit;
}

bool isKnown(const FindingParameter& parameter) {
  const auto* number = std::get_if<double>(&parameter.value);
  return number == nullptr || !std::isnan(*number);
}

page::PageValues valuesOf(const Finding& finding, std::size_t index, const page::PageNumbers& numbers) {
  const CauseDescription& cause = causeDescription(finding.cause);
  page::PageValues values = {{"cause", finding.cause}, {"action", cause.action()}};
  for (const CauseParameter& parameter : cause.parameters) {
    values[parameter.name] = "\u2013";
    values["with_" + parameter.name] = false;
  }
  std::string all;
  for (const FindingParameter& parameter : finding.parameters) {
    const std::string html = parameterHtml(parameter, index, numbers);
    values[parameter.name] = page::PageValue::html(html);
    values["with_" + parameter.name] = isKnown(parameter);
    all += (all.empty() ? "" : ", ") + htmlEscape(parameter.name) + " = " + html;
  }
  values["values"] = page::PageValue::html(all);
  return values;
}

}  // namespace

std::string parameterHtml(const FindingParameter& parameter, std::size_t finding, const page::PageNumbers& numbers) {
  const std::string at = "/findings/" + std::to_string(finding) + "/parameters/" + parameter.name;
  const std::string unit = unitText(parameter.unit);
  if (const auto* text = std::get_if<std::string>(&parameter.value)) return htmlEscape(*text);
  if (const auto* texts = std::get_if<std::vector<std::string>>(&parameter.value)) {
    return htmlEscape(mmradartwin::join(*texts, ", "));
  }
  if (const auto* list = std::get_if<std::vector<double>>(&parameter.value)) {
    std::string html;
    for (std::size_t i = 0; i < list->size(); ++i) {
      html += (i == 0 ? "" : ", ") + numbers.significant(at + "/value/" + std::to_string(i));
    }
    return html + unit;
  }
  const std::string interval = numbers.interval(at + "/ci95");
  return numbers.significant(at + "/value") + unit + (interval.empty() ? "" : " (" + interval + ")");
}

CauseWords::CauseWords(const page::TemplateText& text) {
  const page::TemplateFile file = text(kFile);
  const std::string name = file.name.empty() ? kFile : file.name;
  std::istringstream lines(file.text);
  bool in_table = false;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const std::vector<std::string> cells = cellsOf(line);
    if (line.rfind("|-", 0) == 0) in_table = true;
    if (!in_table || cells.empty()) continue;
    const std::string place = name + ":" + std::to_string(number) + ": ";
    if (cells.size() != 3) throw InputError(place + "a row has three cells: cause, what is wrong, what to do");
    if (cells[0] != kOthers && !isCatalogued(cells[0])) {
      std::vector<std::string> known;
      for (const CauseDescription& cause : causeDescriptions()) known.push_back(cause.name);
      throw InputError(place + "there is no cause '" + cells[0] + "'; " + didYouMean(cells[0], known) +
                       "known: " + mmradartwin::join(known, ", "));
    }
    const page::PageNames names = namesOf(cells[0]);
    rows_.insert_or_assign(
        cells[0], Row{cellTemplate(cells[1], name, number, names), cellTemplate(cells[2], name, number, names)});
  }
  if (rows_.count(kOthers) == 0) {
    throw InputError(name + ": lacks the row '*', of causes without a row of their own");
  }
}

const CauseWords::Row& CauseWords::rowOf(const std::string& cause) const {
  const auto found = rows_.find(cause);
  return found != rows_.end() ? found->second : rows_.at(kOthers);
}

std::string CauseWords::wrong(const Finding& finding, std::size_t index, const page::PageNumbers& numbers) const {
  return withoutLines(rowOf(finding.cause).wrong.render(valuesOf(finding, index, numbers)));
}

std::string CauseWords::toDo(const Finding& finding, std::size_t index, const page::PageNumbers& numbers) const {
  return withoutLines(rowOf(finding.cause).to_do.render(valuesOf(finding, index, numbers)));
}

}  // namespace mmradartwin::diagnosis::report
