#pragma once

#include <map>
#include <string>

#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"
#include "page/page_numbers.h"
#include "page/page_template.h"

namespace mmradartwin::diagnosis::report {

/// What a report says of each cause and what to do about it: the rows of causes.md.
class CauseWords {
 public:
  /// Throws InputError, with file and line, for a row that names a parameter which its cause lacks.
  explicit CauseWords(const page::TemplateText& text);
  /// HTML. numbers: of findings.json; index: of the finding in it.
  std::string wrong(const Finding& finding, std::size_t index, const page::PageNumbers& numbers) const;
  std::string toDo(const Finding& finding, std::size_t index, const page::PageNumbers& numbers) const;

 private:
  struct Row {
    page::PageTemplate wrong, to_do;
  };
  const Row& rowOf(const std::string& cause) const;

  std::map<std::string, Row> rows_;
};

/// A parameter of a finding with unit and interval, HTML.
std::string parameterHtml(const FindingParameter& parameter, std::size_t finding, const page::PageNumbers& numbers);

}  // namespace mmradartwin::diagnosis::report
