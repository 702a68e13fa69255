#include "page/page_template.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <stdexcept>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/text.h"

namespace mmradartwin::page {
namespace {

constexpr int kMostIncludes = 8;  ///< within each other

std::string trimmed(const std::string& text) {
  const auto blank = [](unsigned char c) { return std::isspace(c) != 0; };
  const auto first = std::find_if_not(text.begin(), text.end(), blank);
  const auto last = std::find_if_not(text.rbegin(), std::make_reverse_iterator(first), blank).base();
  return std::string(first, last);
}

PageNames namesFrom(const std::vector<std::string>& words, std::size_t& at) {
  PageNames names;
  for (; at < words.size() && words[at] != "]"; ++at) {
    if (words[at] != "[") {
      names.names.push_back(words[at]);
      continue;
    }
    ++at;
    names.lists[names.names.back()] = namesFrom(words, at);
  }
  return names;
}

}  // namespace

PageNames pageNames(const std::string& text) {
  std::vector<std::string> words(1);
  for (char c : text) {
    if (c == '[' || c == ']') {
      words.emplace_back(1, c);
      words.emplace_back();
    } else if (c == ' ') {
      words.emplace_back();
    } else {
      words.back() += c;
    }
  }
  words.erase(std::remove(words.begin(), words.end(), ""), words.end());
  std::size_t at = 0;
  return namesFrom(words, at);
}

/// Reads one template with those that it includes.
class PageTemplate::Reader {
 public:
  Reader(const TemplateText& text, const PageNames& names, const Glossary& glossary)
      : text_(text), glossary_(glossary), scopes_{&names} {}

  std::vector<Node> read(const std::string& file) {
    if (++depth_ > kMostIncludes) throw InputError(file + ": includes itself");
    const Place outer = place_;
    const TemplateFile read = text_(file);
    place_ = {read.name.empty() ? file : read.name, read.text, 0, 1};
    std::vector<Node> nodes = nodesUpTo("");
    place_ = outer;
    --depth_;
    return nodes;
  }

 private:
  struct Place {
    std::string file, text;
    std::size_t at = 0;
    int line = 1;
  };

  [[noreturn]] void fail(int line, const std::string& what) const {
    throw InputError(place_.file + ":" + std::to_string(line) + ": " + what);
  }

  /// Text up to `end`, which is read, too. False where it does not come.
  bool take(const std::string& end, std::string& taken) {
    const std::size_t found = place_.text.find(end, place_.at);
    taken = place_.text.substr(place_.at, found == std::string::npos ? found : found - place_.at);
    place_.line += static_cast<int>(std::count(taken.begin(), taken.end(), '\n'));
    place_.at = found == std::string::npos ? place_.text.size() : found + end.size();
    return found != std::string::npos;
  }

  std::vector<std::string> knownNames() const {
    std::set<std::string> known;
    for (const PageNames* scope : scopes_) known.insert(scope->names.begin(), scope->names.end());
    return {known.begin(), known.end()};
  }

  void requireKnown(const std::string& name, bool list, int line) const {
    const std::vector<std::string> known = knownNames();
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      fail(line, "there is no name '" + name + "'; " + didYouMean(name, known) + "known here: " + join(known, ", "));
    }
    const bool is_list = listOf(name) != nullptr;
    if (list && !is_list) fail(line, "'" + name + "' is a single value and no list: write {{" + name + "}}");
    if (!list && is_list) {
      fail(line, "'" + name + "' is a list: write {{#" + name + "}} ... {{/" + name + "}}");
    }
  }

  const PageNames* listOf(const std::string& name) const {
    for (auto scope = scopes_.rbegin(); scope != scopes_.rend(); ++scope) {
      const auto found = (*scope)->lists.find(name);
      if (found != (*scope)->lists.end()) return &found->second;
      if (std::count((*scope)->names.begin(), (*scope)->names.end(), name) > 0) return nullptr;
    }
    return nullptr;
  }

  const std::string& meaningOf(const std::string& word, int line) const {
    const std::string* meaning = glossary_.meaning(word);
    if (meaning != nullptr) return *meaning;
    fail(line, "the glossary has no word '" + word + "'; " + didYouMean(word, glossary_.words()) +
                   "known: " + join(glossary_.words(), ", "));
  }

  Node wordNode(const std::string& text, int line) const {
    const std::size_t bar = text.find('|');
    const std::string word = text.substr(0, bar);
    const std::string& meaning = meaningOf(word, line);
    return {Kind::kWord, wordHtml(bar == std::string::npos ? word : text.substr(bar + 1), meaning), {}};
  }

  /// Nodes up to {{/list}}, or to the end where list is "".
  std::vector<Node> nodesUpTo(const std::string& list) {
    std::vector<Node> nodes;
    const int begun = place_.line;
    while (true) {
      std::string text, tag;
      const bool more = take("{{", text);
      if (!text.empty()) nodes.push_back({Kind::kText, text, {}});
      if (!more) break;
      const int line = place_.line;
      if (!take("}}", tag)) fail(line, "a {{ without its }}");
      tag = trimmed(tag);
      const char sign = tag.empty() ? ' ' : tag.front();
      const std::string name =
          trimmed(tag.substr(tag.empty() || std::isalnum(static_cast<unsigned char>(sign)) ? 0 : 1));
      if (sign == '!') continue;
      if (sign == '>') {
        for (Node& node : read(name)) nodes.push_back(std::move(node));
      } else if (sign == '?') {
        nodes.push_back(wordNode(name, line));
      } else if (sign == '=') {
        nodes.push_back({Kind::kText, htmlEscape(meaningOf(name, line)), {}});
      } else if (sign == '/') {
        if (name != list) fail(line, "{{/" + name + "}} closes " + (list.empty() ? "nothing" : "{{#" + list + "}}"));
        return nodes;
      } else if (sign == '#' || sign == '^') {
        requireKnown(name, true, line);
        scopes_.push_back(listOf(name));
        Node node{sign == '#' ? Kind::kList : Kind::kEmptyList, name, nodesUpTo(name)};
        scopes_.pop_back();
        nodes.push_back(std::move(node));
      } else {
        requireKnown(name, false, line);
        nodes.push_back({Kind::kName, name, {}});
      }
    }
    if (!list.empty()) fail(begun, "{{#" + list + "}} is not closed");
    return nodes;
  }

  const TemplateText& text_;
  const Glossary& glossary_;
  std::vector<const PageNames*> scopes_;
  Place place_;
  int depth_ = 0;
};

PageTemplate::PageTemplate(const std::string& file, const TemplateText& text, const PageNames& names,
                           const Glossary& glossary)
    : nodes_(Reader(text, names, glossary).read(file)) {}

void PageTemplate::render(const std::vector<Node>& nodes, std::vector<const PageValues*>& scopes, std::string& page) {
  const auto valueOf = [&](const std::string& name) -> const PageValue& {
    for (auto scope = scopes.rbegin(); scope != scopes.rend(); ++scope) {
      const auto found = (*scope)->find(name);
      if (found != (*scope)->end()) return found->second;
    }
    throw std::logic_error("the page has no value for '" + name + "'");
  };
  for (const Node& node : nodes) {
    if (node.kind == Kind::kText || node.kind == Kind::kWord) {
      page += node.text;
      continue;
    }
    const PageValue& value = valueOf(node.text);
    if (node.kind == Kind::kName) {
      page += value.isHtml() ? value.text() : htmlEscape(value.text());
    } else if (node.kind == Kind::kEmptyList) {
      if (value.items().empty()) render(node.nodes, scopes, page);
    } else {
      for (const PageValues& item : value.items()) {
        scopes.push_back(&item);
        render(node.nodes, scopes, page);
        scopes.pop_back();
      }
    }
  }
}

std::string PageTemplate::render(const PageValues& values) const {
  std::string page;
  std::vector<const PageValues*> scopes = {&values};
  render(nodes_, scopes, page);
  return page;
}

}  // namespace mmradartwin::page
