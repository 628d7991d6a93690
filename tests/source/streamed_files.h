// PLY files that can be read in parts, and limits of memory under which they are.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <string>

#include "base/memory.h"
#include "kiln/error.h"
#include "kiln/limits.h"
#include "kiln/mesh.h"

namespace kiln::test {

template <typename T>
void put(std::string& text, const T& value) {
  text.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// A binary PLY with the mesh's normals and colours, if it has them at its vertices.
inline std::string ply_of(const Mesh& mesh) {
  const bool normals = !mesh.normals.empty(), colors = !mesh.colors.empty();
  std::string text =
      "ply\nformat binary_little_endian 1.0\nelement vertex " +
      std::to_string(mesh.positions.size()) +
      "\nproperty float x\nproperty float y\nproperty float z\n" +
      (normals ? "property float nx\nproperty float ny\nproperty float nz\n" : "") +
      (colors ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "") +
      "element face " + std::to_string(mesh.triangles.size()) +
      "\nproperty list uchar int vertex_indices\nend_header\n";
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    put(text, mesh.positions[v]);
    if (normals) put(text, mesh.normals[v]);
    if (colors) text.append(reinterpret_cast<const char*>(mesh.colors[v].data()), 3);
  }
  for (const Triangle& t : mesh.triangles) {
    text.push_back(3);
    put(text, t);
  }
  return text;
}

inline std::filesystem::path save_ply(const Mesh& mesh, const std::filesystem::path& folder,
                                      const std::string& name = "high.ply") {
  std::ofstream(folder / name, std::ios::binary) << ply_of(mesh);
  return folder / name;
}

/// Leaves so much memory, once all that is free has gone back to the system.
inline void leave_memory(std::uint64_t bytes) {
  memory_fits(std::numeric_limits<std::uint64_t>::max());
  set_memory_limit(memory_limit() - memory_left() + bytes);
}

inline std::string error_of(const std::function<void()>& run) {
  try {
    run();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace kiln::test
