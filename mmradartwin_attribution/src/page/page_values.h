#pragma once

#include <map>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace mmradartwin::page {

class PageValue;
/// What the names of a template stand for.
using PageValues = std::map<std::string, PageValue>;

/// A text, a piece of HTML, or a list of which each item has names of its own.
class PageValue {
 public:
  PageValue() = default;
  PageValue(std::string text)
      : text_(std::move(text)) {}               // NOLINT(google-explicit-constructor): values are lists of these
  PageValue(const char* text) : text_(text) {}  // NOLINT(google-explicit-constructor)
  PageValue(std::vector<PageValues> items) : is_list_(true), items_(std::move(items)) {}  // NOLINT
  /// One item without names where it is true, none where it is not.
  template <typename Bool, typename = std::enable_if_t<std::is_same_v<Bool, bool>>>  // no pointer and no number
  PageValue(Bool shown) : is_list_(true), items_(shown ? 1 : 0) {}  // NOLINT(google-explicit-constructor)
  /// HTML that goes into the page as it is.
  static PageValue html(std::string html) {
    PageValue value(std::move(html));
    value.is_html_ = true;
    return value;
  }

  bool isHtml() const { return is_html_; }
  bool isList() const { return is_list_; }
  const std::string& text() const { return text_; }
  const std::vector<PageValues>& items() const { return items_; }

 private:
  std::string text_;
  bool is_html_ = false, is_list_ = false;
  std::vector<PageValues> items_;
};

}  // namespace mmradartwin::page
