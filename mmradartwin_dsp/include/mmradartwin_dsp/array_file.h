#pragma once

#include <complex>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace mmradartwin {

/// A MATLAB level 5 file (.mat), which MATLAB, Octave and SciPy read. Arrays are given in C order, the last index
/// running fastest, and keep their index order in the file: x[m][n] becomes x(m+1, n+1).
class MatFile {
 public:
  /// Throws std::runtime_error where the file cannot be made, InputError where this build lacks libmatio.
  explicit MatFile(const std::string& file);
  ~MatFile();
  void write(const std::string& name, const std::vector<std::size_t>& shape, const double* values);
  void write(const std::string& name, const std::vector<std::size_t>& shape, const std::complex<double>* values);
  void write(const std::string& name, const std::vector<std::size_t>& shape, const std::int16_t* values);
  void write(const std::string& name, double value) { write(name, {1, 1}, &value); }

 private:
  struct Handle;
  std::unique_ptr<Handle> handle_;
};

}  // namespace mmradartwin
