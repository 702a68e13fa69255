#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace mmradartwin {

/// SHA-256 of bytes that come in pieces.
class Sha256 {
 public:
  using Digest = std::array<std::uint8_t, 32>;

  Sha256();
  ~Sha256();
  void add(const void* bytes, std::size_t size);
  /// The digest of all bytes so far; nothing can be added after it.
  Digest digest();
  std::string hex();

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

/// Digest of `bytes`, in lower-case hexadecimal.
std::string sha256OfBytes(const std::string& bytes);
/// Digest of a file's content, in lower-case hexadecimal. Throws InputError where it cannot be read.
std::string sha256OfFile(const std::string& file);

}  // namespace mmradartwin
