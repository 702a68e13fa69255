#include "capture_check/file_kind.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cstring>
#include <string_view>

namespace mmradartwin {
namespace {

struct Kind {
  std::string_view begin;
  const char* what;
};

using namespace std::string_view_literals;

const Kind kKinds[] = {
    {"\x93NUMPY"sv,
     "a NumPy file; write its samples as raw bytes, array.astype('<i2').tofile(...), in the radar's layout"},
    {"PK\x03\x04"sv, "a zip archive; unpack it and give the .bin inside"},
    {"PK\x05\x06"sv, "an empty zip archive; give the recorded .bin"},
    {"\x1f\x8b\x08"sv, "packed by gzip; unpack it (gunzip) and give the .bin inside"},
    {"7z\xbc\xaf\x27\x1c"sv, "a 7z archive; unpack it and give the .bin inside"},
    {"\x28\xb5\x2f\xfd"sv, "packed by zstd; unpack it and give the .bin inside"},
    {"\xfd"
     "7zXZ\x00"sv,
     "packed by xz; unpack it and give the .bin inside"},
    {"BZh91AY&SY"sv, "packed by bzip2; unpack it and give the .bin inside"},
    {"Rar!\x1a\x07"sv, "a rar archive; unpack it and give the .bin inside"},
    {"\xd4\xc3\xb2\xa1"sv, "a packet capture (pcap); turn it into a capture with pcap_to_capture"},
    {"\xa1\xb2\xc3\xd4"sv, "a packet capture (pcap); turn it into a capture with pcap_to_capture"},
    {"\x4d\x3c\xb2\xa1"sv, "a packet capture (pcap); turn it into a capture with pcap_to_capture"},
    {"\x0a\x0d\x0d\x0a"sv, "a packet capture (pcapng); turn it into a capture with pcap_to_capture"},
    {"#ROSBAG"sv, "a rosbag; give it as .bag"},
    {"\x89HDF\r\n\x1a\n"sv, "an HDF5 or MATLAB 7.3 file; write its samples as raw int16 in the radar's layout"},
    {"MATLAB 5.0 MAT-file"sv, "a MATLAB file; write its samples as raw int16 in the radar's layout"},
    {"\x80\x04\x95"sv, "a Python pickle; write its samples as raw int16 in the radar's layout"},
    {"\x89PNG\r\n\x1a\n"sv, "a PNG picture; give the recorded .bin"},
    {"%PDF-"sv, "a PDF document; give the recorded .bin"},
    {"\x7f"
     "ELF"sv,
     "a program (ELF); give the recorded .bin"},
};

/// Text: nothing but printable characters and white space, with separators, and of more than a few different ones (one
/// value all over is a level, not a text).
bool isText(const std::uint8_t* bytes, std::size_t size) {
  constexpr std::size_t kFewestCharacters = 5;
  std::bitset<256> seen;
  for (std::size_t i = 0; i < size; ++i) {
    const std::uint8_t c = bytes[i];
    if (c != '\t' && c != '\n' && c != '\r' && (c < 0x20 || c == 0x7f)) return false;
    seen.set(c);
  }
  const bool separated = seen['\n'] || seen[' '] || seen[','] || seen['\t'];
  // Above 0x7f are letters of UTF-8, of which a text holds few.
  const auto high = std::count_if(bytes, bytes + size, [](std::uint8_t c) { return c >= 0x80; });
  return separated && seen.count() >= kFewestCharacters && 4 * static_cast<std::size_t>(high) < size;
}

}  // namespace

std::string foreignKind(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return "an empty file of 0 whole frames; record it anew, or take its pose out of poses.csv";
  const std::string_view begin(reinterpret_cast<const char*>(bytes), size);
  for (const Kind& kind : kKinds) {
    if (begin.substr(0, kind.begin.size()) == kind.begin) return kind.what;
  }
  if (begin.substr(0, 40).find("git-lfs.github.com") != std::string_view::npos) {
    return "a pointer of Git LFS, not the file itself; fetch it (git lfs pull)";
  }
  if (size >= 8 && isText(bytes, std::min(size, kFileKindBytes))) {
    return "a text; give the recorded .bin, with int16 samples";
  }
  return "";
}

}  // namespace mmradartwin
