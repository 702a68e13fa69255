#pragma once

#include <complex>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace mmradartwin {

/// A file of named arrays for other programs. Arrays are given in C order, the last index running fastest; shape {} is
/// one number.
class ArrayFile {
 public:
  virtual ~ArrayFile() = default;
  virtual void write(const std::string& name, const std::vector<std::size_t>& shape, const double* values) = 0;
  virtual void write(const std::string& name, const std::vector<std::size_t>& shape,
                     const std::complex<double>* values) = 0;
  virtual void write(const std::string& name, const std::vector<std::size_t>& shape, const std::int16_t* values) = 0;
  void write(const std::string& name, double value) { write(name, {}, &value); }
  /// Writes what is left; a file that is not closed is not complete. Throws std::runtime_error.
  virtual void close() = 0;
};

/// A MATLAB level 5 file (.mat), which MATLAB, Octave and SciPy read. Arrays keep their index order in the file:
/// x[m][n] becomes x(m+1, n+1), a list a column.
class MatFile : public ArrayFile {
 public:
  /// Throws std::runtime_error where the file cannot be made, InputError where this build lacks libmatio.
  explicit MatFile(const std::string& file);
  ~MatFile() override;
  using ArrayFile::write;
  void write(const std::string& name, const std::vector<std::size_t>& shape, const double* values) override;
  void write(const std::string& name, const std::vector<std::size_t>& shape,
             const std::complex<double>* values) override;
  void write(const std::string& name, const std::vector<std::size_t>& shape, const std::int16_t* values) override;
  void close() override;

 private:
  struct Handle;
  std::unique_ptr<Handle> handle_;
};

}  // namespace mmradartwin
