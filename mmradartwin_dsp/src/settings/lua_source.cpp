#include "settings/lua_source.h"

#include <cctype>
#include <cstring>

namespace mmradartwin {
namespace {

bool isWord(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.'; }

class Scanner {
 public:
  explicit Scanner(const std::string& text) : in_(text) {}

  LuaSource scan() {
    if (in_.compare(0, 3, "\xEF\xBB\xBF") == 0) at_ = 3;
    if (at_ < in_.size() && in_[at_] == '#') out_.text += "--";
    while (at_ < in_.size()) {
      const char c = in_[at_];
      if (in_.compare(at_, 2, "--") == 0) {
        comment();
      } else if (const std::size_t level = longBracket(at_)) {
        copyTo(closingOf(level, at_));
      } else if (c == '"' || c == '\'') {
        quoted(c);
      } else if (isWord(c)) {
        word();
      } else {
        out_.text += c;
        ++at_;
      }
    }
    return std::move(out_);
  }

 private:
  void copyTo(std::size_t end) {
    out_.text.append(in_, at_, end - at_);
    at_ = end;
  }
  /// Bytes of "[[", "[=[", ... that begin here; 0 where none does.
  std::size_t longBracket(std::size_t at) const {
    if (at >= in_.size() || in_[at] != '[') return 0;
    std::size_t end = at + 1;
    while (end < in_.size() && in_[end] == '=') ++end;
    return end < in_.size() && in_[end] == '[' ? end + 1 - at : 0;
  }
  std::size_t closingOf(std::size_t opening_bytes, std::size_t at) const {
    const std::string closing = "]" + std::string(opening_bytes - 2, '=') + "]";
    const std::size_t found = in_.find(closing, at + opening_bytes);
    return found == std::string::npos ? in_.size() : found + closing.size();
  }
  void comment() {
    if (const std::size_t level = longBracket(at_ + 2)) {
      copyTo(closingOf(level, at_ + 2));
    } else {
      const std::size_t end = in_.find('\n', at_);
      copyTo(end == std::string::npos ? in_.size() : end);
    }
  }
  void quoted(char quote) {
    const bool compared = followsComparison();
    std::string content;
    out_.text += in_[at_++];
    while (at_ < in_.size() && in_[at_] != quote && in_[at_] != '\n') {
      if (in_[at_] == '\\' && at_ + 1 < in_.size()) {
        const char escaped = in_[++at_];
        if (std::strchr("abfnrtv\\\"'\n\r", escaped) || std::isdigit(static_cast<unsigned char>(escaped))) {
          out_.text += '\\';
        }
      }
      content += in_[at_];
      out_.text += in_[at_++];
    }
    if (at_ < in_.size()) out_.text += in_[at_++];
    if (compared || precedesComparison()) out_.compared_texts.push_back(content);
  }
  void word() {
    const bool compared = followsComparison();
    std::string content;
    while (at_ < in_.size() && isWord(in_[at_])) content += in_[at_++];
    out_.text += content;
    if (!std::isdigit(static_cast<unsigned char>(content[0]))) {
      const std::size_t next = in_.find_first_not_of(" \t\r\n", at_);
      if (next < in_.size() && in_[next] == '=' && !precedesComparison()) out_.assigned_names.push_back(content);
    } else if (compared || precedesComparison()) {
      out_.compared_numbers.push_back(content);
    }
  }
  bool followsComparison() const {
    std::size_t end = out_.text.size();
    while (end > 0 && std::isspace(static_cast<unsigned char>(out_.text[end - 1]))) --end;
    if (end > 0 && out_.text[end - 1] == '[') return true;
    return end > 1 && out_.text[end - 1] == '=' && (out_.text[end - 2] == '=' || out_.text[end - 2] == '~');
  }
  bool precedesComparison() const {
    std::size_t at = at_;
    while (at < in_.size() && std::isspace(static_cast<unsigned char>(in_[at]))) ++at;
    return in_.compare(at, 2, "==") == 0 || in_.compare(at, 2, "~=") == 0;
  }

  const std::string& in_;
  std::size_t at_ = 0;
  LuaSource out_;
};

}  // namespace

LuaSource readableLua(const std::string& text) { return Scanner(text).scan(); }

}  // namespace mmradartwin
