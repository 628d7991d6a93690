// Files of a small studio for tests of job files.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "cli/command_scene.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln::test {

inline void write(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

/// Assets NAME_low.obj and NAME_high.obj in assets/ of a fresh folder, each with a high poly of its own.
inline std::filesystem::path make_studio(const std::vector<std::string>& names,
                                         std::uint32_t faces = 600) {
  const std::filesystem::path folder = scratch_folder();
  std::uint32_t more = 0;
  for (const std::string& name : names) {
    const std::filesystem::path low = folder / "assets" / (name + "_low.obj");
    std::filesystem::create_directories(low.parent_path());
    save_obj(BumpySphere::light(), low);
    save_obj(BumpySphere::dense(faces + 40 * more++), folder / "assets" / (name + "_high.obj"));
  }
  return folder;
}

inline const char* const kStudioJob = R"([defaults]
size = 16
maps = ["normal", "height"]
out = "out/{dir}/{name}"
[profile.ci]
size = 8
[[bake]]
low = "assets/{dir}/{name}_low.*"
high = "assets/{dir}/{name}_high*.{fbx,glb,ply,obj}"
cage = { file = "assets/{dir}/{name}_cage.obj", optional = true }
skip = ["assets/wip/*"]
)";

}  // namespace kiln::test
