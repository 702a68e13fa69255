#include "files/text_file.h"

#include <filesystem>
#include <fstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/input_file.h"

namespace mmradartwin {

std::string readTextFile(const std::string& file, const std::string& advice) {
  requireRegularFile(file);
  std::ifstream in(file, std::ios::binary);
  std::error_code error;
  if (!in || std::filesystem::is_directory(file, error)) throw InputError(file + ": cannot be read; " + advice);
  std::string text;
  for (char block[1 << 16]; in.read(block, sizeof block), in.gcount() > 0;) {
    text.append(block, static_cast<std::size_t>(in.gcount()));
    if (text.size() > kMaxTextBytes) {
      throw InputError(file + ": is longer than " + std::to_string(kMaxTextBytes >> 20) +
                       " MB and no text file of "
                       "settings; " +
                       advice);
    }
  }
  return text;
}

}  // namespace mmradartwin
