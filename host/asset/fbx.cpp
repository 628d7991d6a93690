#include "asset/fbx.h"

#ifndef KILN_HAS_UFBX
namespace kiln {

Asset read_fbx(const MeshInput& input) {
  input.fail("", "this build of Kiln does not include ufbx, which reads FBX",
             "Export the mesh as glTF or OBJ, or run tools/install-packages and build again.");
}

}  // namespace kiln
#else

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "asset/axes.h"
#include "asset/fbx_library.h"
#include "asset/fbx_mesh.h"
#include "asset/fbx_smoothing.h"
#include "asset/hierarchy.h"
#include "asset/mesh_builder.h"
#include "asset/scene_parts.h"
#include "base/counted.h"
#include "base/option.h"
#include "io/file/bounds.h"
#include "io/file/text_scanner.h"
#include "kiln/limits.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

const std::string kExportAgain = "Export the mesh again, or as OBJ or glTF.";

std::string text_of(const ufbx_string& text) { return {text.data, text.length}; }

/// Makes a message of ufbx printable, since it may quote bytes of the file.
std::string printable_text(const ufbx_string& text) {
  std::string result = text_of(text);
  std::replace_if(
      result.begin(), result.end(), [](unsigned char c) { return c < 32 || c > 126; }, '?');
  return result;
}

struct FreeScene {
  void operator()(ufbx_scene* scene) const { fbx_free_scene(scene); }
};
using LoadedScene = std::unique_ptr<ufbx_scene, FreeScene>;

/// Allocates by the program's operator new, so that its memory limit applies.
void* allocate(void* /*user*/, std::size_t size) { return ::operator new(size, std::nothrow); }
void free_block(void* /*user*/, void* block, std::size_t /*size*/) { ::operator delete(block); }

/// Loads the scene by ufbx. \throws Error(input), std::bad_alloc
LoadedScene load(const MeshInput& input) {
  // Limit on ufbx's memory. Deflate expands by at most a factor of a thousand, and real files by
  // less than a hundred.
  const std::uint64_t max_bytes = std::min<std::uint64_t>(
      memory_left(), (std::uint64_t{1} << 30U) + 200 * std::uint64_t{input.bytes.size()});
  ufbx_load_opts options = {};
  options.temp_allocator.allocator.alloc_fn = allocate;
  options.temp_allocator.allocator.free_fn = free_block;
  options.temp_allocator.memory_limit = std::max<std::uint64_t>(max_bytes, 1);
  options.result_allocator = options.temp_allocator;
  options.ignore_animation = true;
  options.load_external_files = false;
  options.skip_mesh_parts = true;
  options.clean_skin_weights = true;
  options.use_blender_pbr_material = true;
  options.file_format = UFBX_FILE_FORMAT_FBX;
  options.index_error_handling = UFBX_INDEX_ERROR_HANDLING_NO_INDEX;
  // Faces without triangles are kept, so that they are reported, and since smoothing groups are
  // indexed by face
  options.allow_empty_faces = true;
  ufbx_error error = {};
  LoadedScene scene(fbx_load_memory(input.bytes.data(), input.bytes.size(), options, error));
  if (scene != nullptr) return scene;
  if (error.type == UFBX_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  if (error.type == UFBX_ERROR_MEMORY_LIMIT) {
    input.fail("", "reading it needs more than " + format_mebibytes(max_bytes) + " of memory",
               "Free some memory, raise the " + option("memory_limit") + ", or split the file.");
  }
  if (error.type == UFBX_ERROR_UNKNOWN) {
    input.fail("", "it is truncated or damaged, or a face refers to a vertex that does not exist",
               kExportAgain);
  }
  std::string reason = printable_text(error.description);
  if (error.info_length != 0)
    reason += " (" + printable_text({error.info, error.info_length}) + ")";
  input.fail("", "it cannot be read as FBX: " + (reason.empty() ? "it is damaged" : reason),
             kExportAgain);
}

class FbxReader {
 public:
  FbxReader(const MeshInput& input, const ufbx_scene& scene)
      : input_(input), scene_(scene), builder_(input), uv_sets_(input), pictures_(input) {}

  Asset read() {
    warn_of_repairs();
    const WorldFrame world = world_frame(input_.options, axis_rotation(), metres());
    to_world_ = world.map.value_or(kIdentityMap);
    add_nodes();
    check_memory();
    number_uv_sets();
    for (const PlacedMesh& placed : placed_meshes_) add(placed);
    uv_sets_.check();
    builder_.is_placed = true;
    asset_.mesh = builder_.finish();
    materials();
    asset_.mesh.metres = world.metres;
    asset_.mesh.uv_set = uv_sets_.chosen();
    pictures_.warn();
    warn();
    return std::move(asset_);
  }

 private:
  struct PlacedMesh {
    const ufbx_node* node;
    const ufbx_mesh* mesh;
    std::string object;
  };

  /// The rotation from the file's axes to X, Y and Z. The "front" axis of FBX points at the viewer.
  AffineMap axis_rotation() const {
    constexpr const char* kAxisProperties[] = {"CoordAxis", "UpAxis", "FrontAxis"};
    const ufbx_props& settings = scene_.settings.props;
    AffineMap map{};
    std::array<std::int64_t, 3> axes{};
    bool is_odd = false;
    for (std::size_t k = 0; k < 3; ++k) {
      axes[k] = fbx_find_int(settings, kAxisProperties[k], static_cast<std::int64_t>(k));
      const std::int64_t sign =
          fbx_find_int(settings, (std::string(kAxisProperties[k]) + "Sign").c_str(), 1);
      is_odd = is_odd || axes[k] < 0 || axes[k] > 2 || (sign != 1 && sign != -1);
      if (!is_odd) map[4 * static_cast<std::size_t>(axes[k]) + k] = static_cast<double>(sign);
    }
    if (is_odd || axes[0] == axes[1] || axes[1] == axes[2] || axes[2] == axes[0]) {
      input_.warn(
          "odd-axes",
          "its axis settings are invalid, so it was not rotated. Specify the up axis, such as " +
              option("up", "high=z") + ".",
          1);
      return kIdentityMap;
    }
    map[15] = 1;
    return map;
  }

  /// The default unit of FBX is a centimetre.
  double metres() const {
    const double centimetres = fbx_find_real(scene_.settings.props, "UnitScaleFactor", 1);
    return centimetres > 0 && std::isfinite(centimetres) ? centimetres / 100 : 0;
  }

  /// Adds the nodes in the order of the file, parents before children.
  void add_nodes() {
    struct Visit {
      const ufbx_node* node;
      std::uint32_t parent;
    };
    std::vector<Visit> open = {{scene_.root_node, AssetNode::kNone}};
    while (!open.empty()) {
      const auto [from, parent] = open.back();
      open.pop_back();
      const auto index = static_cast<std::uint32_t>(asset_.nodes.size());
      AssetNode& node = asset_.nodes.emplace_back();
      node.name = from->is_root ? "RootNode" : text_of(from->name);
      node.parent = parent;
      node.transform = compute_transform_to_parent(*from);
      for (const ufbx_element* attribute : from->all_attribs)
        add_attribute(*from, *attribute, index);
      for (std::size_t i = from->children.count; i-- > 0;) {
        open.push_back({from->children.data[i], index});
      }
    }
  }

  /// The transform of a node to its parent. It is computed such that the product of these along the
  /// hierarchy is the node's world transform in every mode of scale inheritance.
  AffineMap compute_transform_to_parent(const ufbx_node& node) const {
    if (node.parent == nullptr) return product(to_world_, fbx_map(node.node_to_world));
    if (node.inherit_mode == UFBX_INHERIT_MODE_NORMAL) return fbx_map(node.node_to_parent);
    const AffineMap map =
        product(fbx_map(fbx_inverse(node.parent->node_to_world)), fbx_map(node.node_to_world));
    return std::all_of(map.begin(), map.end(), [](double value) { return std::isfinite(value); })
               ? map
               : fbx_map(node.node_to_parent);
  }

  void add_attribute(const ufbx_node& node, const ufbx_element& attribute, std::uint32_t index) {
    switch (attribute.type) {
      case UFBX_ELEMENT_MESH:
        break;
      case UFBX_ELEMENT_NURBS_CURVE:
      case UFBX_ELEMENT_NURBS_SURFACE:
      case UFBX_ELEMENT_NURBS_TRIM_SURFACE:
      case UFBX_ELEMENT_PROCEDURAL_GEOMETRY:
        curve_nodes_.add(text_of(node.name));
        return;
      case UFBX_ELEMENT_LOD_GROUP:
        lod_nodes_.add(text_of(node.name));
        return;
      default:
        return;
    }
    const auto& mesh = reinterpret_cast<const ufbx_mesh&>(attribute);
    if (mesh.num_faces == 0 || mesh.vertices.count == 0) return;
    if (mesh.skin_deformers.count > 1 || mesh.cache_deformers.count != 0) {
      deformed_meshes_.add(text_of(node.name));
    }
    if (!node.visible) hidden_meshes_.add(text_of(node.name));
    if (mesh.subdivision_display_mode != UFBX_SUBDIVISION_DISPLAY_DISABLED &&
        std::max(mesh.subdivision_preview_levels, mesh.subdivision_render_levels) != 0) {
      subdivided_meshes_.add(text_of(node.name));
    }
    placed_meshes_.push_back(
        {&node, &mesh, objects_.add(node.name.length == 0 ? "object" : text_of(node.name))});
    asset_.object_nodes.push_back(index);
  }

  /// Checks that memory suffices for all instances, since any number of nodes may refer to one
  /// mesh. The numbers of bytes are those by which the peak of reading grows with each corner of an
  /// instance (means of 31 to 91 instances of grids).
  void check_memory() const {
    constexpr std::uint64_t kVertexBytes = 72, kCornerBytes = 20;
    constexpr std::uint64_t kPolygonBytes = 24, kNormalBytes = 24, kColorBytes = 42;
    std::uint64_t vertices = 0, bytes = 0;
    for (const PlacedMesh& placed : placed_meshes_) {
      const ufbx_mesh& mesh = *placed.mesh;
      const bool has_normals = mesh.vertex_normal.exists || mesh.face_smoothing.count != 0 ||
                               mesh.edge_smoothing.count != 0;
      const std::uint64_t corner_bytes =
          kCornerBytes + (mesh.num_triangles > mesh.num_faces ? kPolygonBytes : 0) +
          (has_normals ? kNormalBytes : 0) + (mesh.vertex_color.exists ? kColorBytes : 0);
      vertices += mesh.num_vertices;
      bytes += saturated_product(mesh.num_indices, corner_bytes);
    }
    const FailWith fail = [this](const std::string& place, const std::string& problem,
                                 const Message& remedy) { input_.fail(place, problem, remedy); };
    require_memory("its meshes, counted once per instance,",
                   std::max(saturated_product(vertices, kVertexBytes), bytes),
                   memory_failure(fail, ""));
  }

  void add(const PlacedMesh& placed) {
    const ufbx_mesh& mesh = *placed.mesh;
    builder_.set_object(placed.object);
    const std::vector<std::string> names = uv_set_names(mesh);
    const MeshUvs& uvs = uvs_of(mesh, uv_sets_.choose(names));
    const FbxPose pose(*placed.node, mesh, to_world_);
    const std::vector<std::uint32_t> normal_of = normals(mesh, pose);
    // Index of the builder's vertex for each pair of vertex and colour
    std::unordered_map<std::uint64_t, std::uint32_t> vertex_of;
    std::vector<std::uint32_t> corners, corner_uvs, corner_normals;
    for (std::size_t f = 0; f < mesh.faces.count; ++f) {
      const ufbx_face face = mesh.faces.data[f];
      if (f < mesh.face_hole.count && mesh.face_hole.data[f]) {
        ++hole_faces_;
        continue;
      }
      builder_.set_material(material_name(placed, f));
      corners.clear();
      corner_uvs.clear();
      corner_normals.clear();
      bool mirrored = false;
      for (std::uint32_t i = 0; i < face.num_indices; ++i) {
        const std::uint32_t corner = face.index_begin + i;
        const std::uint32_t vertex = mesh.vertex_indices.data[corner];
        if (vertex >= mesh.vertices.count) {
          input_.fail("mesh \"" + printable(placed.object) + "\", face " + std::to_string(f),
                      "a corner refers to a vertex beyond the mesh's " +
                          std::to_string(mesh.vertices.count),
                      kExportAgain);
        }
        if (i == 0) mirrored = pose.mirrors(vertex);
        corners.push_back(vertex_at(mesh, pose, corner, vertex, vertex_of));
        corner_uvs.push_back(uvs.at(corner));
        corner_normals.push_back(normal_of.empty() ? MeshBuilder::kNone : normal_of[corner]);
      }
      using Indices = std::span<const std::uint32_t>;
      builder_.add_face(corners, uvs.has_uvs ? Indices(corner_uvs) : Indices(),
                        normal_of.empty() ? Indices() : Indices(corner_normals), mirrored);
    }
  }

  /// Indices of the builder's UVs at the corners of a mesh; all instances of the mesh share them.
  struct MeshUvs {
    bool has_uvs = false;
    std::uint32_t first = 0;  // Index of the chosen set's first UV among the UVs of the builder
    // The UVs of the chosen set; used if all pictures refer to this set
    const ufbx_vertex_vec2* chosen_uvs = nullptr;
    // UVs of several sets; used if a picture refers to a set other than the chosen one
    std::vector<std::uint32_t> uv_of_corner;

    std::uint32_t at(std::size_t corner) const {
      if (!uv_of_corner.empty()) return uv_of_corner[corner];
      const std::uint32_t uv =
          chosen_uvs == nullptr ? UFBX_NO_INDEX : chosen_uvs->indices.data[corner];
      return uv == UFBX_NO_INDEX ? MeshBuilder::kNone : first + uv;
    }
  };

  static std::vector<std::string> uv_set_names(const ufbx_mesh& mesh) {
    std::vector<std::string> names;
    for (const ufbx_uv_set& set : mesh.uv_sets) names.push_back(text_of(set.name));
    return names;
  }

  /// Index in a mesh of the UV set that a picture names; that of the first set if the mesh has none
  /// of this name.
  static std::uint32_t uv_set_named(const ufbx_mesh& mesh, const std::string& name) {
    const std::vector<std::string> names = uv_set_names(mesh);
    const auto found = std::find(names.begin(), names.end(), name);
    return found == names.end() ? 0 : static_cast<std::uint32_t>(found - names.begin());
  }

  static const ufbx_texture* file_of(const ufbx_texture* texture) {
    if (texture == nullptr || texture->file_textures.count == 0) return nullptr;
    return texture->file_textures.data[0];
  }

  /// Assigns numbers to the UV sets that pictures use, except for the set with which the mesh is
  /// read. FBX names its sets, and a name may have different indices in different meshes. The
  /// number of a set is its index in the first mesh that has it, or an unused number if that one is
  /// taken.
  void number_uv_sets() {
    std::uint32_t next_free_number = 0;
    std::optional<std::uint32_t> read;
    for (const PlacedMesh& placed : placed_meshes_) {
      const std::optional<std::uint32_t> chosen_set = uv_sets_.find(uv_set_names(*placed.mesh));
      if (!read) read = chosen_set;
      next_free_number =
          std::max(next_free_number, static_cast<std::uint32_t>(placed.mesh->uv_sets.count));
      add_material_users(placed);
    }
    read_set_ = read.value_or(0);
    std::set<std::uint32_t> used_numbers = {read_set_};
    for (const PlacedMesh& placed : placed_meshes_) {
      for (const ufbx_material* material : materials_of(placed)) {
        if (material == nullptr) continue;
        for (const ufbx_material_texture& texture_use : material->textures) {
          const ufbx_texture* const texture = file_of(texture_use.texture);
          if (texture == nullptr) continue;
          const std::string name = text_of(texture->uv_set);
          if (set_numbers_.contains(name) || !uses_other_set(*material, name)) continue;
          std::uint32_t number = uv_set_of(*material, name);
          if (!used_numbers.insert(number).second) used_numbers.insert(number = next_free_number++);
          set_numbers_[name] = number;
          other_sets_.push_back(name);
          builder_.other_uvs.push_back({number, {}});
        }
      }
    }
  }

  static const ufbx_material_list& materials_of(const PlacedMesh& placed) {
    return placed.node->materials.count != 0 ? placed.node->materials : placed.mesh->materials;
  }

  void add_material_users(const PlacedMesh& placed) {
    const ufbx_mesh& mesh = *placed.mesh;
    const ufbx_material_list& list = materials_of(placed);
    std::vector<bool> is_set_used(list.count);
    for (std::size_t f = 0; f < mesh.faces.count; ++f) {
      const std::uint32_t index = f < mesh.face_material.count ? mesh.face_material.data[f] : 0;
      if (index < is_set_used.size()) is_set_used[index] = true;
    }
    for (std::size_t i = 0; i < is_set_used.size(); ++i) {
      if (!is_set_used[i]) continue;
      std::vector<const ufbx_mesh*>& meshes = meshes_of_[list.data[i]];
      if (std::find(meshes.begin(), meshes.end(), &mesh) == meshes.end()) meshes.push_back(&mesh);
    }
  }

  /// True if some mesh has pictures of this material on a UV set (with this name) that is not the
  /// one with which the mesh is read.
  bool uses_other_set(const ufbx_material& material, const std::string& name) const {
    const auto meshes = meshes_of_.find(&material);
    return meshes != meshes_of_.end() &&
           std::any_of(meshes->second.begin(), meshes->second.end(), [&](const ufbx_mesh* mesh) {
             return mesh->uv_sets.count != 0 &&
                    uv_sets_.find(uv_set_names(*mesh)) != uv_set_named(*mesh, name);
           });
  }

  const MeshUvs& uvs_of(const ufbx_mesh& mesh, std::optional<std::uint32_t> set) {
    const auto [entry, added] = uvs_.try_emplace(&mesh);
    MeshUvs& uvs = entry->second;
    if (!added) return uvs;
    uvs.has_uvs = set.has_value() || (!other_sets_.empty() && mesh.uv_sets.count != 0);
    if (!uvs.has_uvs) return uvs;
    uvs.first = static_cast<std::uint32_t>(builder_.uvs.size());
    if (other_sets_.empty()) {
      uvs.chosen_uvs = &mesh.uv_sets.data[*set].vertex_uv;
      for (const ufbx_vec2& uv : uvs.chosen_uvs->values) {
        builder_.uvs.push_back({narrow(uv.x), narrow(uv.y)});
      }
      return uvs;
    }
    // The UV sets of a mesh. Each combination of their values at a corner becomes one UV of the
    // builder.
    std::vector<const ufbx_vertex_vec2*> sets;
    sets.push_back(set ? &mesh.uv_sets.data[*set].vertex_uv : nullptr);
    for (const std::string& name : other_sets_) {
      sets.push_back(&mesh.uv_sets.data[uv_set_named(mesh, name)].vertex_uv);
    }
    std::map<std::vector<std::uint32_t>, std::uint32_t> uv_of_key;
    std::vector<std::uint32_t> key(sets.size());
    for (std::size_t corner = 0; corner < mesh.num_indices; ++corner) {
      for (std::size_t k = 0; k < sets.size(); ++k) {
        key[k] = sets[k] == nullptr ? UFBX_NO_INDEX : sets[k]->indices.data[corner];
      }
      if (std::all_of(key.begin(), key.end(), [](auto uv) { return uv == UFBX_NO_INDEX; })) {
        uvs.uv_of_corner.push_back(MeshBuilder::kNone);
        continue;
      }
      const auto [vertex_at, is_new] =
          uv_of_key.emplace(key, static_cast<std::uint32_t>(builder_.uvs.size()));
      uvs.uv_of_corner.push_back(vertex_at->second);
      for (std::size_t k = 0; is_new && k < sets.size(); ++k) {
        constexpr float kMissingUv = std::numeric_limits<float>::quiet_NaN();
        Vec2 uv{kMissingUv, kMissingUv};
        if (key[k] != UFBX_NO_INDEX) {
          const ufbx_vec2& value = sets[k]->values.data[key[k]];
          uv = {narrow(value.x), narrow(value.y)};
        }
        (k == 0 ? builder_.uvs : builder_.other_uvs[k - 1].uvs).push_back(uv);
      }
    }
    return uvs;
  }

  /// Index of the builder's vertex at a corner. There is one for each pair of vertex and colour.
  std::uint32_t vertex_at(const ufbx_mesh& mesh, const FbxPose& pose, std::uint32_t corner,
                          std::uint32_t vertex,
                          std::unordered_map<std::uint64_t, std::uint32_t>& vertex_of) {
    std::array<std::uint8_t, 4> color{255, 255, 255, 255};
    std::uint64_t key = vertex;
    if (mesh.vertex_color.exists) {
      const std::uint32_t index = mesh.vertex_color.indices.data[corner];
      if (index != UFBX_NO_INDEX) {
        const ufbx_vec4& value = mesh.vertex_color.values.data[index];
        const std::array<double, 4> channels{value.x, value.y, value.z, value.w};
        for (std::size_t k = 0; k < 4; ++k) {
          const double channel = channels[k] > 0 ? std::min(channels[k], 1.0) : 0;
          color[k] = static_cast<std::uint8_t>(std::lround(channel * 255));
        }
      }
      std::uint32_t bits = 0;
      std::memcpy(&bits, color.data(), 4);
      key |= std::uint64_t{bits} << 32U;
    }
    const auto [entry, added] =
        vertex_of.emplace(key, static_cast<std::uint32_t>(builder_.positions.size()));
    if (!added) return entry->second;
    builder_.positions.push_back(pose.world_position(vertex));
    if (mesh.vertex_color.exists) builder_.set_color_bytes(builder_.positions.size() - 1, color);
    return entry->second;
  }

  /// Index of the builder's normal at each corner. Normals are those of the file, transformed by
  /// the pose, or computed from smoothing groups. Empty if the mesh has neither.
  std::vector<std::uint32_t> normals(const ufbx_mesh& mesh, const FbxPose& pose) {
    std::vector<std::uint32_t> result;
    if (mesh.vertex_normal.exists) {
      result.resize(mesh.num_indices, MeshBuilder::kNone);
      const std::vector<ufbx_vec3> morphed = morphed_normals(mesh, pose);
      // If each vertex has its own transform, the vertex is part of the key.
      std::unordered_map<std::uint64_t, std::uint32_t> normal_of_key;
      for (std::size_t corner = 0; corner < mesh.num_indices; ++corner) {
        const std::uint32_t vertex = mesh.vertex_indices.data[corner];
        const std::uint32_t index = mesh.vertex_normal.indices.data[corner];
        if (index == UFBX_NO_INDEX || vertex >= mesh.vertices.count) continue;
        if (!morphed.empty()) {
          result[corner] = static_cast<std::uint32_t>(builder_.normals.size());
          builder_.normals.push_back(pose.normal(vertex, morphed[corner]));
          continue;
        }
        const std::uint64_t of_vertex = pose.is_skinned() ? vertex + std::uint64_t{1} : 0;
        const auto [entry, added] = normal_of_key.emplace(
            (of_vertex << 32U) | index, static_cast<std::uint32_t>(builder_.normals.size()));
        if (added) {
          builder_.normals.push_back(pose.normal(vertex, mesh.vertex_normal.values.data[index]));
        }
        result[corner] = entry->second;
      }
      return result;
    }
    const std::vector<std::uint32_t> pieces = smooth_pieces(mesh, groups_of(mesh));
    if (pieces.empty()) return {};
    std::unordered_map<std::uint32_t, std::uint32_t> normal_of_piece;
    result.resize(mesh.num_indices);
    for (std::size_t corner = 0; corner < pieces.size(); ++corner) {
      const auto [entry, added] = normal_of_piece.emplace(pieces[corner], 0U);
      if (added) entry->second = builder_.add_computed_normal();
      result[corner] = entry->second;
    }
    return result;
  }

  /// Smoothing groups of the faces of a mesh, as masks; empty if it has none. They are read from
  /// the file itself, since ufbx only stores whether a face has any group.
  std::vector<std::uint32_t> groups_of(const ufbx_mesh& mesh) {
    if (mesh.face_smoothing.count < mesh.num_faces) return {};
    if (!smoothing_groups_) smoothing_groups_ = fbx_smoothing_groups(input_.bytes);
    std::vector<std::uint32_t> masks(mesh.num_faces);
    for (std::size_t f = 0; f < masks.size(); ++f) masks[f] = mesh.face_smoothing.data[f] ? 1 : 0;
    // Both lists, of ufbx's meshes and of smoothing groups, are in the order of the file.
    if (smoothing_groups_->size() == scene_.meshes.count) {
      const std::vector<std::uint32_t>& found = (*smoothing_groups_)[mesh.typed_id];
      if (found.size() == masks.size()) return found;
    }
    merged_groups_.add(text_of(mesh.name));
    return masks;
  }

  const std::string& material_name(const PlacedMesh& placed, std::size_t face) {
    const ufbx_mesh& mesh = *placed.mesh;
    const ufbx_material_list& list = materials_of(placed);
    const std::uint32_t index = face < mesh.face_material.count ? mesh.face_material.data[face] : 0;
    const ufbx_material* const material = index < list.count ? list.data[index] : nullptr;
    std::string& name = material_names_[material];
    if (name.empty()) {
      const std::string material_name =
          material == nullptr ? "DefaultMaterial" : text_of(material->name);
      name = unique_materials_.add(material_name.empty() ? "material" : material_name);
      material_of_[name] = material;
    }
    return name;
  }

  void materials() {
    for (const std::string& name : asset_.mesh.material_names) {
      Material& material = asset_.materials.emplace_back();
      material.name = name;
      const auto found = material_of_.find(name);
      if (found == material_of_.end() || found->second == nullptr) continue;
      const ufbx_material& source_material = *found->second;
      material.place = input_.file + ": material " + std::to_string(source_material.typed_id);
      numbers(source_material, material);
      const ufbx_material_fbx_maps& fbx = source_material.fbx;
      const ufbx_material_pbr_maps& pbr = source_material.pbr;
      material.color_map = picture({&pbr.base_color, &fbx.diffuse_color});
      material.opacity_map =
          picture({&pbr.opacity, &fbx.transparency_color, &fbx.transparency_factor});
      material.normal_map = picture({&pbr.normal_map, &fbx.normal_map, &fbx.bump});
      material.roughness_map = picture({&pbr.roughness});
      if (material.roughness_map.empty()) {
        material.roughness_map = picture({&pbr.glossiness});
        material.roughness_map.inverted = !material.roughness_map.empty();
      }
      material.metallic_map = picture({&pbr.metalness});
      material.emission_map = picture({&pbr.emission_color, &fbx.emission_color});
      material.occlusion_map = picture({&pbr.ambient_occlusion});
    }
  }

  static bool is_phong(const ufbx_material& from) {
    return from.shader_type == UFBX_SHADER_FBX_PHONG || from.shader_type == UFBX_SHADER_UNKNOWN ||
           from.shader_type == UFBX_SHADER_BLENDER_PHONG;
  }

  static void numbers(const ufbx_material& from, Material& material) {
    const auto color = [](const ufbx_material_map& map, const ufbx_material_map& factor) {
      const double factor_value = factor.has_value ? factor.value_real : 1;
      return std::array<float, 3>{narrow(map.value_vec3.x * factor_value),
                                  narrow(map.value_vec3.y * factor_value),
                                  narrow(map.value_vec3.z * factor_value)};
    };
    const ufbx_material_pbr_maps& pbr = from.pbr;
    // Besides the properties of a renderer, exporters write those of the old material model. The
    // former take precedence.
    if (pbr.base_color.has_value || from.fbx.diffuse_color.has_value) {
      material.color = pbr.base_color.has_value
                           ? color(pbr.base_color, pbr.base_factor)
                           : color(from.fbx.diffuse_color, from.fbx.diffuse_factor);
      material.color_from = MaterialNumber::given;
    }
    if (pbr.emission_color.has_value || from.fbx.emission_color.has_value) {
      material.emission = pbr.emission_color.has_value
                              ? color(pbr.emission_color, pbr.emission_factor)
                              : color(from.fbx.emission_color, from.fbx.emission_factor);
      material.emission_from = MaterialNumber::given;
    }
    if (pbr.roughness.has_value || pbr.glossiness.has_value) {
      // Roughness from a Phong shininess: 1 - sqrt(shininess) / 10, as in Blender.
      material.roughness = std::clamp(narrow(pbr.roughness.value_real), 0.0F, 1.0F);
      material.roughness_from = is_phong(from) ? MaterialNumber::converted : MaterialNumber::given;
    }
    if (pbr.metalness.has_value) {
      material.metallic = std::clamp(narrow(pbr.metalness.value_real), 0.0F, 1.0F);
      material.metallic_from = MaterialNumber::given;
    }
    material.opacity = std::clamp(narrow(read_opacity(from)), 0.0F, 1.0F);
  }

  /// The property "Opacity" takes precedence, since it means the same in all programs, whereas the
  /// factor of the transparent colour is 1 in all files of Maya.
  static double read_opacity(const ufbx_material& from) {
    double opacity_value = 1;
    if (from.pbr.opacity.has_value) return from.pbr.opacity.value_real;
    if (fbx_own_real(from.props, "Opacity", opacity_value)) return opacity_value;
    const ufbx_material_map &transparent = from.fbx.transparency_color,
                            &factor = from.fbx.transparency_factor;
    if (!transparent.has_value) return 1;
    const ufbx_vec3& rgb = transparent.value_vec3;
    const double remaining_opacity =
        1 - (rgb.x + rgb.y + rgb.z) / 3 * (factor.has_value ? factor.value_real : 1);
    return remaining_opacity != 0 ? remaining_opacity : 1;  // Cinema 4D writes 0 for opaque objects
  }

  static TextureWrap wrap_of(ufbx_wrap_mode mode) {
    return mode == UFBX_WRAP_CLAMP ? TextureWrap::clamp : TextureWrap::repeat;
  }

  /// The picture of the first of these material maps that has one.
  MaterialPicture picture(std::initializer_list<const ufbx_material_map*> maps) {
    for (const ufbx_material_map* map : maps) {
      if (map->texture == nullptr || !map->texture_enabled || map->feature_disabled) continue;
      const ufbx_texture_list& files = map->texture->file_textures;
      if (files.count == 0) continue;
      if (map->texture->type == UFBX_TEXTURE_LAYERED && map->texture->layers.count > 1) {
        layered_textures_.add(text_of(map->texture->name));
      }
      return picture(*files.data[0]);
    }
    return {};
  }

  MaterialPicture picture(const ufbx_texture& texture) {
    MaterialPicture picture;
    const auto name_of = [](const ufbx_string& text) {
      std::string name = text_of(text);
      std::replace(name.begin(), name.end(), '\\', '/');
      return name;
    };
    const std::string relative = name_of(texture.relative_filename),
                      absolute = name_of(texture.absolute_filename);
    const std::string& name = relative.empty() ? absolute : relative;
    if (texture.content.size != 0) {
      std::shared_ptr<const std::vector<std::byte> >& shared = embedded_[texture.content.data];
      if (shared == nullptr) {
        const auto* const bytes = static_cast<const std::byte*>(texture.content.data);
        shared =
            std::make_shared<const std::vector<std::byte> >(bytes, bytes + texture.content.size);
      }
      picture.bytes = shared;
      picture.file = name.empty() ? text_of(texture.name) : name;
    } else {
      if (name.empty()) return {};
      picture.file = pictures_.find(name);
      if (picture.file.empty() && !absolute.empty()) picture.file = pictures_.find(absolute);
      if (picture.file.empty()) {
        pictures_.count_missing(name);
        return {};
      }
    }
    const auto other = set_numbers_.find(text_of(texture.uv_set));
    picture.uv_set = other == set_numbers_.end() ? read_set_ : other->second;
    picture.wrap = {wrap_of(texture.wrap_u), wrap_of(texture.wrap_v)};
    if (texture.has_uv_transform) {
      const ufbx_transform& uv_transform = texture.uv_transform;
      const bool is_rotated = uv_transform.rotation.x != 0 || uv_transform.rotation.y != 0 ||
                              uv_transform.rotation.z != 0;
      // Only the scale in the transform is used, since all programs multiply UVs by it.
      pictures_.set_transform(
          picture, uv_transform.scale.x, uv_transform.scale.y,
          is_rotated || uv_transform.translation.x != 0 || uv_transform.translation.y != 0, true);
    }
    return picture;
  }

  /// Number of the UV set with this name: its index in the first mesh of the material in which it
  /// is not the first set; 0 if there is no such mesh.
  std::uint32_t uv_set_of(const ufbx_material& material, const std::string& name) const {
    const auto meshes = meshes_of_.find(&material);
    if (meshes == meshes_of_.end()) return 0;
    for (const ufbx_mesh* mesh : meshes->second) {
      if (const std::uint32_t set = uv_set_named(*mesh, name); set != 0) return set;
    }
    return 0;
  }

  /// Warns of defects of the file that ufbx repaired.
  void warn_of_repairs() const {
    for (const ufbx_warning& warning : scene_.metadata.warnings) {
      if (warning.type == UFBX_WARNING_BAD_UNICODE) continue;
      input_.warn("damaged-file",
                  "it does not conform to FBX: " + printable_text(warning.description) +
                      ". Check the result, or export it again.",
                  warning.count);
    }
  }

  struct NamedElement {
    std::uint64_t count = 0;
    std::string first;
    void add(const std::string& name) {
      if (count++ == 0) first = name;
    }
  };

  void warn() const {
    const auto add_warning = [this](const NamedElement& named, const char* code,
                                    const std::string& what) {
      if (named.count == 0) return;
      input_.warn(
          code, std::to_string(named.count) + what + " ('" + printable(named.first) + "' for one).",
          named.count);
    };
    add_warning(curve_nodes_, "ignored-primitives",
                " of its nodes have curves or NURBS, which are left out: convert these to meshes");
    add_warning(
        hidden_meshes_, "hidden-meshes",
        " of its meshes are hidden in the file, and are read all the same: delete what is not "
        "wanted");
    add_warning(
        lod_nodes_, "levels-of-detail",
        " of its nodes hold levels of detail, and all levels are read, one within the other: "
        "delete all but one");
    add_warning(
        subdivided_meshes_, "subdivision",
        " of its meshes have subdivision, but their control cages are read. Subdivide them before "
        "the export");
    add_warning(layered_textures_, "layered-textures",
                " of its textures have layers: only the lowest one is read");
    add_warning(
        merged_groups_, "smoothing-groups",
        " of its meshes have ambiguous smoothing groups, which are read as one: export normals");
    add_warning(
        deformed_meshes_, "skinned",
        " of its meshes have several skins, of which only the first is applied, or a vertex cache, "
        "which is ignored");
    if (hole_faces_ != 0) {
      input_.warn("hole-faces", counted(hole_faces_, "face") + " marked as holes are left out.",
                  hole_faces_);
    }
  }

  const MeshInput& input_;
  const ufbx_scene& scene_;
  MeshBuilder builder_;
  UvSetChoice uv_sets_;
  ScenePictures pictures_;
  Asset asset_;
  AffineMap to_world_ = kIdentityMap;
  std::vector<PlacedMesh> placed_meshes_;
  UniqueNames objects_, unique_materials_;
  std::map<const ufbx_mesh*, MeshUvs> uvs_;
  std::uint32_t read_set_ = 0;
  std::vector<std::string> other_sets_;               // Names of the UV sets in builder_.other_uvs
  std::map<std::string, std::uint32_t> set_numbers_;  // Numbers of the UV sets, by name
  std::map<const ufbx_material*, std::string> material_names_;
  std::map<std::string, const ufbx_material*> material_of_;
  std::map<const ufbx_material*, std::vector<const ufbx_mesh*> > meshes_of_;
  std::map<const void*, std::shared_ptr<const std::vector<std::byte> > > embedded_;
  // For each geometry, the smoothing masks of its faces
  std::optional<std::vector<std::vector<std::uint32_t> > > smoothing_groups_;
  NamedElement curve_nodes_, hidden_meshes_, lod_nodes_, subdivided_meshes_, layered_textures_,
      merged_groups_, deformed_meshes_;
  std::uint64_t hole_faces_ = 0;
};

}  // namespace

Asset read_fbx(const MeshInput& input) {
  const LoadedScene scene = load(input);
  Asset asset = FbxReader(input, *scene).read();
  // The materials are in the file itself, see has_own_materials()
  asset.mesh.material_files = {fs::path(input.file).filename().string()};
  return asset;
}

}  // namespace kiln
#endif
