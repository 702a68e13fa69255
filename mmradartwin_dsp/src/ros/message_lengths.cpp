#include "ros/message_lengths.h"

#include <rosbag/exceptions.h>

#include <cstring>
#include <sstream>

namespace mmradartwin {
namespace {

constexpr int kDeepest = 16;

/// Bytes of a built-in type of fixed size; 0 for any other.
std::size_t bytesOf(const std::string& type) {
  static const std::map<std::string, std::size_t> kSizes = {
      {"bool", 1},   {"byte", 1},    {"char", 1},    {"int8", 1},   {"uint8", 1},
      {"int16", 2},  {"uint16", 2},  {"int32", 4},   {"uint32", 4}, {"int64", 8},
      {"uint64", 8}, {"float32", 4}, {"float64", 8}, {"time", 8},   {"duration", 8}};
  const auto found = kSizes.find(type);
  return found == kSizes.end() ? 0 : found->second;
}

std::string packageOf(const std::string& type) { return type.substr(0, type.find('/')); }

}  // namespace

MessageLengths::MessageLengths(const std::string& type, const std::string& definition) : type_(type) {
  // The text of the type, then those of all types in it, each behind a line of = and "MSG: name".
  std::istringstream in(definition);
  std::string name = type, text;
  for (std::string line; std::getline(in, line);) {
    if (line.compare(0, 5, "MSG: ") == 0) {
      addType(name, text);
      name = line.substr(5);
      text.clear();
    } else if (line.compare(0, 4, "====") != 0) {
      text += line + "\n";
    }
  }
  addType(name, text);
}

void MessageLengths::addType(const std::string& name, const std::string& text) {
  std::vector<Field>& fields = types_[name];
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line.substr(0, line.find('#')));
    Field field;
    std::string field_name, more;
    if (!(words >> field.type >> field_name)) continue;
    words >> more;
    if (field_name.find('=') != std::string::npos || more.compare(0, 1, "=") == 0) continue;  // a constant
    const std::size_t bracket = field.type.find('[');
    if (bracket != std::string::npos) {
      const std::string count = field.type.substr(bracket + 1, field.type.size() - bracket - 2);
      field.is_list = count.empty();
      if (!count.empty()) field.count = std::stoul(count);
      field.type.erase(bracket);
    }
    field.bytes = bytesOf(field.type);
    field.is_text = field.type == "string";
    if (field.type == "Header") field.type = "std_msgs/Header";
    if (field.bytes == 0 && !field.is_text && field.type.find('/') == std::string::npos) {
      field.type = packageOf(name) + "/" + field.type;
    }
    fields.push_back(field);
  }
}

bool MessageLengths::Rest::skip(std::size_t bytes) {
  if (bytes > size) return false;
  at += bytes;
  size -= bytes;
  return true;
}

bool MessageLengths::Rest::count(std::size_t& entries) {
  std::uint32_t value = 0;
  if (size < sizeof value) return false;
  std::memcpy(&value, at, sizeof value);
  entries = value;
  return skip(sizeof value);
}

bool MessageLengths::walkField(const Field& field, Rest& rest, int depth) const {
  std::size_t entries = field.count;
  if (field.is_list && !rest.count(entries)) return false;
  if (field.bytes > 0) return entries <= rest.size / field.bytes && rest.skip(entries * field.bytes);
  if (entries > rest.size) return false;  // each has a byte at least
  for (std::size_t i = 0; i < entries; ++i) {
    std::size_t characters = 0;
    if (field.is_text ? !(rest.count(characters) && rest.skip(characters)) : !walk(field.type, rest, depth + 1)) {
      return false;
    }
  }
  return true;
}

bool MessageLengths::walk(const std::string& type, Rest& rest, int depth) const {
  const auto found = types_.find(type);
  if (found == types_.end() || depth > kDeepest) return false;
  for (const Field& field : found->second) {
    if (!walkField(field, rest, depth)) return false;
  }
  return true;
}

bool MessageLengths::hold(const std::uint8_t* bytes, std::size_t size) const {
  Rest rest{bytes, size};
  return walk(type_, rest, 0);
}

void requireItsLengths(const rosbag::MessageInstance& message, const MessageLengths& lengths) {
  std::vector<std::uint8_t> bytes(message.size());
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  message.write(stream);
  if (lengths.hold(bytes.data(), bytes.size())) return;
  throw rosbag::BagFormatException("a message on " + message.getTopic() + " says that it is longer than it is");
}

}  // namespace mmradartwin
