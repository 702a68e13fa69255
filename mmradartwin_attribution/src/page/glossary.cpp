#include "page/glossary.h"

#include <algorithm>
#include <sstream>

#include "mmradartwin_dsp/text.h"

namespace mmradartwin::page {
namespace {

std::string withoutBlanksAround(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" `");
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(" `") - first + 1);
}

}  // namespace

Glossary::Glossary(const std::string& markdown) {
  std::istringstream lines(markdown);
  bool in_table = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("|-", 0) == 0) in_table = true;
    const std::size_t middle = line.find(" | ");
    if (!in_table || line.rfind("| ", 0) != 0 || middle == std::string::npos || line.size() < middle + 5) continue;
    std::string meaning = withoutBlanksAround(line.substr(middle + 3, line.rfind('|') - middle - 3));
    meaning.erase(std::remove(meaning.begin(), meaning.end(), '`'), meaning.end());
    std::istringstream words(line.substr(2, middle - 2));
    for (std::string word; std::getline(words, word, ',');) meanings_[withoutBlanksAround(word)] = meaning;
  }
}

const std::string* Glossary::meaning(const std::string& word) const {
  const auto found = meanings_.find(word);
  return found == meanings_.end() ? nullptr : &found->second;
}

std::vector<std::string> Glossary::words() const {
  std::vector<std::string> all;
  for (const auto& item : meanings_) all.push_back(item.first);
  return all;
}

std::string wordHtml(const std::string& shown, const std::string& meaning) {
  return "<span class=\"word\" tabindex=\"0\">" + htmlEscape(shown) + "<span class=\"meaning\" role=\"tooltip\"><b>" +
         htmlEscape(shown) + "</b>: " + htmlEscape(meaning) + "</span></span>";
}

}  // namespace mmradartwin::page
