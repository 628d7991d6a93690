// Shared by tests of the command: a scene in files, and checks of a failure.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "cli/call.h"
#include "kiln/mesh.h"
#include "support/environment.h"
#include "support/process.h"
#include "support/shapes.h"

namespace kiln::test {

/// Writes a scene of a bumpy sphere and its low poly; returns the folder.
inline std::filesystem::path make_scene(std::uint32_t faces = 6000) {
  std::filesystem::path folder = scratch_folder();
  save_obj(BumpySphere::dense(faces), folder / "high.obj");
  save_obj(BumpySphere::light(), folder / "low.obj");
  return folder;
}

/// The low poly's halves in two materials, each over all of the unit square, the second moved by a tile.
inline Mesh low_of_halves(float tile, const char* first = "glass",
                          Mesh low = BumpySphere::light()) {
  low.material_names = {first, "body"};
  const std::vector<Vec2> uvs = low.uvs;
  low.uvs.clear();
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    const bool body = t % 2 != 0;
    low.materials.push_back(body ? 1 : 0);
    for (std::size_t k = 0; k < 3; ++k) {
      Vec2 uv = uvs[low.uv_triangles[t][k]];
      if (body) uv = {uv.y * 0.99F + tile, uv.x};
      low.uv_triangles[t][k] = static_cast<std::uint32_t>(low.uvs.size());
      low.uvs.push_back(uv);
    }
  }
  return low;
}

/// Writes kite.obj, one bent quad with UVs: cut along its shorter diagonal (corners 1 and 3) its middle lies at 0,
/// by a fan (corners 0 and 2) at 0.2. And cut.obj, the same cut along the shorter diagonal. \returns the folder
inline std::filesystem::path make_kite() {
  std::filesystem::path folder = scratch_folder();
  const std::string corners =
      "v -2 0 0.2\nv 0 -1 0\nv 2 0 0.2\nv 0 1 0\nvt 0 0.5\nvt 0.5 0\nvt 1 0.5\nvt 0.5 1\n";
  std::ofstream(folder / "kite.obj") << corners << "f 1/1 2/2 3/3 4/4\n";
  std::ofstream(folder / "cut.obj") << corners << "f 1/1 2/2 4/4\nf 2/2 3/3 4/4\n";
  return folder;
}

inline std::vector<std::string> names(const std::filesystem::path& folder) {
  std::vector<std::string> result;
  if (!std::filesystem::exists(folder)) return result;  // made for nothing, so gone
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename();
    if (!name.starts_with(".") || !name.ends_with(".kiln.json")) result.push_back(name);
  }
  std::sort(result.begin(), result.end());
  return result;
}

/// Expects an exit code, and a message that has all of `words`.
inline void expect_exit(const ProcessResult& result, int code,
                        const std::vector<std::string>& words) {
  EXPECT_EQ(result.exit_code, code) << result.errors;
  for (const std::string& word : words) {
    EXPECT_NE(result.errors.find(word), std::string::npos)
        << "'" << word << "' in: " << result.errors;
  }
}

/// Expects a failure with this code, one message that has all of `words`, and nothing in the folder.
inline void expect_failure(const std::vector<std::string>& arguments, int code,
                           const std::vector<std::string>& words,
                           const std::filesystem::path& out = {}) {
  const ProcessResult result = call_kiln(arguments);
  expect_exit(result, code, words);
  std::size_t messages = 0;
  for (std::size_t at = 0; (at = result.errors.find("kiln: ", at)) != std::string::npos; ++at)
    ++messages;
  EXPECT_EQ(messages, 1U) << result.errors;
  if (!out.empty() && std::filesystem::exists(out)) {
    EXPECT_TRUE(names(out).empty()) << names(out)[0];
  }
}

}  // namespace kiln::test
