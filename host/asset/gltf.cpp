// Meshes and hierarchy of glTF.
#include "asset/gltf.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "asset/axes.h"
#include "asset/gltf_draco.h"
#include "asset/hierarchy.h"
#include "asset/materials.h"
#include "asset/mesh_builder.h"
#include "base/counted.h"
#include "base/srgb.h"
#include "io/file/bounds.h"
#include "io/file/text_scanner.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

constexpr std::uint64_t kTriangles = 4,
                        kFanMode = 6;  // modes; below are points and lines, between strips

AffineMap matrix_of(const GltfValue& node) {
  const GltfValue matrix = node["matrix"];
  if (matrix.exists()) {
    const AffineMap given = matrix.numbers<16>(kNoMove);
    if (given[3] != 0 || given[7] != 0 || given[11] != 0 || given[15] != 1) {
      matrix.fail("its last row is not 0 0 0 1, and so it is no affine map");
    }
    return given;
  }
  const std::array<double, 3> t = node["translation"].numbers<3>({0, 0, 0});
  const std::array<double, 3> s = node["scale"].numbers<3>({1, 1, 1});
  std::array<double, 4> q = node["rotation"].numbers<4>({0, 0, 0, 1});
  const double size = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(size > 0)) node["rotation"].fail("it is 0, which is no rotation");
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

/// A matrix on places, normals and tangents.
class Placing {
 public:
  explicit Placing(const AffineMap& m) : m_(m) {
    const Vec3d x(m[0], m[1], m[2]), y(m[4], m[5], m[6]), z(m[8], m[9], m[10]);
    const Vec3d yz = cross(y, z), zx = cross(z, x), xy = cross(x, y);
    const double determinant = dot(x, yz);
    mirrors_ = determinant < 0;
    // The inverse transposed, but for a positive factor. Divided by the largest, so that no float overflows.
    double largest = 0;
    for (const Vec3d& v : {yz, zx, xy}) {
      largest = std::max({largest, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    }
    const double scale = (mirrors_ ? -1.0 : 1.0) / (largest > 0 ? largest : 1);
    n_ = {yz * scale, zx * scale, xy * scale};
  }

  bool mirrors() const { return mirrors_; }
  MeshBuilder::Position place(const double* p) const {
    MeshBuilder::Position result;
    for (std::size_t k = 0; k < 3; ++k) {
      result[k] = m_[k] * p[0] + m_[4 + k] * p[1] + m_[8 + k] * p[2] + m_[12 + k];
    }
    return result;
  }
  Vec3 normal(const Vec3d& n) const { return unit(n_[0] * n.x + n_[1] * n.y + n_[2] * n.z); }
  /// Tangent in the world, with the length that it has in the file, so that odd ones are told.
  Vec3 tangent(const double* t) const {
    const Vec3d given(t[0], t[1], t[2]);
    const Vec3d moved(m_[0] * t[0] + m_[4] * t[1] + m_[8] * t[2],
                      m_[1] * t[0] + m_[5] * t[1] + m_[9] * t[2],
                      m_[2] * t[0] + m_[6] * t[1] + m_[10] * t[2]);
    const double size = length(moved);
    return to_float(size > 0 && std::isfinite(size) ? moved * (length(given) / size) : moved);
  }

 private:
  static Vec3 unit(const Vec3d& n) {
    const double size = length(n);
    return size > 0 && std::isfinite(size) ? to_float(n * (1 / size)) : Vec3{};
  }
  AffineMap m_;
  bool mirrors_ = false;
  std::array<Vec3d, 3> n_;
};

/// A primitive's triangles, in the file's numbers.
struct Primitive {
  GltfNumbers positions, normals, uvs, tangents, colors;
  std::vector<Triangle> triangles;
  std::size_t material = 0;
};

const std::string kUvSet = "TEXCOORD_";

class GltfReader {
 public:
  explicit GltfReader(const MeshInput& input)
      : input_(input), file_(input), builder_(input), material_names_(gltf_material_names(file_)) {}

  Asset read(bool with_materials) {
    Asset asset;
    asset.extras = file_.root()["asset"]["extras"].dump();
    asset.copyright = file_.root()["asset"]["copyright"].text();
    asset.scene = scene_of_file();
    visit_nodes(asset);
    look_ahead();
    choose_uv_set();
    for (const Placed& placed : placed_) add(placed, asset);
    warn();
    if (builder_.faces() == 0) fail_empty();
    // The pool of normals runs in step with the positions, or looks as if it did not.
    if (flat_ != 0 && builder_.normals.size() == builder_.positions.size()) {
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
    const std::vector<Material> materials = read_gltf_materials(file_);
    for (const std::string& name : asset.mesh.material_names) {
      asset.materials.push_back(*std::find_if(materials.begin(), materials.end(),
                                              [&](const Material& m) { return m.name == name; }));
    }
    note_vertex_opacity(asset.mesh, asset.materials);
    return asset;
  }

 private:
  /// A mesh that a node places.
  struct Placed {
    std::size_t mesh;
    std::uint32_t node;  // of the asset
    AffineMap matrix;
    std::string name;
  };

  /// Children have one parent, and no node is above itself.
  std::vector<std::optional<std::size_t>> parents() const {
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
    // Roots are done, and children of what is done; who is left is its own ancestor, or below one.
    std::vector<std::size_t> done;
    for (std::size_t i = 0; i < parent.size(); ++i) {
      if (!parent[i]) done.push_back(i);
    }
    std::vector<bool> is_done(parent.size());
    for (std::size_t next = 0; next < done.size(); ++next) {
      is_done[done[next]] = true;
      const GltfValue children = nodes.at(done[next])["children"];
      for (std::size_t k = 0; k < children.size(); ++k) done.push_back(children.at(k).count(0));
    }
    const auto left = std::find(is_done.begin(), is_done.end(), false);
    if (left != is_done.end()) {
      nodes.at(static_cast<std::size_t>(left - is_done.begin()))
          .fail("it is among its own ancestors");
    }
    return parent;
  }

  /// Nodes of the default scene; without one, of all scenes; without any, all.
  std::vector<std::size_t> roots() const {
    const GltfValue nodes = file_.list("nodes"), scenes = file_.list("scenes");
    const auto parent = parents();
    std::vector<std::size_t> result;
    std::vector<bool> taken(nodes.size());
    const auto take = [&](const GltfValue& scene) {
      const GltfValue list = scene["nodes"];
      for (std::size_t k = 0; k < list.size(); ++k) {
        const std::size_t node = *list.at(k).index_into(nodes);
        if (parent[node]) {
          list.at(k).fail("nodes[" + std::to_string(node) +
                          "] is no root: it is a child of nodes[" + std::to_string(*parent[node]) +
                          "]");
        }
        if (!taken[node]) result.push_back(node);
        taken[node] = true;
      }
    };
    const GltfValue scene = file_.root()["scene"];
    if (scene.exists() && scenes.exists()) {
      take(scenes.at(*scene.index_into(scenes)));
    } else if (scenes.size() != 0) {
      for (std::size_t i = 0; i < scenes.size(); ++i) take(scenes.at(i));
    } else {
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (!parent[i]) result.push_back(i);
      }
    }
    return result;
  }

  /// The default scene, or the only one.
  std::string scene_of_file() const {
    const GltfValue scenes = file_.list("scenes"), scene = file_.root()["scene"];
    if (scene.exists() && scenes.exists()) return scenes.at(*scene.index_into(scenes)).dump();
    return scenes.size() == 1 ? scenes.at(0).dump() : "";
  }

  void visit_nodes(Asset& asset) {
    const GltfValue nodes = file_.list("nodes"), meshes = file_.list("meshes");
    struct Step {
      std::size_t node;
      std::uint32_t parent;
    };
    std::vector<Step> steps;
    const std::vector<std::size_t> first = roots();
    for (auto root = first.rbegin(); root != first.rend(); ++root) {
      steps.push_back({*root, AssetNode::kNone});
    }
    std::vector<AffineMap> worlds;
    UniqueNames unique;
    while (!steps.empty()) {
      const Step step = steps.back();
      steps.pop_back();
      const GltfValue node = nodes.at(step.node);
      const auto index = static_cast<std::uint32_t>(asset.nodes.size());
      AssetNode& made = asset.nodes.emplace_back();
      made.name = node["name"].text();
      made.parent = step.parent;
      made.transform = matrix_of(node);
      if (step.parent == AssetNode::kNone && world_.map) {
        made.transform = product(*world_.map, made.transform);
      }
      made.extras = node["extras"].dump();
      worlds.push_back(step.parent == AssetNode::kNone
                           ? made.transform
                           : product(worlds[step.parent], made.transform));
      if (const auto mesh = node["mesh"].index_into(meshes)) {
        made.mesh_extras = meshes.at(*mesh)["extras"].dump();
        std::string name = made.name.empty() ? meshes.at(*mesh)["name"].text() : made.name;
        if (name.empty()) name = "node " + std::to_string(step.node);
        if (node["skin"].exists()) ++skins_;
        placed_.push_back({*mesh, index, worlds.back(), unique.add(name)});
        if (node["extensions"]["EXT_mesh_gpu_instancing"].exists()) ++instanced_;
      }
      const GltfValue children = node["children"];
      for (std::size_t k = children.size(); k-- > 0;) {
        steps.push_back({static_cast<std::size_t>(children.at(k).count(0)), index});
      }
    }
  }

  /// Finds what all primitives have together, and whether memory can hold what the nodes place.
  void look_ahead() {
    std::uint64_t vertices = 0, corners = 0;
    for (const Placed& placed : placed_) {
      const GltfValue primitives = file_.list("meshes").at(placed.mesh)["primitives"];
      for (std::size_t i = 0; i < primitives.size(); ++i) {
        const GltfValue primitive = primitives.at(i), attributes = primitive["attributes"];
        if (primitive["mode"].count(kTriangles) < kTriangles) continue;
        const auto position = attributes["POSITION"].index_into(file_.list("accessors"));
        if (!position) continue;
        const auto index = primitive["indices"].index_into(file_.list("accessors"));
        if (primitive["extensions"][kDraco].exists()) {
          // Checked where it is unpacked.
          vertices += file_.list("accessors").at(*position)["count"].count(0);
          if (index) corners += file_.list("accessors").at(*index)["count"].count(0);
        } else {
          vertices += file_.count(*position);
          corners += file_.count(index.value_or(*position));
        }
        has_colors_ = has_colors_ || attributes["COLOR_0"].exists();
        has_tangents_ = has_tangents_ || attributes["TANGENT"].exists();
        while (attributes[kUvSet + std::to_string(uv_sets_)].exists()) ++uv_sets_;
      }
    }
    constexpr std::uint64_t kVertexBytes = 72, kCornerBytes = 36;
    const FailWith fail = [this](const std::string& place, const std::string& problem,
                                 const std::string& remedy) {
      input_.fail(place, problem, remedy);
    };
    require_memory(
        "its meshes, as often as nodes place them,",
        std::max(capped_product(vertices, kVertexBytes), capped_product(corners, kCornerBytes)),
        memory_failure(fail, ""));
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
                "it has no set of UVs " +
                    (name.empty() ? std::to_string(uv_set_) : "\"" + printable(name) + "\"") +
                    ": its sets are " + sets,
                "Ask for one of them.");
  }

  GltfNumbers attribute(const GltfValue& attributes, const std::string& name, std::size_t width,
                        std::size_t count) const {
    const GltfValue given = attributes[name];
    const auto accessor = given.index_into(file_.list("accessors"));
    if (!accessor) return {};
    if (file_.count(*accessor) != count) {
      given.fail("it has " + counted(file_.count(*accessor), "element") + ", but there are " +
                 std::to_string(count) + " positions");
    }
    return file_.numbers(*accessor, width);
  }

  std::optional<Primitive> read_primitive(const GltfValue& from) {
    const std::uint64_t mode = from["mode"].count(kTriangles);
    if (mode > kFanMode)
      from["mode"].fail("it is " + std::to_string(mode) + ", which glTF does not know");
    if (mode < kTriangles) {
      if (lines_++ == 0) first_lines_ = from.place();
      return std::nullopt;
    }
    const GltfValue attributes = from["attributes"], accessors = file_.list("accessors");
    const auto position = attributes["POSITION"].index_into(accessors);
    if (!position) from.fail("it has no positions");
    const GltfValue packed = from["extensions"][kDraco];
    if (packed.exists() && (kReadsDraco || !accessors.at(*position)["bufferView"].exists())) {
      return read_packed(from, packed);
    }
    Primitive result;
    result.positions = file_.numbers(*position, 3);
    const std::size_t count = result.positions.count();
    result.uvs = attribute(attributes, kUvSet + std::to_string(uv_set_), 2, count);
    result.normals = attribute(attributes, "NORMAL", 3, count);
    result.colors = attribute(attributes, "COLOR_0", GltfFile::kColor, count);
    // The spec: tangents without normals are to be ignored.
    if (!result.normals.values.empty())
      result.tangents = attribute(attributes, "TANGENT", 4, count);
    finish_primitive(from, result);
    std::vector<std::uint32_t> order;
    if (const auto index = from["indices"].index_into(accessors)) {
      order = file_.indices(*index, count);
    } else {
      order.resize(count);
      for (std::size_t i = 0; i < count; ++i) order[i] = static_cast<std::uint32_t>(i);
    }
    cut(mode, order, from, result.triangles);
    return result;
  }

  void finish_primitive(const GltfValue& from, Primitive& result) {
    if (from["targets"].size() != 0) ++morphs_;
    const auto material = from["material"].index_into(file_.list("materials"));
    result.material = material.value_or(material_names_.size() - 1);
  }

  Primitive read_packed(const GltfValue& from, const GltfValue& packed) {
    Primitive result;
    struct Wanted {
      std::string name;
      std::size_t width;
      GltfNumbers* to;
    };
    const Wanted wanted[] = {{"POSITION", 3, &result.positions},
                             {"NORMAL", 3, &result.normals},
                             {kUvSet + std::to_string(uv_set_), 2, &result.uvs},
                             {"COLOR_0", GltfFile::kColor, &result.colors},
                             {"TANGENT", 4, &result.tangents}};
    std::vector<DracoAttribute> attributes;
    std::vector<GltfNumbers*> to;
    const GltfValue given = from["attributes"], ids = packed["attributes"];
    for (const Wanted& attribute : wanted) {
      const auto accessor = given[attribute.name].index_into(file_.list("accessors"));
      if (!accessor || !ids[attribute.name].exists()) continue;
      attributes.push_back({ids[attribute.name].count(0), file_.list("accessors").at(*accessor),
                            attribute.width, attribute.name});
      to.push_back(attribute.to);
    }
    if (attributes.empty() || attributes[0].name != "POSITION") {
      packed.fail("it packs no positions");
    }
    DracoMesh mesh = unpack_draco(file_, packed, attributes);
    for (std::size_t i = 0; i < to.size(); ++i) *to[i] = std::move(mesh.attributes[i]);
    // Attributes that are not packed lie beside it.
    for (const Wanted& attribute : wanted) {
      if (!ids[attribute.name].exists()) {
        *attribute.to = this->attribute(given, attribute.name, attribute.width, mesh.points);
      }
    }
    if (result.normals.values.empty()) result.tangents = {};
    finish_primitive(from, result);
    cut(kTriangles, mesh.indices, from, result.triangles);
    return result;
  }

  void cut(std::uint64_t mode, const std::vector<std::uint32_t>& order, const GltfValue& from,
           std::vector<Triangle>& triangles) {
    const std::size_t n = order.size();
    if (mode == kTriangles) {
      if (n % 3 != 0 && odd_++ == 0) first_odd_ = from.place();
      for (std::size_t i = 0; i + 2 < n; i += 3)
        triangles.push_back({order[i], order[i + 1], order[i + 2]});
      return;
    }
    for (std::size_t i = 0; i + 2 < n; ++i) {
      const Triangle t = mode == kFanMode ? Triangle{order[i + 1], order[i + 2], order[0]}
                         : i % 2 == 0     ? Triangle{order[i], order[i + 1], order[i + 2]}
                                          : Triangle{order[i], order[i + 2], order[i + 1]};
      // One with a repeated corner only turns the strip.
      if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles.push_back(t);
    }
  }

  void add(const Placed& placed, Asset& asset) {
    const Placing placing(placed.matrix);
    const GltfValue primitives = file_.list("meshes").at(placed.mesh)["primitives"];
    bool named = false;
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      const std::optional<Primitive> primitive = read_primitive(primitives.at(i));
      if (!primitive || primitive->triangles.empty()) continue;
      if (!named) {
        builder_.set_object(placed.name);
        asset.object_nodes.push_back(placed.node);
        named = true;
      }
      builder_.set_material(material_names_[primitive->material]);
      add(*primitive, placing);
    }
  }

  void add(const Primitive& p, const Placing& placing) {
    const std::size_t count = p.positions.count();
    if (builder_.positions.size() + count > 0x7FFFFFFFU) {
      input_.fail("", "its nodes place more than 2147483647 vertices",
                  "Split or simplify the mesh.");
    }
    const auto first = static_cast<std::uint32_t>(builder_.positions.size());
    const auto first_uv = static_cast<std::uint32_t>(builder_.uvs.size());
    const auto first_normal = static_cast<std::uint32_t>(builder_.normals.size());
    const bool has_normals = !p.normals.values.empty(), has_uvs = !p.uvs.values.empty();
    for (std::size_t i = 0; i < count; ++i) {
      builder_.positions.push_back(placing.place(p.positions.at(i)));
      if (has_normals) {
        const double* const n = p.normals.at(i);
        builder_.normals.push_back(placing.normal({n[0], n[1], n[2]}));
      }
      if (has_uvs) {
        builder_.uvs.push_back({narrow(p.uvs.at(i)[0]), narrow(1 - p.uvs.at(i)[1])});
      }
      if (has_colors_) add_color(p.colors, i);
      if (has_tangents_) add_tangent(p.tangents, i, placing);
    }
    constexpr std::span<const std::uint32_t> none;
    for (Triangle t : p.triangles) {
      if (placing.mirrors()) std::swap(t[1], t[2]);
      Triangle corners{}, uv{}, normal{};
      for (std::size_t k = 0; k < 3; ++k) {
        corners[k] = first + t[k];
        uv[k] = first_uv + t[k];
        normal[k] = first_normal + t[k];
      }
      if (!has_normals) normal.fill(add_flat_normal(corners));
      builder_.add_face(corners, has_uvs ? std::span<const std::uint32_t>(uv) : none, normal);
    }
  }

  /// The spec: without normals, triangles are flat.
  std::uint32_t add_flat_normal(const Triangle& corners) {
    const auto at = [&](std::size_t k) {
      const MeshBuilder::Position& p = builder_.positions[corners[k]];
      return Vec3d(p[0], p[1], p[2]);
    };
    const Vec3d n = cross(at(1) - at(0), at(2) - at(0));
    const double size = length(n);
    builder_.normals.push_back(size > 0 && std::isfinite(size) ? to_float(n * (1 / size)) : Vec3{});
    ++flat_;
    return static_cast<std::uint32_t>(builder_.normals.size() - 1);
  }

  /// glTF's are in linear light, Kiln's bytes are sRGB.
  void add_color(const GltfNumbers& colors, std::size_t vertex) {
    std::array<std::uint8_t, 4> bytes{255, 255, 255, 255};
    if (!colors.values.empty()) {
      const double* const c = colors.at(vertex);
      for (std::size_t k = 0; k < colors.width; ++k) {
        const float value =
            k < 3 ? to_srgb(narrow(c[k])) : static_cast<float>(std::clamp(c[k], 0.0, 1.0));
        bytes[k] = static_cast<std::uint8_t>(std::lround(std::isfinite(value) ? value * 255 : 0));
        if (c[k] > 1) ++bright_;
      }
    }
    builder_.colors.push_back(bytes);
  }

  void add_tangent(const GltfNumbers& tangents, std::size_t vertex, const Placing& placing) {
    if (tangents.values.empty()) {
      builder_.tangents.push_back({});
      return;
    }
    const double* const t = tangents.at(vertex);
    const double sign = placing.mirrors() ? -t[3] : t[3];
    builder_.tangents.push_back({placing.tangent(t), narrow(sign)});
  }

  void warn() const {
    const auto say = [this](std::uint64_t count, const char* code, const std::string& text) {
      if (count != 0) input_.warn(code, text, count);
    };
    say(lines_, "ignored-primitives",
        counted(lines_, "primitive") + " of points or lines (" + first_lines_ +
            " for one) were left out: they are no surface.");
    say(odd_, "short-faces",
        counted(odd_, "primitive") + " (" + first_odd_ +
            " for one) end in a triangle with fewer than three corners; it was left out.");
    say(flat_, "flat-normals",
        counted(flat_, "triangle") + " without normals: flat, as glTF has it.");
    say(skins_, "rest-pose",
        counted(skins_, "mesh with a skin") + ": taken as modelled, without their joints.");
    say(morphs_, "rest-pose",
        counted(morphs_, "primitive") + " with morph targets: taken without them.");
    say(instanced_, "instances-ignored",
        counted(instanced_, "node") +
            " with EXT_mesh_gpu_instancing: their mesh was taken once. Export instances as nodes.");
    say(bright_, "bright-colors",
        counted(bright_, "number") + " of vertex colours are above 1, and were cut off there.");
  }

  [[noreturn]] void fail_empty() const {
    const std::size_t meshes = file_.list("meshes").size();
    if (placed_.empty() && meshes != 0) {
      input_.fail("scenes",
                  "no node of its scene has one of its " + counted(meshes, "mesh") + "(es)",
                  "Put the mesh into the scene, and export it again.");
    }
    input_.fail("", meshes == 0 ? "it has no meshes" : "its meshes have no triangles",
                "Kiln needs a surface: export triangles.");
  }

  const MeshInput& input_;
  const GltfFile file_;
  const WorldFrame world_ = world_frame(input_.options, kNoMove, 1);
  MeshBuilder builder_;
  const std::vector<std::string> material_names_;
  std::vector<Placed> placed_;
  std::uint32_t uv_sets_ = 0, uv_set_ = 0;  // that there are; that is read
  bool has_colors_ = false, has_tangents_ = false;
  std::uint64_t flat_ = 0, lines_ = 0, odd_ = 0, skins_ = 0, morphs_ = 0, instanced_ = 0,
                bright_ = 0;
  std::string first_lines_, first_odd_;
};

}  // namespace

Asset read_gltf(const MeshInput& input, bool materials) {
  return GltfReader(input).read(materials);
}

}  // namespace kiln
