#include "mmradartwin_dsp/sha256.h"

#include <openssl/evp.h>

#include <fstream>
#include <vector>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/input_file.h"

namespace mmradartwin {

struct Sha256::Context {
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> evp{EVP_MD_CTX_new(), EVP_MD_CTX_free};
};

Sha256::Sha256() : context_(std::make_unique<Context>()) {
  EVP_DigestInit_ex(context_->evp.get(), EVP_sha256(), nullptr);
}

Sha256::~Sha256() = default;

void Sha256::add(const void* bytes, std::size_t size) { EVP_DigestUpdate(context_->evp.get(), bytes, size); }

Sha256::Digest Sha256::digest() {
  Digest digest;
  EVP_DigestFinal_ex(context_->evp.get(), digest.data(), nullptr);
  return digest;
}

std::string Sha256::hex() {
  std::string text;
  for (std::uint8_t byte : digest()) {
    text += "0123456789abcdef"[byte >> 4];
    text += "0123456789abcdef"[byte & 15];
  }
  return text;
}

std::string sha256OfBytes(const std::string& bytes) {
  Sha256 hash;
  hash.add(bytes.data(), bytes.size());
  return hash.hex();
}

std::string sha256OfFile(const std::string& file) {
  requireRegularFile(file);
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(file + ": cannot be read; check the path and its rights");
  Sha256 hash;
  std::vector<char> buffer(1 << 16);
  while (in) {
    in.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    hash.add(buffer.data(), static_cast<std::size_t>(in.gcount()));
  }
  return hash.hex();
}

}  // namespace mmradartwin
