// A bumpy sphere and its low poly, on disk: what rating, studying and charting are tried on.
#pragma once

#include <cstdint>
#include <filesystem>

#include "kiln/mesh.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln::test {

/// The folder of high.obj, with `faces` triangles or so, and low.obj.
inline std::filesystem::path make_scene(std::uint32_t faces) {
  std::filesystem::path folder = test::scratch_folder();
  save_obj(test::BumpySphere::dense(faces), folder / "high.obj");
  save_obj(test::BumpySphere::light(24, 12), folder / "low.obj");
  return folder;
}

}  // namespace kiln::test
