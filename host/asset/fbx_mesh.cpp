#ifdef KILN_HAS_UFBX
#include "asset/fbx_mesh.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "mesh/vector.h"

namespace kiln {
namespace {

Vec3d vector_of(const ufbx_vec3& v) { return {v.x, v.y, v.z}; }

/// Rotates a vector by the shortest rotation that turns one unit vector into another.
Vec3d rotate_by(const Vec3d& v, const Vec3d& from, const Vec3d& to) {
  const Vec3d axis = cross(from, to);
  const double cosine = dot(from, to);
  if (cosine < -1 + 1e-12) return v * -1.0;
  return v * cosine + cross(axis, v) + axis * (dot(axis, v) / (1 + cosine));
}

}  // namespace

AffineMap fbx_map(const ufbx_matrix& m) {
  return {m.m00, m.m10, m.m20, 0, m.m01, m.m11, m.m21, 0,
          m.m02, m.m12, m.m22, 0, m.m03, m.m13, m.m23, 1};
}

FbxPose::FbxPose(const ufbx_node& node, const ufbx_mesh& mesh, const AffineMap& to_world)
    : mesh_(mesh),
      to_world_(to_world),
      of_node_(product(to_world, fbx_map(node.geometry_to_world))),
      normal_transform_of_node_(of_node_) {
  const std::size_t count = mesh.vertices.count;
  const auto is_active = [](const ufbx_blend_channel* channel) {
    return std::any_of(channel->keyframes.begin(), channel->keyframes.end(),
                       [](const ufbx_blend_keyframe& key) { return key.effective_weight != 0; });
  };
  for (const ufbx_blend_deformer* blend : mesh.blend_deformers) {
    if (std::none_of(blend->channels.begin(), blend->channels.end(), is_active)) continue;
    if (morphed_.empty()) morphed_.assign(mesh.vertices.begin(), mesh.vertices.end());
    fbx_add_blend_vertex_offsets(*blend, morphed_.data(), count);
  }
  if (mesh.skin_deformers.count == 0) return;
  const ufbx_skin_deformer& skin = *mesh.skin_deformers.data[0];
  if (skin.vertices.count < count) return;
  poses_.reserve(count);
  for (std::size_t v = 0; v < count; ++v) {
    poses_.push_back(fbx_skin_vertex_matrix(skin, v, node.geometry_to_world));
  }
}

AffineMap FbxPose::map(std::size_t vertex) const {
  return poses_.empty() ? of_node_ : product(to_world_, fbx_map(poses_[vertex]));
}

MeshBuilder::Position FbxPose::world_position(std::size_t index) const {
  const ufbx_vec3& p = vertex(index);
  const AffineMap m = map(index);
  MeshBuilder::Position result{};
  for (std::size_t k = 0; k < 3; ++k) {
    result[k] = m[k] * p.x + m[4 + k] * p.y + m[8 + k] * p.z + m[12 + k];
  }
  return result;
}

Vec3 FbxPose::normal(std::size_t vertex, const ufbx_vec3& n) const {
  return poses_.empty() ? normal_transform_of_node_(n.x, n.y, n.z)
                        : NormalTransform(map(vertex))(n.x, n.y, n.z);
}

bool FbxPose::mirrors(std::size_t vertex) const {
  return poses_.empty() ? normal_transform_of_node_.mirrors()
                        : NormalTransform(map(vertex)).mirrors();
}

std::vector<ufbx_vec3> morphed_normals(const ufbx_mesh& mesh, const FbxPose& pose) {
  if (!pose.is_morphed() || !mesh.vertex_normal.exists) return {};
  struct FaceNormals {
    // Sums of the area vectors of some faces, before and after morphing
    Vec3d before{0, 0, 0}, after{0, 0, 0};
  };
  // Sums over the faces that share a pair of vertex and normal
  std::unordered_map<std::uint64_t, FaceNormals> face_normals;
  const auto key_of = [&mesh](std::size_t corner) {
    return std::uint64_t{mesh.vertex_indices.data[corner]} << 32U |
           mesh.vertex_normal.indices.data[corner];
  };
  const auto is_complete = [&mesh](std::size_t corner) {
    return mesh.vertex_indices.data[corner] < mesh.vertices.count &&
           mesh.vertex_normal.indices.data[corner] < mesh.vertex_normal.values.count;
  };
  for (const ufbx_face& face : mesh.faces) {
    FaceNormals sums;
    bool has_all_faces = true;
    for (std::uint32_t i = 0; i < face.num_indices; ++i) {
      has_all_faces = has_all_faces && is_complete(face.index_begin + i);
    }
    if (!has_all_faces) continue;
    const auto corner = [&](std::uint32_t i) {
      return mesh.vertex_indices.data[face.index_begin + i % face.num_indices];
    };
    for (std::uint32_t i = 1; i + 1 < face.num_indices; ++i) {
      const auto area = [&](const auto& place) {
        const Vec3d a = place(corner(0));
        return cross(place(corner(i)) - a, place(corner(i + 1)) - a);
      };
      sums.before =
          sums.before + area([&](std::uint32_t v) { return vector_of(mesh.vertices.data[v]); });
      sums.after = sums.after + area([&](std::uint32_t v) { return vector_of(pose.vertex(v)); });
    }
    for (std::uint32_t i = 0; i < face.num_indices; ++i) {
      FaceNormals& corner_normals = face_normals[key_of(face.index_begin + i)];
      corner_normals.before = corner_normals.before + sums.before;
      corner_normals.after = corner_normals.after + sums.after;
    }
  }
  std::vector<ufbx_vec3> result(mesh.num_indices);
  for (std::size_t corner = 0; corner < mesh.num_indices; ++corner) {
    if (!is_complete(corner)) continue;
    const ufbx_vec3& file_normal =
        mesh.vertex_normal.values.data[mesh.vertex_normal.indices.data[corner]];
    result[corner] = file_normal;
    const auto found = face_normals.find(key_of(corner));
    if (found == face_normals.end()) continue;
    const double before = length(found->second.before), after = length(found->second.after);
    if (!std::isnormal(before) || !std::isnormal(after)) continue;
    const Vec3d n = rotate_by(vector_of(file_normal), found->second.before * (1 / before),
                              found->second.after * (1 / after));
    result[corner].x = n.x;
    result[corner].y = n.y;
    result[corner].z = n.z;
  }
  return result;
}

}  // namespace kiln
#endif
