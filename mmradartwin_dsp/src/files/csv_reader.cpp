#include "mmradartwin_dsp/csv_reader.h"

#include <charconv>
#include <cmath>
#include <utility>

#include "mmradartwin_dsp/text.h"

namespace mmradartwin {
namespace {

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, ',');) fields.push_back(trimmed(field));
  if (!line.empty() && line.back() == ',') fields.emplace_back();
  return fields;
}

}  // namespace

CsvReader::CsvReader(const std::string& text, std::string file)
    : in_(text), file_(std::move(file)), where_(file_ + ": line 1: ") {
  std::string header;
  std::getline(in_, header);
  if (header.compare(0, 3, "\xEF\xBB\xBF") == 0) header.erase(0, 3);  // spreadsheets put a byte order mark
  columns_ = split(trimmed(header));
}

void CsvReader::requireColumns(const std::string& columns) const {
  if (columns_ == split(columns)) return;
  throw error("header is '" + join(columns_, ",").substr(0, 80) + "'; it must be " + columns);
}

bool CsvReader::next() {
  for (std::string line; std::getline(in_, line);) {
    where_ = file_ + ": line " + std::to_string(++line_) + ": ";
    if (trimmed(line).empty()) continue;
    fields_ = split(line);
    if (fields_.size() == columns_.size()) return true;
    throw error(std::to_string(fields_.size()) + " fields; a row has " + std::to_string(columns_.size()) + ", " +
                join(columns_, ","));
  }
  return false;
}

double CsvReader::number(std::size_t column) const {
  const std::string& text = fields_.at(column);
  double value = 0;
  const char* begin = text.data() + (!text.empty() && text.front() == '+' ? 1 : 0);
  const char* end = text.data() + text.size();
  const auto result = std::from_chars(begin, end, value);
  if (result.ec != std::errc() || result.ptr != end) {
    throw error(columns_[column] + " '" + text + "' is no number; correct or remove the row");
  }
  if (!std::isfinite(value)) throw error(columns_[column] + " is " + text + "; correct or remove the row");
  return value;
}

}  // namespace mmradartwin
