#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <ostream>
#include <random>
#include <string>
#include <vector>

namespace mmradartwin {

/// A reader of bytes from outside. Whatever they are, it must come back in bounded time and memory: with a result, or
/// with an error of the kind that is meant for people (InputError, RigError), which `read` takes in. Any other
/// exception passes through and is a bug.
struct HostileInput {
  std::string name;
  std::function<void(const std::string& bytes)> read;
  std::vector<std::string> seeds;  ///< well-formed inputs, and those that once went wrong
};

/// For the test's messages.
inline void PrintTo(const HostileInput& input, std::ostream* out) { *out << input.name; }

/// The readers of one package; each *_inputs.cpp has its own.
std::vector<HostileInput> hostileInputs();

/// `read` with InputError taken in.
void refusing(const std::function<void()>& read);

/// A folder for one input's files, empty at first, removed at the end of the program.
std::string inputFolder();
void writeInput(const std::string& file, const std::string& bytes);

/// One of `seeds` with one to eight changes: bits, bytes, pieces erased, doubled, swapped with another seed's, numbers
/// that are huge, characters that mean something.
std::string mutated(const std::vector<std::string>& seeds, std::mt19937_64& random);

}  // namespace mmradartwin
