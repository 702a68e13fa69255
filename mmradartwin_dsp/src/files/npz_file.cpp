#include "mmradartwin_dsp/npz_file.h"

#include <boost/crc.hpp>
#include <limits>
#include <stdexcept>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "values are written as they lie, and called little endian");

/// Bytes of an unsigned number, little endian.
std::string le(std::size_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i) & 0xff);
  return text;
}

/// What stands before the values of a .npy, format 1.0; its length is a multiple of 64.
std::string npyHeader(const std::vector<std::size_t>& shape, const char* type) {
  std::string text = std::string("{'descr': '") + type + "', 'fortran_order': False, 'shape': (";
  for (const std::size_t extent : shape) text += std::to_string(extent) + ",";
  text += "), }";
  constexpr std::size_t kBefore = 10, kMultiple = 64;
  text.append(kMultiple - (kBefore + text.size() + 1) % kMultiple, ' ');
  text += '\n';
  return "\x93NUMPY" + le(1, 1) + le(0, 1) + le(text.size(), 2) + text;
}

}  // namespace

NpzFile::NpzFile(const std::string& file) : file_(file), out_(file, std::ios::binary | std::ios::trunc) {
  if (!out_) throw std::runtime_error(file + ": cannot be written; check folder, rights and free space");
}

void NpzFile::add(const std::string& name, const std::vector<std::size_t>& shape, const char* type, const void* values,
                  std::size_t value_bytes) {
  const std::string header = npyHeader(shape, type), file_name = name + ".npy";
  std::size_t bytes = value_bytes;
  for (const std::size_t extent : shape) bytes *= extent;
  const std::size_t size = header.size() + bytes, at = written_;
  if (at + size > std::numeric_limits<std::uint32_t>::max() - 65536) {
    throw InputError(file_ + ": " + name + " makes it larger than the 4 GB of a zip file; leave it out");
  }
  boost::crc_32_type crc;
  crc.process_bytes(header.data(), header.size());
  crc.process_bytes(values, bytes);
  constexpr std::size_t kVersion = 20, kDate = 0x21;  // 1980-01-01, so that equal arrays give equal files
  const std::string common = le(kVersion, 2) + le(0, 2) + le(0, 2) + le(0, 2) + le(kDate, 2) + le(crc.checksum(), 4) +
                             le(size, 4) + le(size, 4) + le(file_name.size(), 2) + le(0, 2);
  const std::string local = "PK\x03\x04" + common + file_name;
  out_ << local << header;
  out_.write(static_cast<const char*>(values), static_cast<std::streamsize>(bytes));
  directory_ +=
      "PK\x01\x02" + le(kVersion, 2) + common + le(0, 2) + le(0, 2) + le(0, 2) + le(0, 4) + le(at, 4) + file_name;
  written_ = at + local.size() + size;
  ++entries_;
}

void NpzFile::write(const std::string& name, const std::vector<std::size_t>& shape, const double* values) {
  add(name, shape, "<f8", values, sizeof *values);
}

void NpzFile::write(const std::string& name, const std::vector<std::size_t>& shape,
                    const std::complex<double>* values) {
  add(name, shape, "<c16", values, sizeof *values);
}

void NpzFile::write(const std::string& name, const std::vector<std::size_t>& shape, const std::int16_t* values) {
  add(name, shape, "<i2", values, sizeof *values);
}

void NpzFile::close() {
  out_ << directory_ << "PK\x05\x06" << le(0, 2) << le(0, 2) << le(entries_, 2) << le(entries_, 2)
       << le(directory_.size(), 4) << le(written_, 4) << le(0, 2);
  out_.close();
  if (!out_) throw std::runtime_error(file_ + ": cannot be written; check folder, rights and free space");
}

}  // namespace mmradartwin
