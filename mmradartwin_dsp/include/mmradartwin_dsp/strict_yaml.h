#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace YAML {
class Node;
}

namespace mmradartwin {

/// A YAML mapping read strictly: every key must be asked for, be of the right type and in range. All errors are
/// InputErrors that name file, key, value and the allowed range. Numbers are read as YAML 1.1 and 1.2 write them
/// (77.0e9 and 77.0e+9); NaN and infinities are out of range.
class YamlMap {
 public:
  /// Reads a file whose top level is a mapping. Throws InputError (missing file, syntax error with line).
  static YamlMap load(const std::string& file);
  /// The same from text; `name` stands for the file in errors.
  static YamlMap parse(const std::string& text, const std::string& name);

  bool has(const std::string& key) const;
  std::vector<std::string> keys() const;
  bool isList(const std::string& key) const;

  /// Required values.
  double number(const std::string& key, double min, double max);
  long long integer(const std::string& key, long long min, long long max);
  bool boolean(const std::string& key);
  std::string text(const std::string& key);
  /// text() that must be one of `allowed`.
  std::string choice(const std::string& key, const std::vector<std::string>& allowed);
  std::vector<double> numbers(const std::string& key, double min, double max);
  std::vector<long long> integers(const std::string& key, long long min, long long max);
  std::vector<std::string> texts(const std::string& key);
  /// List of lists of numbers, each of `columns` entries.
  std::vector<std::vector<double>> rows(const std::string& key, std::size_t columns, double min, double max);
  /// List of lists of whole numbers, of any lengths.
  std::vector<std::vector<long long>> integerLists(const std::string& key, long long min, long long max);
  /// A nested mapping ("key:" without a value is an empty one). It has its own rejectUnknownKeys().
  YamlMap map(const std::string& key);
  std::vector<YamlMap> maps(const std::string& key);

  /// Raises the error for an unusable value of `key`: "FILE: key KEY: WHY".
  [[noreturn]] void fail(const std::string& key, const std::string& why) const;
  /// Throws for the first key that was never asked for, listing the known ones.
  void rejectUnknownKeys() const;

  const std::string& file() const;
  /// The value of a key as it stands in the file, as YAML text; marks it used.
  std::string dump(const std::string& key);

 private:
  struct State;
  explicit YamlMap(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

/// `text` as a double-quoted YAML scalar.
std::string yamlText(const std::string& text);
/// Shortest decimal that reads back as exactly `value`; YAML 1.1 takes it for a number too (7.7e+10, 1.0e-06).
std::string yamlNumber(double value);

}  // namespace mmradartwin
