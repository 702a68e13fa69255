#include "mmradartwin_dsp/array_file.h"

#include <numeric>
#include <stdexcept>
#include <utility>

#include "mmradartwin_dsp/input_error.h"

#ifdef MMRADARTWIN_HAS_MATIO
#include <matio.h>

namespace mmradartwin {
namespace {

/// MATLAB's first index runs fastest.
template <typename In, typename Take>
auto toColumnMajor(const std::vector<std::size_t>& shape, const In* values, Take take) {
  const std::size_t count = std::accumulate(shape.begin(), shape.end(), std::size_t{1}, std::multiplies<>());
  std::vector<decltype(take(values[0]))> out(count);
  std::vector<std::size_t> index(shape.size(), 0);
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t at = 0;
    for (std::size_t d = shape.size(); d-- > 0;) at = at * shape[d] + index[d];
    out[at] = take(values[i]);
    for (std::size_t d = shape.size(); d-- > 0 && ++index[d] == shape[d];) index[d] = 0;
  }
  return out;
}

}  // namespace

struct MatFile::Handle {
  std::string file;
  mat_t* mat = nullptr;

  void write(const std::string& name, matio_classes type, matio_types stored, std::vector<std::size_t> shape,
             void* data, int flags) {
    while (shape.size() < 2) shape.push_back(1);  // MATLAB knows no fewer
    const std::unique_ptr<matvar_t, decltype(&Mat_VarFree)> variable(
        Mat_VarCreate(name.c_str(), type, stored, static_cast<int>(shape.size()), shape.data(), data,
                      flags | MAT_F_DONT_COPY_DATA),
        Mat_VarFree);
    if (!variable || Mat_VarWrite(mat, variable.get(), MAT_COMPRESSION_ZLIB) != 0) {
      throw std::runtime_error(file + ": " + name + " cannot be written; check folder, rights and free space");
    }
  }
};

MatFile::MatFile(const std::string& file) : handle_(std::make_unique<Handle>()) {
  handle_->file = file;
  handle_->mat = Mat_CreateVer(file.c_str(), nullptr, MAT_FT_MAT5);
  if (!handle_->mat) throw std::runtime_error(file + ": cannot be written; check folder, rights and free space");
}

MatFile::~MatFile() {
  if (handle_->mat) Mat_Close(handle_->mat);
}

void MatFile::close() {
  if (Mat_Close(std::exchange(handle_->mat, nullptr)) == 0) return;
  throw std::runtime_error(handle_->file + ": cannot be written; check folder, rights and free space");
}

void MatFile::write(const std::string& name, const std::vector<std::size_t>& shape, const double* values) {
  auto data = toColumnMajor(shape, values, [](double value) { return value; });
  handle_->write(name, MAT_C_DOUBLE, MAT_T_DOUBLE, shape, data.data(), 0);
}

void MatFile::write(const std::string& name, const std::vector<std::size_t>& shape,
                    const std::complex<double>* values) {
  auto re = toColumnMajor(shape, values, [](const std::complex<double>& value) { return value.real(); });
  auto im = toColumnMajor(shape, values, [](const std::complex<double>& value) { return value.imag(); });
  mat_complex_split_t split = {re.data(), im.data()};
  handle_->write(name, MAT_C_DOUBLE, MAT_T_DOUBLE, shape, &split, MAT_F_COMPLEX);
}

void MatFile::write(const std::string& name, const std::vector<std::size_t>& shape, const std::int16_t* values) {
  auto data = toColumnMajor(shape, values, [](std::int16_t value) { return value; });
  handle_->write(name, MAT_C_INT16, MAT_T_INT16, shape, data.data(), 0);
}

}  // namespace mmradartwin

#else

namespace mmradartwin {

struct MatFile::Handle {};
MatFile::MatFile(const std::string& file) {
  throw InputError(file + ": this build cannot write .mat files; install libmatio-dev and build again");
}
MatFile::~MatFile() = default;
void MatFile::write(const std::string&, const std::vector<std::size_t>&, const double*) {}
void MatFile::write(const std::string&, const std::vector<std::size_t>&, const std::complex<double>*) {}
void MatFile::write(const std::string&, const std::vector<std::size_t>&, const std::int16_t*) {}
void MatFile::close() {}

}  // namespace mmradartwin

#endif
