// Scenes in memory for tests of jobs, and what their GLBs hold.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "job/run.h"
#include "kiln/job.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln::test {

/// The JSON of a GLB.
inline nlohmann::json head_of(const std::vector<std::byte>& glb) {
  std::uint32_t length = 0;
  std::memcpy(&length, glb.data() + 12, sizeof length);
  return nlohmann::json::parse(std::string(reinterpret_cast<const char*>(glb.data()) + 20, length));
}

/// A square of the plane z = `height` with the unit square as its UVs, and one material.
inline Mesh square_at(float x, float height, const std::string& material, float width = 1) {
  Mesh mesh = plane(4, 4, width, 1);
  for (Vec3& p : mesh.positions) p = {p.x + x, p.y, height};
  mesh.material_names = {material};
  mesh.materials.assign(mesh.triangles.size(), 0);
  return mesh;
}

inline JobResult run_in_memory(Job job, const RunHooks& hooks = {}) {
  job.in_memory = true;
  check(job);
  return run_job([] { return *device(); }, job, {}, hooks);
}

}  // namespace kiln::test
