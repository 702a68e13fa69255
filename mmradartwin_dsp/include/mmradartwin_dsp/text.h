#pragma once

#include <string>
#include <vector>

namespace mmradartwin {

/// `value` with this many digits after the point; `missing` where it is not finite.
std::string fixedNumber(double value, int digits, const std::string& missing = "");
/// `value` with this many significant digits, as "%.3g" writes it.
std::string significantNumber(double value, int digits);
/// The words one after the other, `separator` between them.
std::string join(const std::vector<std::string>& words, const std::string& separator);
/// True for UTF-8 without control characters, which every file and terminal can hold.
bool isPlainText(const std::string& text);
/// `text` for a message: at most 40 characters, with a question mark for each byte that is no plain ASCII character.
std::string shownShort(const std::string& text);
/// One field of a CSV line: in quotes, with quotes doubled, where it holds a comma, a quote or a line break.
std::string csvField(const std::string& text);
/// `text` as the content of an HTML element or a quoted attribute.
std::string htmlEscape(const std::string& text);

/// Letters to add, take out or change until one word is the other.
std::size_t editDistance(const std::string& a, const std::string& b);
/// "did you mean '...'? " with the known word that is closest, or "" where none is close.
std::string didYouMean(const std::string& word, const std::vector<std::string>& known);

}  // namespace mmradartwin
