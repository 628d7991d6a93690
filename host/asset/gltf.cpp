// Reads the meshes and the hierarchy of glTF.
#include "asset/gltf.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string_view>
#include <tuple>

#include "asset/axes.h"
#include "asset/gltf_draco.h"
#include "asset/gltf_pose.h"
#include "asset/hierarchy.h"
#include "asset/materials.h"
#include "asset/mesh_builder.h"
#include "base/counted.h"
#include "base/srgb.h"
#include "io/file/bounds.h"
#include "io/file/text_scanner.h"
#include "kiln/image.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

// Values of a primitive's `mode`: 0 to 3 are points and lines, 5 is TRIANGLE_STRIP.
constexpr std::uint64_t kTriangles = 4, kTriangleFan = 6;

/// Transforms positions, normals and tangents by a matrix.
class MeshTransform {
 public:
  explicit MeshTransform(const AffineMap& m) : m_(m) {
    const Vec3d x(m[0], m[1], m[2]), y(m[4], m[5], m[6]), z(m[8], m[9], m[10]);
    const Vec3d yz = cross(y, z), zx = cross(z, x), xy = cross(x, y);
    const double determinant = dot(x, yz);
    is_mirroring_ = determinant < 0;
    // The normal matrix is the transposed inverse, up to a positive factor. It is divided by its
    // largest entry, so that floats stay in range.
    double largest = 0;
    for (const Vec3d& v : {yz, zx, xy}) {
      largest = std::max({largest, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    }
    const double scale = (is_mirroring_ ? -1.0 : 1.0) / (largest > 0 ? largest : 1);
    n_ = {yz * scale, zx * scale, xy * scale};
  }

  bool mirrors() const { return is_mirroring_; }
  MeshBuilder::Position transform_position(const double* p) const {
    MeshBuilder::Position result;
    for (std::size_t k = 0; k < 3; ++k) {
      result[k] = m_[k] * p[0] + m_[4 + k] * p[1] + m_[8 + k] * p[2] + m_[12 + k];
    }
    return result;
  }
  Vec3 normal(const Vec3d& n) const { return unit(n_[0] * n.x + n_[1] * n.y + n_[2] * n.z); }
  /// A tangent in world space. It keeps its length from the file, so that non-unit tangents are
  /// reported.
  Vec3 tangent(const double* t) const {
    const Vec3d file_tangent(t[0], t[1], t[2]);
    const Vec3d world_tangent(m_[0] * t[0] + m_[4] * t[1] + m_[8] * t[2],
                              m_[1] * t[0] + m_[5] * t[1] + m_[9] * t[2],
                              m_[2] * t[0] + m_[6] * t[1] + m_[10] * t[2]);
    const double size = length(world_tangent);
    return to_float(size > 0 && std::isfinite(size) ? world_tangent * (length(file_tangent) / size)
                                                    : world_tangent);
  }

 private:
  static Vec3 unit(const Vec3d& n) {
    const double size = length(n);
    return size > 0 && std::isfinite(size) ? to_float(n * (1 / size)) : Vec3{};
  }
  AffineMap m_;
  bool is_mirroring_ = false;
  std::array<Vec3d, 3> n_{};
};

/// Vertices and triangles of a primitive in the file's coordinates, after morph targets were added.
struct Primitive {
  GltfNumbers positions, normals, uvs, tangents, colors;
  // UVs of the other sets, in the order of GltfReader::other_sets_; empty if there are none
  std::vector<GltfNumbers> other_uvs;
  std::vector<GltfNumbers> joints, weights;  // One element for each set of joints and weights
  std::string place;
  std::vector<Triangle> triangles;
  std::size_t material = 0;
};

const std::string kUvSet = "TEXCOORD_";

constexpr std::uint64_t kMaxVertices = 0x7FFFFFFF;  // So indices fit in 31 bits

class GltfReader {
 public:
  explicit GltfReader(const MeshInput& input)
      : input_(input), file_(input), builder_(input), material_names_(gltf_material_names(file_)) {}

  Asset read(bool with_materials) {
    Asset asset;
    asset.extras = file_.root()["asset"]["extras"].dump();
    asset.copyright = file_.root()["asset"]["copyright"].text();
    asset.scene = scene_of_file();
    const auto parent = find_parents();
    worlds_.emplace(file_, parent, world_.map);
    visit_nodes(asset, parent);
    scan_meshes();
    choose_uv_set();
    for (const std::uint32_t set : gltf_uv_sets(file_)) {
      if (set == uv_set_ || set >= uv_sets_) continue;
      other_sets_.push_back(set);
      builder_.other_uvs.push_back({set, {}});
    }
    require_memory_of_meshes();
    uv_maps_ = gltf_uv_maps(file_, uv_set_, input_.warnings != nullptr);
    for (const PlacedMesh& placed : placed_meshes_) add(placed, asset);
    warn();
    if (builder_.faces() == 0) fail_empty();
    // If the lists of tangents and normals have equal sizes, check_tangents() assumes that they belong together. One
    // unused normal makes the sizes differ.
    if (flat_triangles_ != 0 && builder_.normals.size() == builder_.positions.size()) {
      builder_.normals.push_back({});
    }
    if (file_.list("materials").size() != 0 && input_.folder) {
      builder_.material_files.push_back(std::filesystem::path(input_.file).filename().string());
    }
    builder_.tangent_signs = true;
    builder_.is_placed = true;
    asset.mesh = builder_.finish();
    asset.mesh.metres = world_.metres;
    asset.mesh.uv_set = uv_set_;
    if (!with_materials) return asset;
    asset.materials =
        materials_by_name(read_gltf_materials(file_, uv_set_), asset.mesh.material_names);
    set_vertex_opacity(asset.mesh, asset.materials);
    return asset;
  }

 private:
  /// A mesh that a node places.
  struct PlacedMesh {
    std::size_t mesh;
    std::uint32_t node;  // Index of the node in Asset::nodes
    AffineMap matrix;
    std::string name;
    std::optional<std::size_t> skin;
    std::vector<double> weights;  // Weights of the mesh's morph targets at this node
  };

  /// Finds the parent of each node. Checks that nodes have at most one parent, and that there are
  /// no cycles.
  std::vector<std::optional<std::size_t>> find_parents() const {
    const GltfValue nodes = file_.list("nodes");
    std::vector<std::optional<std::size_t>> parent(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const GltfValue children = nodes.at(i)["children"];
      for (std::size_t k = 0; k < children.size(); ++k) {
        const std::size_t child = *children.at(k).index_into(nodes);
        if (parent[child]) {
          children.at(k).fail("nodes[" + std::to_string(child) + "] is a child of nodes[" +
                              std::to_string(*parent[child]) + "] already");
        }
        parent[child] = i;
      }
    }
    // All nodes, parents before children. Nodes that are not reached from a root belong to a cycle
    // or lie below one.
    std::vector<std::size_t> ordered_nodes;
    for (std::size_t i = 0; i < parent.size(); ++i) {
      if (!parent[i]) ordered_nodes.push_back(i);
    }
    std::vector<bool> is_ordered(parent.size());
    for (std::size_t next = 0; next < ordered_nodes.size(); ++next) {
      is_ordered[ordered_nodes[next]] = true;
      const GltfValue children = nodes.at(ordered_nodes[next])["children"];
      for (std::size_t k = 0; k < children.size(); ++k)
        ordered_nodes.push_back(children.at(k).count(0));
    }
    const auto unreached = std::find(is_ordered.begin(), is_ordered.end(), false);
    if (unreached != is_ordered.end()) {
      nodes.at(static_cast<std::size_t>(unreached - is_ordered.begin()))
          .fail("it is its own ancestor");
    }
    return parent;
  }

  /// The root nodes of the default scene; if there is none, of all scenes; if there are no scenes,
  /// all nodes without a parent. If a scene lists both a node and its ancestor, the node is used
  /// once, below its ancestor.
  std::vector<std::size_t> find_roots(const std::vector<std::optional<std::size_t>>& parent) {
    const GltfValue nodes = file_.list("nodes"), scenes = file_.list("scenes");
    std::vector<std::size_t> result;
    std::vector<bool> is_root_used(nodes.size());
    const auto add_roots_of = [&](const GltfValue& scene) {
      const GltfValue list = scene["nodes"];
      std::vector<bool> is_listed(nodes.size());
      for (std::size_t k = 0; k < list.size(); ++k) is_listed[*list.at(k).index_into(nodes)] = true;
      for (std::size_t k = 0; k < list.size(); ++k) {
        const std::size_t node = list.at(k).count(0);
        if (parent[node]) {
          std::optional<std::size_t> ancestor = parent[node];
          while (ancestor && !is_listed[*ancestor]) ancestor = parent[*ancestor];
          if (!ancestor) {
            list.at(k).fail("nodes[" + std::to_string(node) +
                            "] is not a root: it is a child of nodes[" +
                            std::to_string(*parent[node]) + "]");
          }
          if (nested_scene_nodes_++ == 0) first_nested_node_ = list.at(k).place();
          continue;
        }
        if (!is_root_used[node]) result.push_back(node);
        is_root_used[node] = true;
      }
    };
    const GltfValue scene = file_.root()["scene"];
    if (scene.exists() && scenes.exists()) {
      add_roots_of(scenes.at(*scene.index_into(scenes)));
    } else if (scenes.size() != 0) {
      for (std::size_t i = 0; i < scenes.size(); ++i) add_roots_of(scenes.at(i));
    } else {
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (!parent[i]) result.push_back(i);
      }
    }
    return result;
  }

  /// Name of the default scene, or of the only one.
  std::string scene_of_file() const {
    const GltfValue scenes = file_.list("scenes"), scene = file_.root()["scene"];
    if (scene.exists() && scenes.exists()) return scenes.at(*scene.index_into(scenes)).dump();
    return scenes.size() == 1 ? scenes.at(0).dump() : "";
  }

  void visit_nodes(Asset& asset, const std::vector<std::optional<std::size_t>>& parent) {
    const GltfValue nodes = file_.list("nodes"), meshes = file_.list("meshes");
    struct Step {
      std::size_t node;
      std::uint32_t parent;
    };
    std::vector<Step> open_steps;
    const std::vector<std::size_t> first = find_roots(parent);
    for (auto root = first.rbegin(); root != first.rend(); ++root) {
      open_steps.push_back({*root, AssetNode::kNone});
    }
    std::vector<AffineMap> worlds;
    UniqueNames unique_names;
    while (!open_steps.empty()) {
      const Step step = open_steps.back();
      open_steps.pop_back();
      const GltfValue node = nodes.at(step.node);
      const auto index = static_cast<std::uint32_t>(asset.nodes.size());
      AssetNode& asset_node = asset.nodes.emplace_back();
      asset_node.name = node["name"].text();
      asset_node.parent = step.parent;
      asset_node.transform = map_of_node(node);
      if (step.parent == AssetNode::kNone && world_.map) {
        asset_node.transform = product(*world_.map, asset_node.transform);
      }
      asset_node.extras = node["extras"].dump();
      worlds.push_back(step.parent == AssetNode::kNone
                           ? asset_node.transform
                           : product(worlds[step.parent], asset_node.transform));
      if (const auto mesh = node["mesh"].index_into(meshes)) {
        asset_node.mesh_extras = meshes.at(*mesh)["extras"].dump();
        std::string name =
            asset_node.name.empty() ? meshes.at(*mesh)["name"].text() : asset_node.name;
        if (name.empty()) name = "node " + std::to_string(step.node);
        const auto skin = node["skin"].index_into(file_.list("skins"));
        const GltfValue node_weights = node["weights"];
        const std::vector<double> weights =
            numbers_of(node_weights.exists() ? node_weights : meshes.at(*mesh)["weights"]);
        // A skinned mesh is placed by its joints, so all instances would coincide.
        const std::vector<AffineMap> instances =
            skin ? std::vector<AffineMap>{kIdentityMap} : instances_of(file_, node);
        require_memory("its instances", saturated_product(instances.size(), sizeof(PlacedMesh)),
                       memory_failure(fail_, ""));
        for (const AffineMap& instance : instances) {
          const AffineMap map = instances.size() == 1 && instance == kIdentityMap
                                    ? worlds.back()
                                    : product(worlds.back(), instance);
          placed_meshes_.push_back({*mesh, index, map, unique_names.add(name), skin, weights});
        }
      }
      const GltfValue children = node["children"];
      for (std::size_t k = children.size(); k-- > 0;) {
        open_steps.push_back({static_cast<std::size_t>(children.at(k).count(0)), index});
      }
    }
  }

  static std::vector<double> numbers_of(const GltfValue& list) {
    std::vector<double> result;
    for (std::size_t i = 0; i < list.size(); ++i) result.push_back(list.at(i).number(0));
    return result;
  }

  /// Sizes of a primitive, which are found before its data is read or decompressed.
  struct PrimitiveSize {
    GltfValue primitive;
    std::uint64_t vertices = 0, corners = 0, triangles = 0;
    bool is_packed = false;
  };

  /// A mesh that nodes place.
  struct ScannedMesh {
    std::vector<PrimitiveSize> sizes;
    std::uint64_t placement_count = 0;  ///< Number of nodes and instances that place it
  };

  /// Finds the sizes of those primitives of a mesh that are triangles, and which attributes they
  /// have. Sizes of data compressed by Draco come from its headers.
  std::vector<PrimitiveSize> scan_mesh(const GltfValue& primitives) {
    std::vector<PrimitiveSize> sizes;
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      const GltfValue primitive = primitives.at(i), attributes = primitive["attributes"];
      const std::uint64_t mode = primitive["mode"].count(kTriangles);
      if (mode < kTriangles) continue;
      const auto position = attributes["POSITION"].index_into(file_.list("accessors"));
      if (!position) continue;
      const auto index = primitive["indices"].index_into(file_.list("accessors"));
      const GltfValue packed = primitive["extensions"][kDraco];
      PrimitiveSize size{primitive};
      if (is_packed(packed, *position)) {
        // The counts in the accessors of compressed data may contradict the header of the data, so
        // they are clamped to what the header allows.
        const DracoCounts draco_counts = count_draco(file_, packed);
        size.vertices = std::clamp(file_.list("accessors").at(*position)["count"].count(0),
                                   draco_counts.vertices,
                                   std::max(draco_counts.vertices, 3 * draco_counts.triangles));
        size.triangles = draco_counts.triangles;
        size.corners = 3 * draco_counts.triangles;
        size.is_packed = true;
        if (const auto view = packed["bufferView"].index_into(file_.list("bufferViews"))) {
          ++packed_uses_[*view];
        }
      } else {
        size.vertices = file_.count(*position);
        size.corners = file_.count(index.value_or(*position));
        size.triangles = mode == kTriangles ? size.corners / 3 : size.corners;
      }
      sizes.push_back(size);
      has_colors_ = has_colors_ || attributes["COLOR_0"].exists();
      has_tangents_ = has_tangents_ || attributes["TANGENT"].exists();
      while (attributes[kUvSet + std::to_string(uv_sets_)].exists()) ++uv_sets_;
    }
    return sizes;
  }

  bool is_packed(const GltfValue& packed, std::size_t position) const {
    return packed.exists() &&
           (kReadsDraco || !file_.list("accessors").at(position)["bufferView"].exists());
  }

  /// Finds the sizes and attributes of all meshes that nodes place.
  void scan_meshes() {
    for (const PlacedMesh& placed : placed_meshes_) {
      ScannedMesh& mesh = scanned_[placed.mesh];
      if (mesh.placement_count++ == 0) {
        mesh.sizes = scan_mesh(file_.list("meshes").at(placed.mesh)["primitives"]);
      }
    }
  }

  /// Sizes of a mesh, and the memory that it needs in bytes.
  struct MeshMemory {
    std::uint64_t vertices = 0, triangles = 0, normals = 0;
    std::uint64_t placed = 0;  ///< Memory of the result for each node that places the mesh
    std::uint64_t read = 0;    ///< Memory while the mesh's primitives are cached for the next nodes
    std::uint64_t one_primitive = 0;  ///< Memory while the largest of the mesh's primitives is read
  };

  MeshMemory memory_of(const ScannedMesh& mesh, const PlacedMesh& placed, bool has_uvs) const {
    // Memory that MeshBuilder and the Mesh take at the same time. Per vertex: positions in both
    // precisions, UVs, colours, tangents. Per triangle: three lists of triangles (vertices, UVs,
    // normals), the numbers of object and material, and tangents of corners.
    const std::uint64_t bytes_per_vertex = 36 + (has_uvs ? 8 * (1 + other_sets_.size()) : 0) +
                                           (has_colors_ ? 4 : 0) +
                                           (has_tangents_ ? sizeof(Tangent) : 0);
    const std::uint64_t bytes_per_triangle =
        32 + (has_uvs ? 12 : 0) + (has_uvs && has_tangents_ ? 3 * sizeof(Tangent) : 0);
    // Memory for reading one primitive: its indices as numbers and as integers, the numbers of a
    // morph target, and the transforms by joints.
    constexpr std::uint64_t kIndexBytes = 12, kTargetBytes = 32,
                            kSkinnedBytes = sizeof(MeshTransform);
    MeshMemory memory;
    for (const PrimitiveSize& size : mesh.sizes) {
      const GltfValue attributes = size.primitive["attributes"];
      const bool has_normals = attributes["NORMAL"].exists();
      std::uint64_t numbers_per_vertex = 3;
      Primitive no_data;
      for (const RequestedAttribute& requested :
           requested_attributes(attributes, placed, no_data)) {
        if (!attributes[requested.name].exists()) continue;
        numbers_per_vertex += requested.width == GltfFile::kColor ? 4 : requested.width;
      }
      const std::uint64_t numbers = saturated_product(
          size.vertices, (size.is_packed ? 2 : 1) * sizeof(double) * numbers_per_vertex);
      const std::uint64_t read =
          saturated_sum(numbers, saturated_product(size.triangles, sizeof(Triangle)));
      const std::uint64_t working_memory = saturated_sum(
          saturated_product(size.corners, kIndexBytes),
          saturated_product(size.vertices,
                            (placed.skin ? kSkinnedBytes : 0) +
                                (size.primitive["targets"].size() != 0 ? kTargetBytes : 0)));
      memory.vertices = saturated_sum(memory.vertices, size.vertices);
      memory.triangles = saturated_sum(memory.triangles, size.triangles);
      memory.normals = saturated_sum(memory.normals, has_normals ? size.vertices : size.triangles);
      memory.read = saturated_sum(memory.read, read);
      memory.one_primitive = std::max(memory.one_primitive, saturated_sum(read, working_memory));
      memory.placed = saturated_sum(
          memory.placed, saturated_sum(saturated_product(size.vertices, bytes_per_vertex),
                                       saturated_product(size.triangles, bytes_per_triangle)));
    }
    memory.placed = saturated_sum(memory.placed, saturated_product(memory.normals, sizeof(Vec3)));
    return memory;
  }

  /// Checks that memory suffices for all instances before any is read: any number of primitives and
  /// nodes may refer to the same data, and compressed data may be small. Then reserves the memory.
  void require_memory_of_meshes() {
    const auto names_uvs = [&](const PrimitiveSize& size) {
      const GltfValue attributes = size.primitive["attributes"];
      return attributes[kUvSet + std::to_string(uv_set_)].exists() ||
             std::any_of(other_sets_.begin(), other_sets_.end(), [&](std::uint32_t set) {
               return attributes[kUvSet + std::to_string(set)].exists();
             });
    };
    const bool has_uvs = std::any_of(scanned_.begin(), scanned_.end(), [&](const auto& entry) {
      return std::any_of(entry.second.sizes.begin(), entry.second.sizes.end(), names_uvs);
    });
    std::map<std::pair<std::size_t, bool>, MeshMemory> memory_of_mesh;
    std::uint64_t total_memory = 0, read_memory = 0, vertices = 0, triangles = 0, normals = 0,
                  primitives = 0;
    for (const PlacedMesh& placed : placed_meshes_) {
      const ScannedMesh& mesh = scanned_[placed.mesh];
      const auto [entry, added] =
          memory_of_mesh.try_emplace({placed.mesh, placed.skin.has_value()});
      if (added) entry->second = memory_of(mesh, placed, has_uvs);
      const MeshMemory& memory = entry->second;
      total_memory = saturated_sum(total_memory, memory.placed);
      read_memory = std::max(read_memory, saturated_sum(mesh.placement_count == 1 ? 0 : memory.read,
                                                        memory.one_primitive));
      primitives += mesh.sizes.size();
      vertices = saturated_sum(vertices, memory.vertices);
      triangles = saturated_sum(triangles, memory.triangles);
      normals = saturated_sum(normals, memory.normals);
    }
    require_memory(counted(primitives, "primitive") + ", as often as nodes place " +
                       (primitives == 1 ? "it" : "them") + ", with " +
                       counted(vertices, "vertex", "vertices") + " and " +
                       counted(triangles, "triangle"),
                   saturated_sum(total_memory, read_memory), memory_failure(fail_, "its meshes"));
    const auto reserve = [](auto& list, std::uint64_t count) {
      list.reserve(std::min<std::uint64_t>(count, kMaxVertices));
    };
    builder_.reserve_triangles(triangles, has_uvs);
    reserve(builder_.positions, vertices);
    reserve(builder_.normals, normals);
    if (has_uvs) reserve(builder_.uvs, vertices);
    if (has_colors_) reserve(builder_.colors, vertices);
    if (has_tangents_) reserve(builder_.tangents, vertices);
  }

  void choose_uv_set() {
    const std::string& name = input_.options.uv_set_name;
    uv_set_ = input_.options.uv_set;
    for (std::uint32_t set = 0; set < uv_sets_; ++set) {
      if (name == kUvSet + std::to_string(set)) uv_set_ = set;
    }
    if (name.empty() ? uv_set_ == 0 || uv_set_ < uv_sets_
                     : name == kUvSet + std::to_string(uv_set_) && uv_set_ < uv_sets_) {
      return;
    }
    std::string sets = uv_sets_ == 0 ? "none" : kUvSet + "0";
    if (uv_sets_ > 1) sets += " to " + kUvSet + std::to_string(uv_sets_ - 1);
    input_.fail("",
                "it has no UV set " +
                    (name.empty() ? std::to_string(uv_set_) : "\"" + printable(name) + "\"") +
                    "; its UV sets are " + sets,
                "Choose one of these.");
  }

  GltfNumbers attribute(const GltfValue& attributes, const std::string& name, std::size_t width,
                        std::size_t count) const {
    const GltfValue attribute = attributes[name];
    const auto accessor = attribute.index_into(file_.list("accessors"));
    if (!accessor) return {};
    if (file_.count(*accessor) != count) {
      attribute.fail("it has " + counted(file_.count(*accessor), "element") + ", but there are " +
                     std::to_string(count) + " positions");
    }
    return file_.numbers(*accessor, width);
  }

  std::optional<Primitive> read_primitive(const GltfValue& from, const PlacedMesh& placed) {
    const std::uint64_t mode = from["mode"].count(kTriangles);
    if (mode > kTriangleFan)
      from["mode"].fail("it is " + std::to_string(mode) + ", which is invalid in glTF");
    if (mode < kTriangles) {
      if (non_triangle_primitives_++ == 0) first_non_triangle_ = from.place();
      return std::nullopt;
    }
    const GltfValue attributes = from["attributes"], accessors = file_.list("accessors");
    const auto position = attributes["POSITION"].index_into(accessors);
    if (!position) from.fail("it has no positions");
    const GltfValue packed = from["extensions"][kDraco];
    if (is_packed(packed, *position)) return read_packed(from, packed, placed);
    Primitive result;
    result.positions = file_.numbers(*position, 3);
    const std::size_t count = result.positions.count();
    for (const RequestedAttribute& requested : requested_attributes(attributes, placed, result)) {
      *requested.to = attribute(attributes, requested.name, requested.width, count);
    }
    finish_primitive(from, placed, result);
    std::vector<std::uint32_t> order;
    if (const auto index = from["indices"].index_into(accessors)) {
      order = file_.indices(*index, count);
    } else {
      order.resize(count);
      for (std::size_t i = 0; i < count; ++i) order[i] = static_cast<std::uint32_t>(i);
    }
    add_mode_triangles(mode, order, from, result.triangles);
    return result;
  }

  /// An attribute to read, and the list to which it is read.
  struct RequestedAttribute {
    std::string name;
    std::size_t width;
    GltfNumbers* to;
  };

  /// All attributes to read, except positions.
  std::vector<RequestedAttribute> requested_attributes(const GltfValue& attributes,
                                                       const PlacedMesh& placed,
                                                       Primitive& result) const {
    std::vector<RequestedAttribute> requested = {{"NORMAL", 3, &result.normals},
                                                 {kUvSet + std::to_string(uv_set_), 2, &result.uvs},
                                                 {"COLOR_0", GltfFile::kColor, &result.colors},
                                                 {"TANGENT", 4, &result.tangents}};
    result.other_uvs.resize(other_sets_.size());
    for (std::size_t k = 0; k < other_sets_.size(); ++k) {
      requested.push_back({kUvSet + std::to_string(other_sets_[k]), 2, &result.other_uvs[k]});
    }
    if (!placed.skin) return requested;
    std::size_t sets = 0;
    const auto name = [](const char* of, std::size_t set) { return of + std::to_string(set); };
    for (; attributes[name("JOINTS_", sets)].exists(); ++sets) {
      if (!attributes[name("WEIGHTS_", sets)].exists()) {
        attributes.fail("it has " + name("JOINTS_", sets) + " without weights");
      }
    }
    result.joints.resize(sets);
    result.weights.resize(sets);
    for (std::size_t k = 0; k < sets; ++k) {
      requested.push_back({name("JOINTS_", k), 4, &result.joints[k]});
      requested.push_back({name("WEIGHTS_", k), 4, &result.weights[k]});
    }
    return requested;
  }

  void finish_primitive(const GltfValue& from, const PlacedMesh& placed, Primitive& result) {
    // glTF requires that tangents of a primitive without normals are ignored.
    if (result.normals.values.empty()) result.tangents = {};
    result.place = from.place();
    add_targets(from["targets"], placed.weights, result);
    const auto material = from["material"].index_into(file_.list("materials"));
    result.material = material.value_or(material_names_.size() - 1);
  }

  /// Adds the morph targets, multiplied by their weights.
  void add_targets(const GltfValue& targets, const std::vector<double>& weights,
                   Primitive& result) {
    if (targets.size() == 0) return;
    ++morphed_primitives_;
    const RequestedAttribute target_attributes[] = {
        {"POSITION", 3, &result.positions},
        {"NORMAL", 3, &result.normals},
        // In a morph target, tangents have no fourth number for
        // the sign of the bitangent
        {"TANGENT", 3, &result.tangents},
        {kUvSet + std::to_string(uv_set_), 2, &result.uvs},
        {"COLOR_0", GltfFile::kColor, &result.colors}};
    const std::size_t count = result.positions.count();
    for (std::size_t i = 0; i < std::min(targets.size(), weights.size()); ++i) {
      if (weights[i] == 0) continue;
      const GltfValue target = targets.at(i);
      for (const RequestedAttribute& to : target_attributes) {
        if (to.to->values.empty()) continue;
        add_offsets(attribute(target, to.name, to.width, count), weights[i], *to.to);
      }
      for (std::size_t k = 0; k < other_sets_.size(); ++k) {
        if (result.other_uvs[k].values.empty()) continue;
        add_offsets(attribute(target, kUvSet + std::to_string(other_sets_[k]), 2, count),
                    weights[i], result.other_uvs[k]);
      }
    }
  }

  static void add_offsets(const GltfNumbers& offsets, double weight, GltfNumbers& to) {
    const std::size_t width = std::min(offsets.width, to.width);
    for (std::size_t v = 0; v < offsets.count(); ++v) {
      for (std::size_t k = 0; k < width; ++k) {
        to.values[v * to.width + k] += weight * offsets.at(v)[k];
      }
    }
  }

  Primitive read_packed(const GltfValue& from, const GltfValue& packed, const PlacedMesh& placed) {
    Primitive result;
    const GltfValue plain_attributes = from["attributes"], ids = packed["attributes"];
    std::vector<RequestedAttribute> requested =
        requested_attributes(plain_attributes, placed, result);
    requested.insert(requested.begin(), {"POSITION", 3, &result.positions});
    std::vector<DracoAttribute> attributes;
    std::vector<GltfNumbers*> destinations;
    for (const RequestedAttribute& attribute : requested) {
      const auto accessor = plain_attributes[attribute.name].index_into(file_.list("accessors"));
      if (!accessor || !ids[attribute.name].exists()) continue;
      attributes.push_back({ids[attribute.name].count(0), file_.list("accessors").at(*accessor),
                            attribute.width, attribute.name});
      destinations.push_back(attribute.to);
    }
    if (attributes.empty() || attributes[0].name != "POSITION") {
      packed.fail("its compressed data has no positions");
    }
    const std::shared_ptr<const DracoMesh> mesh = unpack(packed, attributes);
    for (std::size_t i = 0; i < destinations.size(); ++i) *destinations[i] = mesh->attributes[i];
    // Attributes that are not compressed are read from accessors.
    for (const RequestedAttribute& attribute : requested) {
      if (!ids[attribute.name].exists()) {
        *attribute.to =
            this->attribute(plain_attributes, attribute.name, attribute.width, mesh->points);
      }
    }
    finish_primitive(from, placed, result);
    add_mode_triangles(kTriangles, mesh->indices, from, result.triangles);
    return result;
  }

  /// Decompresses a primitive. The result is cached if several primitives use it.
  std::shared_ptr<const DracoMesh> unpack(const GltfValue& packed,
                                          const std::vector<DracoAttribute>& attributes) {
    std::string key = packed["bufferView"].dump();
    for (const DracoAttribute& attribute : attributes) {
      key += " " + std::to_string(attribute.id) + "/" + attribute.accessor.place();
    }
    if (const auto known = unpacked_.find(key); known != unpacked_.end()) return known->second;
    const auto mesh = std::make_shared<const DracoMesh>(unpack_draco(file_, packed, attributes));
    const auto view = packed["bufferView"].index_into(file_.list("bufferViews"));
    if (view && packed_uses_[*view] > 1) unpacked_.emplace(key, mesh);
    return mesh;
  }

  void add_mode_triangles(std::uint64_t mode, const std::vector<std::uint32_t>& order,
                          const GltfValue& from, std::vector<Triangle>& triangles) {
    const std::size_t n = order.size();
    if (mode == kTriangles) {
      if (n % 3 != 0 && incomplete_primitives_++ == 0) first_incomplete_ = from.place();
      for (std::size_t i = 0; i + 2 < n; i += 3)
        triangles.push_back({order[i], order[i + 1], order[i + 2]});
      return;
    }
    for (std::size_t i = 0; i + 2 < n; ++i) {
      const Triangle t = mode == kTriangleFan ? Triangle{order[i + 1], order[i + 2], order[0]}
                         : i % 2 == 0         ? Triangle{order[i], order[i + 1], order[i + 2]}
                                              : Triangle{order[i], order[i + 2], order[i + 1]};
      // A strip may contain degenerate triangles, which only serve to change its direction.
      if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles.push_back(t);
    }
  }

  /// The primitives of a mesh, for a node that places it. They are cached for the next nodes with
  /// the same mesh.
  const std::vector<Primitive>& primitives_of(const PlacedMesh& placed) {
    const bool skinned = placed.skin.has_value();
    if (last_instance_ && last_instance_->mesh == placed.mesh &&
        last_instance_->skinned == skinned && last_instance_->weights == placed.weights) {
      return last_instance_->primitives;
    }
    last_instance_ = CachedPrimitives{placed.mesh, skinned, placed.weights, {}};
    const GltfValue primitives = file_.list("meshes").at(placed.mesh)["primitives"];
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      std::optional<Primitive> primitive = read_primitive(primitives.at(i), placed);
      if (primitive && !primitive->triangles.empty()) {
        last_instance_->primitives.push_back(std::move(*primitive));
      }
    }
    return last_instance_->primitives;
  }

  void add(const PlacedMesh& placed, Asset& asset) {
    bool named = false;
    const auto add_primitive = [&](const Primitive& primitive) {
      if (!named) {
        builder_.set_object(placed.name);
        asset.object_nodes.push_back(placed.node);
        named = true;
      }
      builder_.set_material(material_names_[primitive.material]);
      add(primitive, placed);
    };
    if (scanned_[placed.mesh].placement_count > 1) {
      for (const Primitive& primitive : primitives_of(placed)) add_primitive(primitive);
      return;
    }
    const GltfValue primitives = file_.list("meshes").at(placed.mesh)["primitives"];
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      const std::optional<Primitive> primitive = read_primitive(primitives.at(i), placed);
      if (primitive && !primitive->triangles.empty()) add_primitive(*primitive);
    }
  }

  /// Transforms of a primitive's vertices to world space: the same one for all, or one for each.
  struct VertexTransforms {
    MeshTransform node;
    std::vector<MeshTransform> per_vertex;  // One transform for each vertex if the mesh is skinned

    const MeshTransform& of(std::size_t vertex) const {
      return per_vertex.empty() ? node : per_vertex[vertex];
    }
    /// True if a triangle is mirrored, which the majority of its corners decides.
    bool mirrors(const Triangle& t) const {
      return int{of(t[0]).mirrors()} + int{of(t[1]).mirrors()} + int{of(t[2]).mirrors()} >= 2;
    }
  };

  VertexTransforms vertex_transforms_of(const Primitive& p, const PlacedMesh& placed) {
    VertexTransforms vertex_transforms{MeshTransform(placed.matrix), {}};
    if (!placed.skin || p.joints.empty()) return vertex_transforms;
    ++skinned_primitives_;
    const GltfJoints& joints = worlds_->joints(*placed.skin);
    const GltfValue attributes(input_, nullptr, p.place + ".attributes");
    const GltfInfluences influences = influences_of(attributes, p.joints, p.weights, joints.size());
    vertex_transforms.per_vertex.reserve(p.positions.count());
    for (std::size_t v = 0; v < p.positions.count(); ++v) {
      const std::optional<AffineMap> map = influences.map_of(joints, v);
      if (!map && unweighted_vertices_++ == 0) first_unweighted_ = p.place;
      vertex_transforms.per_vertex.push_back(map ? MeshTransform(*map) : vertex_transforms.node);
    }
    return vertex_transforms;
  }

  Vec2 uv_of(const GltfNumbers& uvs, std::size_t vertex) const {
    if (uvs.values.empty()) {
      constexpr float kMissingUv = std::numeric_limits<float>::quiet_NaN();
      return {kMissingUv, kMissingUv};
    }
    return {narrow(uvs.at(vertex)[0]), narrow(1 - uvs.at(vertex)[1])};
  }

  void add(const Primitive& p, const PlacedMesh& placed) {
    const std::size_t count = p.positions.count();
    if (builder_.positions.size() + count > kMaxVertices) {
      input_.fail("", "its instances have more than 2147483647 vertices",
                  "Split or simplify the mesh.");
    }
    const VertexTransforms vertex_transforms = vertex_transforms_of(p, placed);
    const auto first = static_cast<std::uint32_t>(builder_.positions.size());
    const auto first_uv = static_cast<std::uint32_t>(builder_.uvs.size());
    const auto first_normal = static_cast<std::uint32_t>(builder_.normals.size());
    const bool has_normals = !p.normals.values.empty();
    const auto has_values = [](const GltfNumbers& uvs) { return !uvs.values.empty(); };
    const bool has_uvs =
        has_values(p.uvs) || std::any_of(p.other_uvs.begin(), p.other_uvs.end(), has_values);
    const std::optional<UvMap> uv_map =
        p.material < uv_maps_.size() ? uv_maps_[p.material] : std::nullopt;
    for (std::size_t i = 0; i < count; ++i) {
      const MeshTransform& vertex_transform = vertex_transforms.of(i);
      builder_.positions.push_back(vertex_transform.transform_position(p.positions.at(i)));
      if (has_normals) {
        const double* const n = p.normals.at(i);
        builder_.normals.push_back(vertex_transform.normal({n[0], n[1], n[2]}));
      }
      if (has_uvs) {
        if (uv_map && has_values(p.uvs)) {
          const std::array<double, 2> uv = uv_map->at(p.uvs.at(i)[0], p.uvs.at(i)[1]);
          builder_.uvs.push_back({narrow(uv[0]), narrow(1 - uv[1])});
        } else {
          builder_.uvs.push_back(uv_of(p.uvs, i));
        }
        for (std::size_t k = 0; k < p.other_uvs.size(); ++k) {
          builder_.other_uvs[k].uvs.push_back(uv_of(p.other_uvs[k], i));
        }
      }
      if (has_colors_) add_color(p.colors, i);
      if (has_tangents_) add_tangent(p.tangents, i, vertex_transform);
    }
    constexpr std::span<const std::uint32_t> no_indices;
    for (Triangle t : p.triangles) {
      if (vertex_transforms.mirrors(t)) std::swap(t[1], t[2]);
      Triangle corners{}, uv{}, normal{};
      for (std::size_t k = 0; k < 3; ++k) {
        corners[k] = first + t[k];
        uv[k] = first_uv + t[k];
        normal[k] = first_normal + t[k];
      }
      if (!has_normals) normal.fill(add_flat_normal(corners));
      builder_.add_face(corners, has_uvs ? std::span<const std::uint32_t>(uv) : no_indices, normal);
    }
  }

  /// glTF requires that triangles without normals are flat-shaded.
  std::uint32_t add_flat_normal(const Triangle& corners) {
    const auto at = [&](std::size_t k) {
      const MeshBuilder::Position& p = builder_.positions[corners[k]];
      return Vec3d(p[0], p[1], p[2]);
    };
    const Vec3d n = cross(at(1) - at(0), at(2) - at(0));
    const double size = length(n);
    builder_.normals.push_back(size > 0 && std::isfinite(size) ? to_float(n * (1 / size)) : Vec3{});
    ++flat_triangles_;
    return static_cast<std::uint32_t>(builder_.normals.size() - 1);
  }

  /// Colours of vertices are linear in glTF, but sRGB in Mesh.
  void add_color(const GltfNumbers& colors, std::size_t vertex) {
    std::array<std::uint8_t, 4> bytes{255, 255, 255, 255};
    if (!colors.values.empty()) {
      const double* const c = colors.at(vertex);
      for (std::size_t k = 0; k < colors.width; ++k) {
        const float value =
            k < 3 ? to_srgb(narrow(c[k])) : static_cast<float>(std::clamp(c[k], 0.0, 1.0));
        bytes[k] = static_cast<std::uint8_t>(std::lround(std::isfinite(value) ? value * 255 : 0));
        if (c[k] > 1) ++clamped_channels_;
      }
    }
    builder_.colors.push_back(bytes);
  }

  void add_tangent(const GltfNumbers& tangents, std::size_t vertex,
                   const MeshTransform& vertex_transform) {
    if (tangents.values.empty()) {
      builder_.tangents.push_back({});
      return;
    }
    const double* const t = tangents.at(vertex);
    const double sign = vertex_transform.mirrors() ? -t[3] : t[3];
    builder_.tangents.push_back({vertex_transform.tangent(t), narrow(sign)});
  }

  void warn() const {
    const auto warn_count = [this](std::uint64_t count, const char* code, const std::string& text) {
      if (count != 0) input_.warn(code, text, count);
    };
    warn_count(non_triangle_primitives_, "ignored-primitives",
               counted(non_triangle_primitives_, "primitive") + " of points or lines (" +
                   first_non_triangle_ + " for example) were left out, since they are no surface.");
    warn_count(incomplete_primitives_, "short-faces",
               counted(incomplete_primitives_, "primitive") + " (" + first_incomplete_ +
                   " for example) with an incomplete triangle at the end, which was ignored.");
    warn_count(flat_triangles_, "flat-normals",
               counted(flat_triangles_, "triangle") +
                   " without normals: they are flat-shaded, as glTF requires.");
    warn_count(skinned_primitives_, "rest-pose",
               counted(skinned_primitives_, "skinned primitive") +
                   ": read in the rest pose, from the nodes of the joints. Maps are valid in every "
                   "pose, but "
                   "files that Kiln writes have no skin.");
    warn_count(
        unweighted_vertices_, "unweighted-vertices",
        counted(unweighted_vertices_, "vertex of a skin", "vertices of skins") + " (in " +
            first_unweighted_ +
            " for one) without weights: transformed by the mesh's node instead of the skin.");
    warn_count(morphed_primitives_, "rest-pose",
               counted(morphed_primitives_, "primitive") +
                   " with morph targets: read with the targets' default weights.");
    warn_count(nested_scene_nodes_, "scene-child",
               counted(nested_scene_nodes_, "node", "nodes") + " of its scene (" +
                   first_nested_node_ + " for one) " +
                   (nested_scene_nodes_ == 1 ? "is a child of another" : "are children of others") +
                   " that the scene lists as well: each is read once, below its parent.");
    warn_count(clamped_channels_, "bright-colors",
               counted(clamped_channels_, "channel") + " of vertex colours above 1: clamped to 1.");
  }

  [[noreturn]] void fail_empty() const {
    const std::size_t meshes = file_.list("meshes").size();
    if (placed_meshes_.empty() && meshes != 0) {
      input_.fail("scenes",
                  "no node of its scene uses any of its " + counted(meshes, "mesh", "meshes"),
                  "Put the mesh into the scene, and export it again.");
    }
    input_.fail("", meshes == 0 ? "it has no meshes" : "its meshes have no triangles",
                "Kiln needs a surface: export triangles.");
  }

  const MeshInput& input_;
  const GltfFile file_;
  const WorldFrame world_ = world_frame(input_.options, kIdentityMap, 1);
  MeshBuilder builder_;
  const std::vector<std::string> material_names_;
  const FailWith fail_ = [this](const std::string& place, const std::string& problem,
                                const Message& remedy) { input_.fail(place, problem, remedy); };
  std::optional<GltfWorlds> worlds_;
  std::vector<std::optional<UvMap>> uv_maps_;  // UV transform of each material
  std::vector<std::uint32_t> other_sets_;      // UV sets that materials use besides the chosen one
  // Number of primitives that use each compressed buffer view
  std::map<std::size_t, std::uint64_t> packed_uses_;
  std::map<std::string, std::shared_ptr<const DracoMesh>> unpacked_;
  // Primitives of the last instance that was read.
  struct CachedPrimitives {
    std::size_t mesh = 0;
    bool skinned = false;
    std::vector<double> weights;
    std::vector<Primitive> primitives;
  };
  std::optional<CachedPrimitives> last_instance_;
  std::vector<PlacedMesh> placed_meshes_;
  std::map<std::size_t, ScannedMesh> scanned_;
  std::uint32_t uv_sets_ = 0, uv_set_ = 0;  // Number of UV sets, and index of the chosen one
  bool has_colors_ = false, has_tangents_ = false;
  std::uint64_t flat_triangles_ = 0, non_triangle_primitives_ = 0, incomplete_primitives_ = 0,
                skinned_primitives_ = 0, unweighted_vertices_ = 0, morphed_primitives_ = 0,
                nested_scene_nodes_ = 0, clamped_channels_ = 0;
  std::string first_non_triangle_, first_incomplete_, first_unweighted_, first_nested_node_;
};

}  // namespace

Asset read_gltf(const MeshInput& input, bool materials) {
  return GltfReader(input).read(materials);
}

}  // namespace kiln
