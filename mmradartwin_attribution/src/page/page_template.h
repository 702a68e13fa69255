#pragma once

#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "page/glossary.h"
#include "page/page_values.h"

namespace mmradartwin::page {

/// Names that a template may use, and those of the items of its lists.
struct PageNames {
  std::vector<std::string> names;
  std::map<std::string, PageNames> lists;
};
/// From "title poses[name picture] command": words, those of a list's items in brackets behind it.
PageNames pageNames(const std::string& text);

/// What a file of templates holds, and what errors call it; "" for its own name.
struct TemplateFile {
  TemplateFile(std::string text, std::string name = "")  // NOLINT(google-explicit-constructor): a text is one
      : text(std::move(text)), name(std::move(name)) {}
  std::string text, name;
};
/// A template by its file's name. Throws InputError where there is none.
using TemplateText = std::function<TemplateFile(const std::string& file)>;

/// A page with gaps, as files that a person can edit hold it:
///   {{name}}                    a value; a text is escaped for HTML
///   {{#list}} ... {{/list}}     once for each item; a truth is a list of one item without names
///   {{^list}} ... {{/list}}     where the list is empty
///   {{>file.html}}              what another file holds
///   {{?word}}, {{?word|shown}}  a word of the glossary with its meaning
///   {{=word}}                   the meaning alone
///   {{! remark}}
class PageTemplate {
 public:
  /// Reads `file` and what it includes and checks every name. Throws InputError with file, line and the known names for
  /// one that is not known, for a word that the glossary lacks and for a list that is not closed.
  PageTemplate(const std::string& file, const TemplateText& text, const PageNames& names, const Glossary& glossary);
  /// The page. Throws std::logic_error where a name has no value.
  std::string render(const PageValues& values) const;

 private:
  enum class Kind { kText, kName, kList, kEmptyList, kWord };
  struct Node {
    Kind kind;
    std::string text;  ///< of the page, a name, or HTML of a word
    std::vector<Node> nodes;
  };
  class Reader;
  static void render(const std::vector<Node>& nodes, std::vector<const PageValues*>& scopes, std::string& page);

  std::vector<Node> nodes_;
};

}  // namespace mmradartwin::page
