#include "mmradartwin_dsp/capture.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <regex>

#include "capture_check/file_kind.h"
#include "capture_check/packet_heads.h"
#include "capture_check/real_samples.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/input_file.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "captures are little endian; this reads them as they lie");

// Both layouts are read and written through one walk: `move(capture, cube)` copies one int16 between the two indices.
// Sources: SWRA581B figures 9 and 11, SWRA555A figure 22.

template <typename Move>
void walkFourLane(std::size_t samples, std::size_t receivers, std::size_t lanes, std::size_t i_at, Move move) {
  const std::size_t q_at = i_at ^ 1;
  for (std::size_t n = 0; n < samples; ++n) {
    for (std::size_t rx = 0; rx < receivers; ++rx) {
      move((2 * n + i_at) * lanes + rx, 2 * (n * receivers + rx));
      move((2 * n + q_at) * lanes + rx, 2 * (n * receivers + rx) + 1);
    }
  }
}

template <typename Move>
void walkTwoLane(std::size_t samples, std::size_t receivers, std::size_t i_at, Move move) {
  const std::size_t q_at = i_at ^ 1;
  for (std::size_t rx = 0; rx < receivers; ++rx) {
    for (std::size_t n = 0; n < samples; n += 2) {
      const std::size_t group = 2 * (rx * samples + n);
      for (std::size_t odd = 0; odd < 2; ++odd) {
        move(group + 2 * i_at + odd, 2 * ((n + odd) * receivers + rx));
        move(group + 2 * q_at + odd, 2 * ((n + odd) * receivers + rx) + 1);
      }
    }
  }
}

/// The paper's receiver, four lanes all in use, with constant strides that the compiler turns into shuffles.
template <typename Move>
void walkChirp(const RadarConfig& radar, Move move) {
  const auto samples = static_cast<std::size_t>(radar.samples_per_chirp);
  const auto receivers = static_cast<std::size_t>(radar.receivers());
  const std::size_t i_at = radar.iq_order == IqOrder::kIq ? 0 : 1;
  if (radar.layout == CaptureLayout::kTwoLane) {
    walkTwoLane(samples, receivers, i_at, move);
  } else if (receivers == 4 && i_at == 0) {
    walkFourLane(samples, 4, 4, 0, move);
  } else {
    walkFourLane(samples, receivers, static_cast<std::size_t>(radar.capture_receivers()), i_at, move);
  }
}

std::size_t cubeSize(const RadarConfig& radar) {
  return static_cast<std::size_t>(radar.chirps_per_frame()) * static_cast<std::size_t>(radar.samples_per_chirp) *
         static_cast<std::size_t>(radar.receivers()) * 2;
}

std::int16_t load(const std::uint8_t* bytes, std::size_t index) {
  std::int16_t value;
  std::memcpy(&value, bytes + 2 * index, 2);
  return value;
}

}  // namespace

void decodeFrame(const RadarConfig& radar, const std::uint8_t* bytes, std::vector<std::int16_t>& samples) {
  samples.resize(cubeSize(radar));
  const auto chirps = static_cast<std::size_t>(radar.chirps_per_frame());
  const std::size_t stride = samples.size() / chirps;
  for (std::size_t chirp = 0; chirp < chirps; ++chirp) {
    const std::uint8_t* in = bytes + chirp * radar.bytes_per_chirp();
    std::int16_t* out = samples.data() + chirp * stride;
    if (radar.real_samples) {
      decodeRealChirp(radar, in, out);
      continue;
    }
    walkChirp(radar, [in, out](std::size_t capture, std::size_t cube) { out[cube] = load(in, capture); });
  }
}

std::vector<std::uint8_t> encodeFrame(const RadarConfig& radar, const std::vector<std::int16_t>& samples) {
  if (samples.size() != cubeSize(radar)) {
    throw InputError("a frame of " + std::to_string(samples.size()) +
                     " samples does not fit the radar, whose frames have " + std::to_string(cubeSize(radar)));
  }
  std::vector<std::uint8_t> bytes(radar.bytes_per_frame(), 0);
  const auto chirps = static_cast<std::size_t>(radar.chirps_per_frame());
  const std::size_t stride = samples.size() / chirps;
  for (std::size_t chirp = 0; chirp < chirps; ++chirp) {
    std::uint8_t* out = bytes.data() + chirp * radar.bytes_per_chirp();
    const std::int16_t* in = samples.data() + chirp * stride;
    if (radar.real_samples) {
      encodeRealChirp(radar, in, out);
      continue;
    }
    walkChirp(radar,
              [in, out](std::size_t capture, std::size_t cube) { std::memcpy(out + 2 * capture, in + cube, 2); });
  }
  return bytes;
}

std::vector<std::string> captureParts(const std::string& file, const OtherCaptures& others) {
  static const std::regex kFirst("(.*_raw_)0(\\.bin)", std::regex::icase), kPlain("(.*_)0(\\.bin)", std::regex::icase);
  const fs::path path(file);
  const std::string name = path.filename().string();
  std::smatch match;
  const bool raw = std::regex_match(name, match, kFirst);
  // A number alone may also tell one recording from another.
  if (!raw && !(others && std::regex_match(name, match, kPlain))) return {file};
  const std::string head = match[1], tail = match[2];
  const auto part = [&](std::size_t number) { return path.parent_path() / (head + std::to_string(number) + tail); };
  const auto isOther = [&](const fs::path& p) { return !raw && others(p.string()); };
  std::vector<std::string> parts = {file};
  std::error_code error;
  while (fs::exists(part(parts.size()), error)) {
    if (isOther(part(parts.size()))) return {file};
    parts.push_back(part(parts.size()).string());
  }
  // A part that lies beyond a missing one would be taken for another capture's.
  for (const auto& entry : fs::directory_iterator(path.has_parent_path() ? path.parent_path() : ".", error)) {
    const std::string other = entry.path().filename().string();
    if (other.size() <= head.size() + tail.size() || other.compare(0, head.size(), head) != 0) continue;
    const std::string number = other.substr(head.size(), other.size() - head.size() - tail.size());
    if (number.size() > 6 || other != head + number + tail) continue;
    if (number.find_first_not_of("0123456789") != std::string::npos) continue;
    if (std::stoul(number) > parts.size()) {
      if (isOther(entry.path())) return {file};
      throw InputError(file + ": " + head + std::to_string(parts.size()) + tail + " is missing, and " + other +
                       " is there; put all parts of the capture into one folder");
    }
  }
  return parts;
}

namespace {

/// Files one after the other, as one stream of bytes.
class JoinedFiles {
 public:
  explicit JoinedFiles(const std::vector<std::string>& files) {
    for (const std::string& file : files) {
      requireRegularFile(file);
      const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
      if (descriptor < 0) {
        throw InputError(file + ": capture cannot be opened (" + std::strerror(errno) +
                         "); put the recorded file there or take its pose out of poses.csv");
      }
      const std::shared_ptr<const int> owner(new int(descriptor), [](const int* d) {
        ::close(*d);
        delete d;
      });
      struct stat status = {};
      if (::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
        throw InputError(file + ": is no capture file; give a .bin with the recorded bytes");
      }
      const std::size_t begin = size();
      parts_.push_back({owner, begin, begin + static_cast<std::size_t>(status.st_size)});
    }
  }
  std::size_t size() const { return parts_.empty() ? 0 : parts_.back().end; }
  /// Returns "" or why it cannot be read.
  std::string read(std::size_t offset, std::size_t size, std::uint8_t* out) const {
    while (size > 0) {
      const auto part = std::find_if(parts_.begin(), parts_.end(), [&](const Part& p) { return offset < p.end; });
      if (part == parts_.end()) return "the file has become shorter";
      const ssize_t got =
          ::pread(*part->descriptor, out, std::min(size, part->end - offset), static_cast<off_t>(offset - part->begin));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return got < 0 ? std::strerror(errno) : "the file has become shorter";
      offset += static_cast<std::size_t>(got);
      out += got;
      size -= static_cast<std::size_t>(got);
    }
    return "";
  }

 private:
  struct Part {
    std::shared_ptr<const int> descriptor;
    std::size_t begin, end;  ///< of its bytes in the capture
  };
  std::vector<Part> parts_;
};

}  // namespace

/// The samples' bytes of a capture, without heads; read from several threads at once.
class CaptureStream {
 public:
  CaptureStream(const std::string& file, const std::vector<std::string>& parts, std::size_t bytes_per_chirp)
      : file_(file), files_(parts), parts_(parts.size()) {
    std::vector<std::uint8_t> begin(std::min(files_.size(), kFileKindBytes));
    requireRead(0, begin.size(), begin.data());
    const std::string kind = foreignKind(begin.data(), begin.size());
    if (!kind.empty()) throw InputError(file + ": is " + kind);
    const auto read = [&](std::size_t offset, std::size_t size, std::uint8_t* out) {
      if (offset > files_.size() || size > files_.size() - offset) return false;
      if (offset + size <= begin.size()) {
        std::copy_n(begin.begin() + static_cast<std::ptrdiff_t>(offset), size, out);
        return true;
      }
      return files_.read(offset, size, out).empty();
    };
    try {
      heads_ = findPacketHeads(read, files_.size(), bytes_per_chirp);
    } catch (const InputError& error) {
      throw InputError(file + ": " + error.what());
    }
  }
  std::size_t size() const { return heads_ ? heads_->size : files_.size(); }
  std::size_t parts() const { return parts_; }
  const std::optional<PacketHeads>& heads() const { return heads_; }
  /// Fills `out`, with zeros where bytes were lost. Throws InputError.
  void read(std::size_t offset, std::size_t size, std::uint8_t* out) const {
    if (!heads_) return requireRead(offset, size, out);
    std::fill_n(out, size, std::uint8_t{0});
    for (auto piece = firstPiece(offset); piece != heads_->pieces.end() && piece->begin < offset + size; ++piece) {
      const std::size_t begin = std::max(piece->begin, offset), end = std::min(piece->end, offset + size);
      requireRead(piece->at + begin - piece->begin, end - begin, out + (begin - offset));
    }
  }
  /// True where no byte of a stretch was lost or lies beyond the end.
  bool has(std::size_t offset, std::size_t size) const {
    if (offset + size > this->size()) return false;
    if (!heads_ || heads_->lost_bytes == 0) return true;
    std::size_t found = 0;
    for (auto piece = firstPiece(offset); piece != heads_->pieces.end() && piece->begin < offset + size; ++piece) {
      found += std::min(piece->end, offset + size) - std::max(piece->begin, offset);
    }
    return found == size;
  }

 private:
  std::vector<PayloadPiece>::const_iterator firstPiece(std::size_t offset) const {
    return std::partition_point(heads_->pieces.begin(), heads_->pieces.end(),
                                [&](const PayloadPiece& piece) { return piece.end <= offset; });
  }
  void requireRead(std::size_t offset, std::size_t size, std::uint8_t* out) const {
    const std::string why = files_.read(offset, size, out);
    if (!why.empty()) throw InputError(file_ + ": byte " + std::to_string(offset) + " cannot be read (" + why + ")");
  }

  std::string file_;
  JoinedFiles files_;
  std::size_t parts_;
  std::optional<PacketHeads> heads_;
};

CaptureReader::CaptureReader(const RadarConfig& radar, const std::string& file, Rest rest, const OtherCaptures& others)
    : radar_(radar), file_(file) {
  const std::vector<std::string> parts = captureParts(file, others);
  stream_ = std::make_shared<CaptureStream>(file, parts, radar.bytes_per_chirp());
  if (parts.size() > 1) {
    std::string names;
    for (std::size_t i = 1; i < parts.size(); ++i) {
      names += (i > 1 ? ", " : "") + fs::path(parts[i]).filename().string();
    }
    notes_.push_back(file + ": is continued in " + names + ", read as one capture");
  }
  if (const std::optional<PacketHeads>& heads = stream_->heads()) {
    notes_.push_back(file + ": holds " + heads->what + "; they were taken out" +
                     (heads->lost_bytes > 0 ? ", " + std::to_string(heads->lost_bytes) + " bytes were lost between them"
                                            : std::string()));
  }
  frames_ = static_cast<int>(stream_->size() / radar_.bytes_per_frame());
  if (rest == Rest::kRefused || frames_ == 0) requireWholeFrames();
}

void CaptureReader::beginWithin(std::size_t bytes) {
  missing_bytes_ = bytes % radar_.bytes_per_frame();
  frames_ = static_cast<int>((stream_->size() + missing_bytes_) / radar_.bytes_per_frame());
}

bool CaptureReader::plain() const { return !stream_->heads() && missing_bytes_ == 0; }
std::size_t CaptureReader::size() const { return stream_->size(); }
void CaptureReader::read(std::size_t offset, std::size_t size, std::uint8_t* out) const {
  stream_->read(offset, size, out);
}

void CaptureReader::requireWholeFrames() const {
  if (missing_bytes_ > 0) return;  // the last frame is cut like the first
  const std::size_t size = stream_->size(), rest = size % radar_.bytes_per_frame();
  if (frames_ > 0 && rest == 0) return;
  throw TruncatedCapture(file_ + ": capture is truncated or not from this radar: " + std::to_string(size) + " bytes " +
                         (stream_->parts() > 1 ? "in " + std::to_string(stream_->parts()) + " parts " : "") + "are " +
                         std::to_string(frames_) + " whole frames of " + std::to_string(radar_.bytes_per_frame()) +
                         " bytes and " + std::to_string(rest) +
                         " bytes over; cut it to whole frames, record it anew, or correct radar.yaml");
}

int CaptureReader::frames() const { return frames_; }

std::vector<std::uint8_t> CaptureReader::bytes(int i) const {
  if (i < 0 || i >= frames_) {
    throw std::out_of_range(file_ + ": frame " + std::to_string(i) + " of " + std::to_string(frames_));
  }
  std::vector<std::uint8_t> bytes(radar_.bytes_per_frame());
  const std::size_t lead = i == 0 ? missing_bytes_ : 0;
  const std::size_t offset = static_cast<std::size_t>(i) * bytes.size() + lead - missing_bytes_;
  stream_->read(offset, bytes.size() - lead, bytes.data() + lead);
  return bytes;
}

AdcCube CaptureReader::frame(int i, std::int64_t first_stamp_ns) const {
  AdcCube cube;
  cube.stamp_ns = first_stamp_ns + radar_.frame_offset_ns(i);
  cube.sequence = static_cast<std::uint32_t>(i);
  cube.chirps = radar_.chirps_per_frame();
  cube.samples = radar_.samples_per_chirp;
  cube.receivers = radar_.receivers();
  decodeFrame(radar_, bytes(i).data(), cube.data);
  cube.chirp_valid.assign(static_cast<std::size_t>(cube.chirps), 1);
  if (plain()) return cube;
  const std::size_t chirp_bytes = radar_.bytes_per_chirp();
  const std::size_t values = cube.data.size() / static_cast<std::size_t>(cube.chirps);
  for (std::size_t chirp = 0; chirp < cube.chirp_valid.size(); ++chirp) {
    const std::size_t begin = static_cast<std::size_t>(i) * radar_.bytes_per_frame() + chirp * chirp_bytes;
    if (begin >= missing_bytes_ && stream_->has(begin - missing_bytes_, chirp_bytes)) continue;
    cube.chirp_valid[chirp] = 0;
    cube.lost_bytes += chirp_bytes;
    std::fill_n(cube.data.begin() + static_cast<std::ptrdiff_t>(chirp * values), values, std::int16_t{0});
  }
  return cube;
}

void writeCapture(const RadarConfig& radar, const std::vector<AdcCube>& cubes, const std::string& file) {
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  for (const AdcCube& cube : cubes) {
    const std::vector<std::uint8_t> bytes = encodeFrame(radar, cube.data);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  out.close();
  if (!out) throw std::runtime_error(file + ": capture cannot be written; check folder, rights and free space");
}

}  // namespace mmradartwin
