#pragma once

#include <map>
#include <string>
#include <vector>

namespace mmradartwin::page {

/// Words and their meanings, as docs/start/glossary.md has them.
class Glossary {
 public:
  /// Rows `| word, another | meaning |` of a table in Markdown; all else is passed over.
  explicit Glossary(const std::string& markdown);
  /// nullptr for a word that is not there.
  const std::string* meaning(const std::string& word) const;
  std::vector<std::string> words() const;

 private:
  std::map<std::string, std::string> meanings_;
};

/// A word that shows its meaning under the pointer, by the keyboard and by a tap.
std::string wordHtml(const std::string& shown, const std::string& meaning);

}  // namespace mmradartwin::page
