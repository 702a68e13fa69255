#include "mmradartwin_dsp/sha256.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

TEST(Sha256, DigestsOfTheStandard) {  // FIPS 180-2, appendix B.1
  const std::string abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
  EXPECT_EQ(abc, sha256OfBytes("abc"));
  Sha256 pieces;
  pieces.add("a", 1);
  pieces.add("bc", 2);
  EXPECT_EQ(abc, pieces.hex());
  const std::string file = testing::TempDir() + "sha256_test_abc";
  std::ofstream(file) << "abc";
  EXPECT_EQ(abc, sha256OfFile(file));
  std::filesystem::remove(file);
  EXPECT_THROW(sha256OfFile(file), InputError);
}

}  // namespace
}  // namespace mmradartwin
