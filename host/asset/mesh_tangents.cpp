// Checks the tangents of vertices in a file, and converts them to tangents of corners.
#include <cmath>

#include "asset/mesh_builder.h"
#include "base/formatted.h"

namespace kiln {
namespace {

constexpr double kMaxLengthError =
    0.01;  // Maximum difference of a tangent's length from 1 that is not reported
constexpr double kMinNormalSine = 0.01;  // Minimum sine of the angle between tangent and normal

double length_of(const Vec3& v) {
  return std::sqrt(double{v.x} * v.x + double{v.y} * v.y + double{v.z} * v.z);
}

/// Sine of the angle between two vectors.
/// \param product  product of the lengths of the vectors
double sine_between(const Vec3& a, const Vec3& b, double product) {
  const double x = double{a.y} * b.z - double{a.z} * b.y;
  const double y = double{a.z} * b.x - double{a.x} * b.z;
  const double z = double{a.x} * b.y - double{a.y} * b.x;
  return std::sqrt(x * x + y * y + z * z) / product;
}

/// True if a triangle's UVs are mirrored.
bool has_mirrored_uvs(const Mesh& mesh, std::size_t t) {
  const auto& [a, b, c] = mesh.uv_triangles[t];
  const Vec2 &p = mesh.uvs[a], &q = mesh.uvs[b], &r = mesh.uvs[c];
  return (double{q.x} - p.x) * (double{r.y} - p.y) - (double{r.x} - p.x) * (double{q.y} - p.y) < 0;
}

/// Number of vertices that have the same problem, and the first of them.
struct TangentFault {
  std::uint64_t count = 0, first = 0;
  double value = 0;

  void add(std::uint64_t vertex, double its) {
    if (count++ != 0) return;
    first = vertex;
    value = its;
  }
  std::string vertex() const { return "vertex " + std::to_string(first); }
  std::string text() const {
    const std::string number = formatted("%.4g", value);
    return vertex() + ": " + number;
  }
};

}  // namespace

/// Clears tangents that do not form a valid frame with their normals, and warns of them.
void MeshBuilder::check_tangents(const Mesh& mesh) {
  const bool has_normals = mesh.normals.size() == positions.size();
  TangentFault unusable, non_unit, signs;
  for (std::size_t i = 0; i < tangents.size(); ++i) {
    Tangent& tangent = tangents[i];
    const double size = length_of(tangent.direction);
    const double sine_to_normal = has_normals && length_of(mesh.normals[i]) > 0
                                      ? sine_between(tangent.direction, mesh.normals[i], size)
                                      : 1;
    if (!(size > 0) || !std::isfinite(size) || !(sine_to_normal > kMinNormalSine)) {
      tangent.direction = {};
      unusable.add(i, size);
      continue;
    }
    if (std::abs(size - 1) > kMaxLengthError) non_unit.add(i, size);
    if (tangent_signs && std::abs(tangent.sign) != 1) signs.add(i, double{tangent.sign});
  }
  if (unusable.count != 0) {
    input_.warn("bad-tangents",
                std::to_string(unusable.count) +
                    " vertices have a tangent that is NaN, infinite, zero or along the normal (" +
                    unusable.vertex() + " for example): these are replaced by MikkTSpace's.",
                unusable.count);
  }
  if (non_unit.count != 0) {
    input_.warn("long-tangents",
                std::to_string(non_unit.count) +
                    " vertices have a tangent whose length is not 1 (" + non_unit.text() +
                    "): these were normalised.",
                non_unit.count);
  }
  if (signs.count != 0) {
    input_.warn("tangent-signs",
                std::to_string(signs.count) +
                    " vertices have a tangent whose fourth number is neither 1 nor -1 (" +
                    signs.text() + "); negative values are read as -1, all others as 1.",
                signs.count);
  }
}

/// Copies tangents of vertices to their corners. Without UVs, tangents are dropped.
void MeshBuilder::copy_tangents(Mesh& mesh) {
  if (tangents.empty() || mesh.uv_triangles.empty()) return;
  check_tangents(mesh);
  mesh.tangents.resize(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const float by_uvs = has_mirrored_uvs(mesh, t) ? -1.0F : 1.0F;
    for (std::size_t k = 0; k < 3; ++k) {
      const Tangent& vertex_tangent = tangents[mesh.triangles[t][k]];
      const float sign = !tangent_signs ? by_uvs : vertex_tangent.sign < 0 ? -1.0F : 1.0F;
      mesh.tangents[3 * t + k] = {vertex_tangent.direction, sign};
    }
  }
}

}  // namespace kiln
