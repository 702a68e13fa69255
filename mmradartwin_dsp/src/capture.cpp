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

#include "mmradartwin_dsp/input_error.h"

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
    walkChirp(radar,
              [in, out](std::size_t capture, std::size_t cube) { std::memcpy(out + 2 * capture, in + cube, 2); });
  }
  return bytes;
}

std::vector<std::string> captureParts(const std::string& file) {
  static const std::regex kFirst("(.*_raw_)0(\\.bin)", std::regex::icase);
  const fs::path path(file);
  const std::string name = path.filename().string();
  std::smatch match;
  if (!std::regex_match(name, match, kFirst)) return {file};
  const std::string head = match[1], tail = match[2];
  const auto part = [&](std::size_t number) { return path.parent_path() / (head + std::to_string(number) + tail); };
  std::vector<std::string> parts = {file};
  std::error_code error;
  while (fs::exists(part(parts.size()), error)) parts.push_back(part(parts.size()).string());
  // A part that lies beyond a missing one would be taken for another capture's.
  for (const auto& entry : fs::directory_iterator(path.has_parent_path() ? path.parent_path() : ".", error)) {
    const std::string other = entry.path().filename().string();
    if (other.size() <= head.size() + tail.size() || other.compare(0, head.size(), head) != 0) continue;
    const std::string number = other.substr(head.size(), other.size() - head.size() - tail.size());
    if (number.size() > 6 || other != head + number + tail) continue;
    if (number.find_first_not_of("0123456789") != std::string::npos) continue;
    if (std::stoul(number) > parts.size()) {
      throw InputError(file + ": " + head + std::to_string(parts.size()) + tail + " is missing, and " + other +
                       " is there; put all parts of the capture into one folder");
    }
  }
  return parts;
}

CaptureReader::CaptureReader(const RadarConfig& radar, const std::string& file, Rest rest)
    : radar_(radar), file_(file) {
  std::size_t size = 0;
  for (const std::string& part : captureParts(file)) {
    const int descriptor = ::open(part.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) {
      throw InputError(part + ": capture cannot be opened (" + std::strerror(errno) +
                       "); put the recorded file there or take its pose out of poses.csv");
    }
    const std::shared_ptr<const int> owner(new int(descriptor), [](const int* d) {
      ::close(*d);
      delete d;
    });
    struct stat status = {};
    if (::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
      throw InputError(part + ": is no capture file; give a .bin with the recorded bytes");
    }
    parts_.push_back({owner, size, size + static_cast<std::size_t>(status.st_size)});
    size = parts_.back().end;
  }
  frames_ = static_cast<int>(size / radar_.bytes_per_frame());
  if (rest == Rest::kRefused || frames_ == 0) requireWholeFrames();
}

void CaptureReader::requireWholeFrames() const {
  const std::size_t size = parts_.back().end, rest = size % radar_.bytes_per_frame();
  if (frames_ > 0 && rest == 0) return;
  throw TruncatedCapture(file_ + ": capture is truncated or not from this radar: " + std::to_string(size) + " bytes " +
                         (parts_.size() > 1 ? "in " + std::to_string(parts_.size()) + " parts " : "") + "are " +
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
  std::size_t done = 0;
  while (done < bytes.size()) {
    const std::size_t offset = static_cast<std::size_t>(i) * bytes.size() + done;
    const auto part = std::find_if(parts_.begin(), parts_.end(), [&](const Part& p) { return offset < p.end; });
    const ssize_t got =
        ::pread(*part->descriptor, bytes.data() + done, std::min(bytes.size() - done, part->end - offset),
                static_cast<off_t>(offset - part->begin));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) {
      throw InputError(file_ + ": frame " + std::to_string(i) + " cannot be read (" +
                       (got < 0 ? std::strerror(errno) : "the file has become shorter") + ")");
    }
    done += static_cast<std::size_t>(got);
  }
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
