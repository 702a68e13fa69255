#include "page/page_numbers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "mmradartwin_dsp/text.h"

namespace mmradartwin::page {
namespace {

constexpr const char* kDash = "\u2013";
constexpr double kLeastChance = 1e-6;  ///< below, a chance is told as less than this

/// A minus sign instead of the hyphen that printf writes.
std::string withMinus(const std::string& number) {
  return !number.empty() && number.front() == '-' ? "\u2212" + number.substr(1) : number;
}

}  // namespace

std::string numberHtml(const std::string& value, const std::string& of, const std::string& shown) {
  return "<data value=\"" + htmlEscape(value) + "\" data-of=\"" + htmlEscape(of) + "\">" +
         htmlEscape(withMinus(shown)) + "</data>";
}

std::string significantText(double value, int digits) {
  const bool whole = std::abs(value) >= std::pow(10.0, digits - 1) && std::abs(value) < 1e9;
  return whole ? fixedNumber(value, 0) : significantNumber(value, digits);
}

std::string percentText(double share) {
  const bool fine = (share > 0.895 && share < 1) || (std::abs(share) < 0.0995 && share != 0);
  return fixedNumber(100 * share, fine ? 1 : 0) + " %";
}

double PageNumbers::value(const std::string& pointer) const {
  const nlohmann::json::json_pointer at(pointer);
  if (!values_.contains(at) || !values_.at(at).is_number()) return std::numeric_limits<double>::quiet_NaN();
  return values_.at(at).get<double>();
}

template <typename Text>
std::string PageNumbers::shown(const std::string& pointer, const Text& text) const {
  const double number = value(pointer);
  if (std::isnan(number)) return kDash;
  return numberHtml(values_.at(nlohmann::json::json_pointer(pointer)).dump(), file_ + "#" + pointer, text(number));
}

std::string PageNumbers::percent(const std::string& pointer) const { return shown(pointer, percentText); }

std::string PageNumbers::chance(const std::string& pointer) const {
  return shown(pointer, [](double number) {
    if (number < kLeastChance) return "less than " + fixedNumber(100 * kLeastChance, 4) + " %";
    return significantNumber(100 * number, 2) + " %";
  });
}

std::string PageNumbers::fixed(const std::string& pointer, int digits) const {
  return shown(pointer, [&](double number) { return fixedNumber(number, digits); });
}

std::string PageNumbers::significant(const std::string& pointer, int digits) const {
  return shown(pointer, [&](double number) { return significantText(number, digits); });
}

std::string PageNumbers::interval(const std::string& pointer, int digits) const {
  if (std::isnan(value(pointer + "/0"))) return "";
  return significant(pointer + "/0", digits) + " to " + significant(pointer + "/1", digits);
}

std::string shownText(const std::string& html) {
  std::string text;
  int meaning = 0;  // depth of tags within a word's meaning
  for (std::size_t i = 0; i < html.size(); ++i) {
    if (html[i] == '<') {
      const std::size_t end = std::min(html.find('>', i), html.size() - 1);
      const std::string tag = html.substr(i, end - i);
      if (meaning > 0) {
        meaning += tag[1] == '/' ? -1 : 1;
      } else if (tag.find("class=\"meaning\"") != std::string::npos) {
        meaning = 1;
      }
      i = end;
    } else if (meaning == 0) {
      text += html[i];
    }
  }
  for (const auto& [escape, sign] :
       {std::pair{"&lt;", "<"}, {"&gt;", ">"}, {"&quot;", "\""}, {"&#39;", "'"}, {"&amp;", "&"}}) {
    for (std::size_t at = text.find(escape); at != std::string::npos; at = text.find(escape, at + 1)) {
      text.replace(at, std::string(escape).size(), sign);
    }
  }
  return text;
}

}  // namespace mmradartwin::page
