#include "hostile_input.h"

#include <stdlib.h>

#include <filesystem>
#include <fstream>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

struct Folder {
  Folder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "mmradartwin_hostile_XXXXXX").string();
    path = ::mkdtemp(pattern.data());
  }
  ~Folder() {
    std::error_code error;
    std::filesystem::remove_all(path, error);
  }
  std::string path;
};

}  // namespace

void refusing(const std::function<void()>& read) {
  try {
    read();
  } catch (const InputError& error) {
    const std::string message = error.what();
    if (message.empty() || message != oneLine(message)) throw std::logic_error("an InputError that is no line");
  }
}

std::string inputFolder() {
  static const Folder folder;
  return folder.path;
}

void writeInput(const std::string& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
}

std::string mutated(const std::vector<std::string>& seeds, std::mt19937_64& random) {
  static const std::vector<std::string> kPieces = {",",
                                                   "[",
                                                   "]",
                                                   "{",
                                                   "}",
                                                   "&a",
                                                   "*a",
                                                   ":",
                                                   "\n",
                                                   "- ",
                                                   "#",
                                                   "\"",
                                                   "'",
                                                   "<",
                                                   ">",
                                                   "--",
                                                   "(",
                                                   "\x1b[31m",
                                                   "0",
                                                   "-1",
                                                   "1e308",
                                                   "nan",
                                                   ".inf",
                                                   "4294967295",
                                                   "-2147483648",
                                                   "18446744073709551616",
                                                   std::string(1, '\0'),
                                                   "\xff\xff",
                                                   std::string(4, '\xff'),
                                                   std::string(8, '\0'),
                                                   std::string(300, '['),
                                                   std::string(300, 'x')};
  const auto below = [&random](std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>(random() % n); };
  std::string bytes = seeds[below(seeds.size())];
  for (std::size_t changes = 1 + below(8); changes > 0; --changes) {
    const std::size_t at = below(bytes.size() + 1), length = std::min(bytes.size() - at, 1 + below(1 + below(64)));
    switch (below(8)) {
      case 0:
        if (at < bytes.size()) bytes[at] = static_cast<char>(bytes[at] ^ 1 << below(8));
        break;
      case 1:
        if (at < bytes.size()) bytes[at] = static_cast<char>(random());
        break;
      case 2:
        bytes.erase(at, length);
        break;
      case 3:
        bytes.insert(below(bytes.size() + 1), bytes.substr(at, length));
        break;
      case 4: {
        const std::string& other = seeds[below(seeds.size())];
        bytes.replace(at, length, other.substr(below(other.size() + 1), 1 + below(64)));
        break;
      }
      case 5:
        if (below(4) == 0) bytes.resize(at);
        break;
      default:
        bytes.replace(at, below(2) * length, kPieces[below(kPieces.size())]);
        break;
    }
  }
  return bytes;
}

}  // namespace mmradartwin
