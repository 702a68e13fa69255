#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "page/page_values.h"

namespace mmradartwin::page {

/// A number of a page with the place that it was taken from, so that page and files can be held against each other:
/// <data value="0.8125" data-of="findings.json#/findings/0/...">81 %</data>. value: as the file has it.
std::string numberHtml(const std::string& value, const std::string& of, const std::string& shown);

/// So many significant digits, and whole numbers whole: 4720, not 4.72e+03.
std::string significantText(double value, int digits);

/// Text of a share in per cent: whole ones, and a decimal where whole ones would hide what is left.
std::string percentText(double share);

/// Numbers of a page that stand in a JSON file, by their pointers (RFC 6901). What is null or missing is a dash.
class PageNumbers {
 public:
  /// Keeps a reference.
  PageNumbers(const nlohmann::json& values, std::string file) : values_(values), file_(std::move(file)) {}
  PageNumbers(const nlohmann::json&& values, std::string file) = delete;

  std::string percent(const std::string& pointer) const;
  /// A chance in per cent; of a tiny one, that it is tiny.
  std::string chance(const std::string& pointer) const;
  std::string fixed(const std::string& pointer, int digits) const;
  std::string significant(const std::string& pointer, int digits = 3) const;
  std::string count(const std::string& pointer) const { return fixed(pointer, 0); }
  /// "low to high" of a list of two numbers, "" where it is null or missing.
  std::string interval(const std::string& pointer, int digits = 3) const;
  /// The value itself; NaN where it is null or missing.
  double value(const std::string& pointer) const;
  const nlohmann::json& values() const { return values_; }

 private:
  template <typename Text>
  std::string shown(const std::string& pointer, const Text& text) const;

  const nlohmann::json& values_;
  std::string file_;
};

/// What a piece of HTML shows: without tags, meanings of words and escapes.
std::string shownText(const std::string& html);

}  // namespace mmradartwin::page
