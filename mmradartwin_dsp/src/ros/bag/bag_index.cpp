#include "ros/bag/bag_index.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <vector>

namespace mmradartwin {
namespace {

constexpr std::size_t kMostHeader = 1 << 20;  // of a record, which holds a few names and numbers
constexpr std::size_t kIndexEntry = 12;       // a time and an offset
constexpr std::uint8_t kIndexData = 4, kChunk = 5;

class File {
 public:
  explicit File(const std::string& name) : fd_(open(name.c_str(), O_RDONLY | O_CLOEXEC)) {}
  ~File() {
    if (fd_ >= 0) close(fd_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  std::uint64_t size() const {
    const off_t end = lseek(fd_, 0, SEEK_END);
    return end < 0 ? 0 : static_cast<std::uint64_t>(end);
  }
  /// Empty where that many bytes are not there.
  std::string at(std::uint64_t position, std::size_t size) const {
    std::string bytes(size, '\0');
    const ssize_t got = pread(fd_, bytes.data(), size, static_cast<off_t>(position));
    return got == static_cast<ssize_t>(size) ? bytes : std::string();
  }
  std::optional<std::uint32_t> number(std::uint64_t position) const {
    const std::string bytes = at(position, 4);
    if (bytes.empty()) return std::nullopt;
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }

 private:
  int fd_;
};

struct Record {
  std::map<std::string, std::string> fields;
  std::uint64_t data = 0, size = 0;

  std::uint32_t number(const std::string& name) const {
    const auto found = fields.find(name);
    std::uint32_t value = 0;
    if (found != fields.end()) std::memcpy(&value, found->second.data(), std::min(sizeof value, found->second.size()));
    return value;
  }
  std::uint8_t op() const { return static_cast<std::uint8_t>(number("op")); }
};

std::optional<Record> recordAt(const File& file, std::uint64_t position, std::uint64_t file_size) {
  const auto header_size = file.number(position);
  if (!header_size || *header_size > kMostHeader) return std::nullopt;
  const std::string header = file.at(position + 4, *header_size);
  const auto data_size = file.number(position + 4 + *header_size);
  if (header.size() != *header_size || !data_size) return std::nullopt;
  Record record;
  record.data = position + 8 + *header_size;
  record.size = *data_size;
  if (record.data + record.size > file_size) return std::nullopt;
  for (std::size_t at = 0; at + 4 <= header.size();) {
    std::uint32_t length = 0;
    std::memcpy(&length, header.data() + at, sizeof length);
    at += 4;
    if (length > header.size() - at) return std::nullopt;
    const std::string field = header.substr(at, length);
    const std::size_t equals = field.find('=');
    if (equals == std::string::npos) return std::nullopt;
    record.fields[field.substr(0, equals)] = field.substr(equals + 1);
    at += length;
  }
  return record;
}

/// True where a whole message of the chunk begins there.
bool leadsToMessage(const File& file, const Record& chunk, std::uint32_t offset) {
  const std::uint64_t size = chunk.number("size");
  if (offset + std::uint64_t{8} > size) return false;
  const auto compression = chunk.fields.find("compression");
  if (compression == chunk.fields.end() || compression->second != "none") return true;
  const auto header_size = file.number(chunk.data + offset);
  if (!header_size || offset + std::uint64_t{8} + *header_size > size) return false;
  const auto data_size = file.number(chunk.data + offset + 4 + *header_size);
  return data_size && offset + std::uint64_t{8} + *header_size + *data_size <= size;
}

}  // namespace

std::string whyNoIndex(const std::string& name) {
  constexpr char kVersion[] = "#ROSBAG V2.0\n";
  const File file(name);
  const std::uint64_t size = file.size();
  std::uint64_t position = sizeof kVersion - 1;
  if (file.at(0, position) != kVersion) return "";
  std::optional<Record> chunk;
  while (position < size) {
    const std::optional<Record> record = recordAt(file, position, size);
    if (!record) return "a record at byte " + std::to_string(position) + " is none";
    position = record->data + record->size;
    if (record->op() == kChunk) chunk = record;
    if (record->op() != kIndexData) continue;
    const std::string entries = file.at(record->data, record->size);
    const std::uint64_t count = record->number("count");
    if (!chunk || count * kIndexEntry > entries.size()) return "an index has fewer entries than it says";
    for (std::uint64_t i = 0; i < count; ++i) {
      std::uint32_t offset = 0;
      std::memcpy(&offset, entries.data() + i * kIndexEntry + 8, sizeof offset);
      if (!leadsToMessage(file, *chunk, offset)) return "an entry of its index leads to no message";
    }
  }
  return "";
}

}  // namespace mmradartwin
