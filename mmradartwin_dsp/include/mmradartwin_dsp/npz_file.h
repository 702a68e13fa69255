#pragma once

#include <fstream>

#include "mmradartwin_dsp/array_file.h"

namespace mmradartwin {

/// NumPy's archive (.npz): a zip file, not compressed, with one NAME.npy per array.
class NpzFile : public ArrayFile {
 public:
  /// Throws std::runtime_error where the file cannot be made.
  explicit NpzFile(const std::string& file);
  using ArrayFile::write;
  void write(const std::string& name, const std::vector<std::size_t>& shape, const double* values) override;
  void write(const std::string& name, const std::vector<std::size_t>& shape,
             const std::complex<double>* values) override;
  void write(const std::string& name, const std::vector<std::size_t>& shape, const std::int16_t* values) override;
  void close() override;

 private:
  /// type as NumPy writes it, "<f8" say.
  void add(const std::string& name, const std::vector<std::size_t>& shape, const char* type, const void* values,
           std::size_t value_bytes);

  std::string file_;
  std::ofstream out_;
  std::string directory_;  ///< the zip file's, which stands at its end
  std::size_t entries_ = 0, written_ = 0;
};

}  // namespace mmradartwin
