#include "asset/gltf_pose.h"

#include <algorithm>
#include <cmath>

#include "base/counted.h"

namespace kiln {

AffineMap map_of_parts(const std::array<double, 3>& t, std::array<double, 4> q,
                       const std::array<double, 3>& s) {
  const double size = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (double& value : q) value /= size;
  const auto [x, y, z, w] = q;
  return {(1 - 2 * (y * y + z * z)) * s[0],
          2 * (x * y + z * w) * s[0],
          2 * (x * z - y * w) * s[0],
          0,
          2 * (x * y - z * w) * s[1],
          (1 - 2 * (x * x + z * z)) * s[1],
          2 * (y * z + x * w) * s[1],
          0,
          2 * (x * z + y * w) * s[2],
          2 * (y * z - x * w) * s[2],
          (1 - 2 * (x * x + y * y)) * s[2],
          0,
          t[0],
          t[1],
          t[2],
          1};
}

AffineMap map_of_node(const GltfValue& node) {
  const GltfValue matrix = node["matrix"];
  if (matrix.exists()) {
    const AffineMap file_matrix = matrix.numbers<16>(kIdentityMap);
    if (file_matrix[3] != 0 || file_matrix[7] != 0 || file_matrix[11] != 0 ||
        file_matrix[15] != 1) {
      matrix.fail("its last row is not 0 0 0 1, so it is not an affine map");
    }
    return file_matrix;
  }
  const std::array<double, 4> q = node["rotation"].numbers<4>({0, 0, 0, 1});
  if (!(std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]) > 0)) {
    node["rotation"].fail("its quaternion is zero, which does not define a rotation");
  }
  return map_of_parts(node["translation"].numbers<3>({0, 0, 0}), q,
                      node["scale"].numbers<3>({1, 1, 1}));
}

GltfWorlds::GltfWorlds(const GltfFile& file, std::vector<std::optional<std::size_t>> parents,
                       std::optional<AffineMap> frame)
    : file_(file), parents_(std::move(parents)), frame_(frame) {}

const AffineMap& GltfWorlds::of(std::size_t node) {
  // The node, and all of its ancestors whose transforms are not known yet
  std::vector<std::size_t> pending_nodes;
  for (std::optional<std::size_t> at = node; at && !world_transforms_.contains(*at);
       at = parents_[*at]) {
    pending_nodes.push_back(*at);
  }
  for (; !pending_nodes.empty(); pending_nodes.pop_back()) {
    const std::size_t next = pending_nodes.back();
    const AffineMap local_transform = map_of_node(file_.list("nodes").at(next));
    const std::optional<std::size_t> parent = parents_[next];
    world_transforms_[next] = parent   ? product(world_transforms_.at(*parent), local_transform)
                              : frame_ ? product(*frame_, local_transform)
                                       : local_transform;
  }
  return world_transforms_.at(node);
}

const GltfJoints& GltfWorlds::joints(std::size_t skin) {
  const auto [entry, added] = joints_.try_emplace(skin);
  if (!added) return entry->second;
  const GltfValue nodes = file_.list("nodes"), skin_value = file_.list("skins").at(skin);
  const GltfValue list = skin_value["joints"];
  if (list.size() == 0) skin_value.fail("it has no joints");
  const GltfValue inverse_binds = skin_value["inverseBindMatrices"];
  GltfNumbers bind_matrices;  // Inverse bind matrices; empty: all are the identity
  if (const auto accessor = inverse_binds.index_into(file_.list("accessors"))) {
    bind_matrices = file_.numbers(*accessor, GltfFile::kMatrix);
    if (bind_matrices.count() < list.size()) {
      inverse_binds.fail("it has " + counted(bind_matrices.count(), "matrix") + ", but there are " +
                         std::to_string(list.size()) + " joints");
    }
  }
  for (std::size_t k = 0; k < list.size(); ++k) {
    AffineMap bind_matrix = kIdentityMap;
    if (!bind_matrices.values.empty()) {
      std::copy_n(bind_matrices.at(k), bind_matrix.size(), bind_matrix.begin());
      // Tolerance for the rounding of exporters that invert matrices in single precision.
      constexpr double kBindRounding = 1e-4;
      if (std::abs(bind_matrix[3]) > kBindRounding || std::abs(bind_matrix[7]) > kBindRounding ||
          std::abs(bind_matrix[11]) > kBindRounding ||
          !(std::abs(bind_matrix[15] - 1) <= kBindRounding)) {
        inverse_binds.fail("the last row of its matrix " + std::to_string(k) +
                           " is not 0 0 0 1, so it is not an affine map");
      }
      bind_matrix[3] = bind_matrix[7] = bind_matrix[11] = 0;
      bind_matrix[15] = 1;
    }
    entry->second.push_back(product(of(*list.at(k).index_into(nodes)), bind_matrix));
  }
  return entry->second;
}

std::vector<AffineMap> instances_of(const GltfFile& file, const GltfValue& node) {
  const GltfValue extension = node["extensions"]["EXT_mesh_gpu_instancing"];
  const GltfValue attributes = extension["attributes"];
  const auto read = [&](const char* name, std::size_t width) {
    const auto accessor = attributes[name].index_into(file.list("accessors"));
    return accessor ? file.numbers(*accessor, width) : GltfNumbers();
  };
  const GltfNumbers translations = read("TRANSLATION", 3), rotations = read("ROTATION", 4),
                    scales = read("SCALE", 3);
  const std::size_t count = std::max({translations.count(), rotations.count(), scales.count()});
  for (const GltfNumbers* const numbers : {&translations, &rotations, &scales}) {
    if (!numbers->values.empty() && numbers->count() != count) {
      attributes.fail("they have " + counted(numbers->count(), "element") + " and " +
                      std::to_string(count));
    }
  }
  if (count == 0) return {kIdentityMap};
  std::vector<AffineMap> maps;
  maps.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    std::array<double, 3> t{0, 0, 0}, s{1, 1, 1};
    std::array<double, 4> q{0, 0, 0, 1};
    if (!translations.values.empty()) std::copy_n(translations.at(i), 3, t.begin());
    if (!scales.values.empty()) std::copy_n(scales.at(i), 3, s.begin());
    if (!rotations.values.empty()) std::copy_n(rotations.at(i), 4, q.begin());
    if (!(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] > 0)) {
      attributes["ROTATION"].fail("instance " + std::to_string(i) +
                                  " has a zero quaternion, which does not define a rotation");
    }
    maps.push_back(map_of_parts(t, q, s));
  }
  return maps;
}

GltfInfluences influences_of(const GltfValue& attributes, const std::vector<GltfNumbers>& joints,
                             const std::vector<GltfNumbers>& weights, std::size_t count) {
  GltfInfluences result;
  if (joints.empty()) return result;
  constexpr std::size_t kJointsPerSet = 4;
  result.width = kJointsPerSet * joints.size();
  const std::size_t vertices = joints[0].count();
  result.joints.resize(vertices * result.width);
  result.weights.resize(result.joints.size());
  for (std::size_t v = 0; v < vertices; ++v) {
    double sum = 0;
    for (std::size_t i = 0; i < result.width; ++i) {
      const std::size_t set = i / kJointsPerSet;
      const double weight = weights[set].at(v)[i % kJointsPerSet];
      if (!(weight > 0) || !std::isfinite(weight)) continue;
      const double joint = joints[set].at(v)[i % kJointsPerSet];
      if (!(joint >= 0 && joint < static_cast<double>(count))) {
        attributes["JOINTS_" + std::to_string(set)].fail(
            "vertex " + std::to_string(v) + " has joint " + std::to_string(joint) +
            ", but its skin has only " + std::to_string(count));
      }
      result.joints[v * result.width + i] = static_cast<std::uint32_t>(joint);
      result.weights[v * result.width + i] = weight;
      sum += weight;
    }
    // Quantised weights only have a sum of about 1, so they are divided by it.
    for (std::size_t i = 0; i < result.width && sum > 0; ++i) {
      result.weights[v * result.width + i] /= sum;
    }
  }
  return result;
}

std::optional<AffineMap> GltfInfluences::map_of(const GltfJoints& of, std::size_t vertex) const {
  AffineMap map{};
  bool is_affected = false;
  for (std::size_t i = vertex * width; i < (vertex + 1) * width; ++i) {
    const double weight = weights[i];
    if (weight == 0) continue;
    is_affected = true;
    const AffineMap& joint = of[joints[i]];
    for (std::size_t k = 0; k < map.size(); ++k) map[k] += weight * joint[k];
  }
  if (!is_affected) return std::nullopt;
  map[3] = map[7] = map[11] = 0;
  map[15] = 1;
  return map;
}

}  // namespace kiln
