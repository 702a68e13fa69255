#pragma once

#include <cstddef>
#include <sstream>
#include <string>
#include <vector>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

/// Rows of a CSV text below its header. Fields are separated by commas and trimmed, quotes are characters like others;
/// empty lines are left out. Errors name file and line, those of a number its column and text too.
class CsvReader {
 public:
  /// Reads the header; `file` is the text's name in errors.
  CsvReader(const std::string& text, std::string file);

  const std::vector<std::string>& columns() const { return columns_; }
  /// Throws InputError where the header is not this one, `pose,distance_m` for example.
  void requireColumns(const std::string& columns) const;

  /// Goes to the next row; false at the end. Throws InputError for a row of more or fewer fields than the header.
  bool next();
  const std::vector<std::string>& fields() const { return fields_; }
  /// Throws InputError where the row's field is not a finite number.
  double number(std::size_t column) const;
  /// Errors of this row name it so from now on.
  void callRow(const std::string& name) { where_ += name + ": "; }
  /// What is wrong with the row, behind file and line.
  InputError error(const std::string& problem) const { return InputError(where_ + problem); }

 private:
  std::istringstream in_;
  std::string file_;
  std::string where_;
  std::vector<std::string> columns_, fields_;
  int line_ = 1;
};

}  // namespace mmradartwin
