#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis {

/// A room with one metal cabinet, its front in the plane x = 3 m from y = -1 to 1 m. Files live as long as it does.
class CabinetRoom {
 public:
  CabinetRoom() {
    std::string pattern = (std::filesystem::temp_directory_path() / "mmradartwin_test_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
    folder_ = pattern;
    std::ofstream(folder_ + "/materials.yaml") << "materials:\n  Metal: {model: conductor}\n";
    std::ofstream(folder_ + "/scene.yaml") << "meshes: [{file: cabinet.obj}]\nmaterials: materials.yaml\n";
    std::ofstream obj(folder_ + "/cabinet.obj");
    obj << "o cabinet\nusemtl Metal\n";
    for (const char* z : {"-2", "2"}) {
      for (const char* xy : {"3 -1 ", "4 -1 ", "4 1 ", "3 1 "}) obj << "v " << xy << z << "\n";
    }
    obj << "f 1 2 3 4\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  }
  ~CabinetRoom() { std::filesystem::remove_all(folder_); }
  CabinetRoom(const CabinetRoom&) = delete;
  CabinetRoom& operator=(const CabinetRoom&) = delete;
  std::string sceneFile() const { return folder_ + "/scene.yaml"; }

 private:
  std::string folder_;
};

}  // namespace mmradartwin::diagnosis
