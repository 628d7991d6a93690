#include "asset/assimp.h"

#ifndef KILN_HAS_ASSIMP
namespace kiln {

Asset read_by_assimp(const MeshInput& input) {
  input.fail("", "this build of Kiln was made without Assimp, which reads FBX, DAE, 3DS and X",
             "Export the mesh as OBJ or PLY, or build Kiln with KILN_ASSIMP=ON where Assimp is "
             "installed.");
}

}  // namespace kiln
#else

#include <assimp/GltfMaterial.h>
#include <assimp/material.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <bit>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "asset/axes.h"
#include "asset/file_finder.h"
#include "asset/hierarchy.h"
#include "asset/mesh_builder.h"
#include "asset/udim_files.h"
#include "base/child.h"
#include "base/counted.h"
#include "base/lower_case.h"
#include "io/file/text_scanner.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

/// Lets no file be opened: what is read is in memory, and names in it are no reason to look at others.
class NoFiles : public Assimp::IOSystem {
 public:
  bool Exists(const char* /*file*/) const override { return false; }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* /*file*/, const char* /*mode*/) override { return nullptr; }
  void Close(Assimp::IOStream* /*stream*/) override {}
};

AffineMap transform_of(const aiMatrix4x4& m) {
  return {m.a1, m.b1, m.c1, m.d1, m.a2, m.b2, m.c2, m.d2,
          m.a3, m.b3, m.c3, m.d3, m.a4, m.b4, m.c4, m.d4};
}

/// Map of normals, up to their length: the cofactors, whose columns are the cross products of the map's.
struct NormalTurn {
  std::array<std::array<double, 3>, 3> columns{};
  bool mirrors = false;

  explicit NormalTurn(const AffineMap& m) {
    double determinant = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double *const a = &m[4 * ((k + 1) % 3)], *const b = &m[4 * ((k + 2) % 3)];
      columns[k] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                    a[0] * b[1] - a[1] * b[0]};
    }
    for (std::size_t i = 0; i < 3; ++i) determinant += m[i] * columns[0][i];
    mirrors = determinant < 0;
  }
  Vec3 operator()(const aiVector3D& n) const {
    std::array<double, 3> turned{};
    for (std::size_t i = 0; i < 3; ++i) {
      turned[i] = columns[0][i] * n.x + columns[1][i] * n.y + columns[2][i] * n.z;
    }
    // Made unit here, since cofactors of small scales are too small for floats.
    const double length = std::hypot(turned[0], turned[1], turned[2]) * (mirrors ? -1 : 1);
    if (!std::isnormal(length)) return {};
    return {narrow(turned[0] / length), narrow(turned[1] / length), narrow(turned[2] / length)};
  }
};

class SceneReader {
 public:
  SceneReader(const MeshInput& input, const aiScene& scene)
      : input_(input),
        scene_(scene),
        builder_(input),
        folder_(fs::path(input.file).parent_path()),
        finder_(folder_, input.warnings),
        has_normals_(input.bytes.find("LayerElementNormal") != std::string_view::npos),
        has_uvs_(input.bytes.find("LayerElementUV") != std::string_view::npos) {}

  Asset read() {
    const WorldFrame world = world_frame(input_.options, own_turn(), metres());
    AffineMap to_world = world.map.value_or(kNoMove);
    undo_unit(to_world);
    nodes(to_world);
    check_uv_set();
    builder_.is_placed = true;
    asset_.mesh = builder_.finish();
    materials();
    asset_.mesh.metres = world.metres;
    asset_.mesh.uv_set = uv_set_.value_or(0);
    warn();
    return std::move(asset_);
  }

 private:
  [[noreturn]] void fail(const std::string& place, const std::string& problem) const {
    input_.fail(place, problem, "Export the mesh again, or as OBJ or glTF.");
  }

  /// Parents before children, in the file's order.
  void nodes(const AffineMap& to_world) {
    struct Visit {
      const aiNode* node;
      std::uint32_t parent;
      AffineMap of_parent;
    };
    std::vector<Visit> open = {{scene_.mRootNode, AssetNode::kNone, AssetNode().transform}};
    while (!open.empty()) {
      const Visit visit = open.back();
      open.pop_back();
      const auto index = static_cast<std::uint32_t>(asset_.nodes.size());
      AssetNode& node = asset_.nodes.emplace_back();
      node.name = visit.node->mName.C_Str();
      node.parent = visit.parent;
      node.transform = transform_of(visit.node->mTransformation);
      if (visit.parent == AssetNode::kNone) node.transform = product(to_world, node.transform);
      const AffineMap world = product(visit.of_parent, node.transform);
      if (visit.node->mNumMeshes != 0) {
        builder_.set_object(objects_.add(node.name.empty() ? "object" : node.name));
        asset_.object_nodes.push_back(index);
      }
      for (unsigned i = 0; i < visit.node->mNumMeshes; ++i) {
        if (visit.node->mMeshes[i] >= scene_.mNumMeshes) fail(node.name, "it names no mesh");
        mesh(*scene_.mMeshes[visit.node->mMeshes[i]], world);
      }
      for (unsigned i = visit.node->mNumChildren; i-- > 0;) {
        open.push_back({visit.node->mChildren[i], index, world});
      }
    }
  }

  /// Corners of one place and colour become one vertex: Assimp gives each corner of FBX its own.
  std::vector<std::uint32_t> vertices(const aiMesh& mesh, const AffineMap& world) {
    using Key = std::array<std::uint64_t, 4>;
    std::map<Key, std::uint32_t> known;
    std::vector<std::uint32_t> of(mesh.mNumVertices);
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D& p = mesh.mVertices[v];
      MeshBuilder::Position place{};
      Key key{};
      for (std::size_t i = 0; i < 3; ++i) {
        place[i] = world[i] * p.x + world[4 + i] * p.y + world[8 + i] * p.z + world[12 + i];
        key[i] = std::bit_cast<std::uint64_t>(place[i] + 0.0);  // -0 is 0
      }
      std::array<std::uint8_t, 4> color{};
      if (mesh.HasVertexColors(0)) {
        const aiColor4D& c = mesh.mColors[0][v];
        for (unsigned k = 0; k < 4; ++k) {
          const float value = c[k] > 0 ? std::min(c[k], 1.0F) : 0;
          color[k] = static_cast<std::uint8_t>(std::lround(value * 255));
        }
        key[3] = std::bit_cast<std::uint32_t>(color);
      }
      const auto [entry, added] =
          known.emplace(key, static_cast<std::uint32_t>(builder_.positions.size()));
      of[v] = entry->second;
      if (!added) continue;
      builder_.positions.push_back(place);
      if (mesh.HasVertexColors(0)) builder_.set_color_bytes(builder_.positions.size() - 1, color);
    }
    return of;
  }

  void mesh(const aiMesh& mesh, const AffineMap& world) {
    if (mesh.mNumFaces == 0 || mesh.mVertices == nullptr) return;
    if (mesh.mNumBones != 0) ++skinned_;
    if (mesh.GetNumUVChannels() > 1) ++more_uvs_;
    if (has_normals_ && !mesh.HasNormals()) ++dropped_normals_;
    if (has_uvs_ && mesh.GetNumUVChannels() == 0) ++dropped_uvs_;
    const std::optional<unsigned> uv_set = uv_set_of(mesh);
    if (uv_set && !uv_set_) uv_set_ = uv_set;
    builder_.set_material(material_name(mesh.mMaterialIndex));
    const std::vector<std::uint32_t> vertex_of = vertices(mesh, world);
    const auto first_uv = static_cast<std::uint32_t>(builder_.uvs.size());
    const auto first_normal = static_cast<std::uint32_t>(builder_.normals.size());
    const NormalTurn turn(world);
    const bool uvs = uv_set.has_value(), normals = mesh.HasNormals();
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      if (uvs) {
        const aiVector3D& uv = mesh.mTextureCoords[*uv_set][v];
        builder_.uvs.push_back({uv.x, uv.y});
      }
      if (normals) builder_.normals.push_back(turn(mesh.mNormals[v]));
    }
    std::vector<std::uint32_t> corners, corner_uvs, corner_normals;
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      corners.clear();
      corner_uvs.clear();
      corner_normals.clear();
      for (unsigned i = 0; i < face.mNumIndices; ++i) {
        // A mirrored polygon is turned round, so that it faces as its normals do.
        const unsigned v = face.mIndices[turn.mirrors ? face.mNumIndices - 1 - i : i];
        if (v >= mesh.mNumVertices) {
          fail("mesh \"" + printable(mesh.mName.C_Str()) + "\", face " + std::to_string(f),
               "its corner is vertex " + std::to_string(v) + " of " +
                   std::to_string(mesh.mNumVertices));
        }
        corners.push_back(vertex_of[v]);
        if (uvs) corner_uvs.push_back(first_uv + v);
        if (normals) corner_normals.push_back(first_normal + v);
      }
      builder_.add_face(corners, corner_uvs, corner_normals);
    }
  }

  /// The channel of the set that is asked for, where a mesh has it.
  std::optional<unsigned> uv_set_of(const aiMesh& mesh) {
    const std::string& name = input_.options.uv_set_name;
    std::optional<unsigned> found;
    for (unsigned set = 0; set < mesh.GetNumUVChannels(); ++set) {
      const aiString* const given = mesh.GetTextureCoordsName(set);
      const std::string own = given == nullptr ? "" : given->C_Str();
      uv_sets_.insert(std::to_string(set) + (own.empty() ? "" : " \"" + printable(own) + "\""));
      if (name.empty() ? set == input_.options.uv_set : own == name) found = set;
    }
    return found;
  }

  /// Refuses a set of UVs that no mesh has.
  void check_uv_set() const {
    const LoadMeshOptions& options = input_.options;
    if (uv_set_ || (options.uv_set_name.empty() && options.uv_set == 0)) return;
    std::string sets;
    for (const std::string& set : uv_sets_) sets += (sets.empty() ? "" : ", ") + set;
    input_.fail("",
                "none of its meshes has the set of UVs " +
                    (options.uv_set_name.empty() ? std::to_string(options.uv_set)
                                                 : "\"" + printable(options.uv_set_name) + "\"") +
                    ": its sets are " + (sets.empty() ? "none" : sets),
                "Ask for one of them.");
  }

  const std::string& material_name(unsigned index) {
    if (index >= scene_.mNumMaterials) fail("material " + std::to_string(index), "it is missing");
    std::string& name = material_names_[index];
    if (name.empty()) {
      const std::string given = scene_.mMaterials[index]->GetName().C_Str();
      name = unique_materials_.add(given.empty() ? "material" : given);
      material_of_[name] = index;
    }
    return name;
  }

  void materials() {
    for (const std::string& name : asset_.mesh.material_names) {
      Material& material = asset_.materials.emplace_back();
      material.name = name;
      const auto found = material_of_.find(name);
      if (found == material_of_.end()) continue;
      const aiMaterial& from = *scene_.mMaterials[found->second];
      material.place = input_.file + ": material " + std::to_string(found->second);
      color(from, material);
      if (from.Get(AI_MATKEY_OPACITY, material.opacity) != AI_SUCCESS) material.opacity = 1;
      if (from.Get(AI_MATKEY_ROUGHNESS_FACTOR, material.roughness) == AI_SUCCESS) {
        // Assimp makes one of a Phong's shininess: 1 - sqrt(shininess) / 10, as Blender does, but without limits.
        float shininess = 0;
        const bool made = from.Get(AI_MATKEY_SHININESS, shininess) == AI_SUCCESS;
        material.roughness = std::clamp(material.roughness, 0.0F, 1.0F);
        material.roughness_from = made ? MaterialNumber::converted : MaterialNumber::given;
      }
      if (from.Get(AI_MATKEY_METALLIC_FACTOR, material.metallic) == AI_SUCCESS) {
        material.metallic_from = MaterialNumber::given;
      }
      aiColor3D emission;
      if (from.Get(AI_MATKEY_COLOR_EMISSIVE, emission) == AI_SUCCESS) {
        material.emission = {emission.r, emission.g, emission.b};
        material.emission_from = MaterialNumber::given;
      }
      material.color_map = picture(from, {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE});
      material.opacity_map = picture(from, {aiTextureType_OPACITY});
      material.normal_map =
          picture(from, {aiTextureType_NORMALS, aiTextureType_NORMAL_CAMERA, aiTextureType_HEIGHT});
      material.roughness_map = picture(from, {aiTextureType_DIFFUSE_ROUGHNESS});
      material.metallic_map = picture(from, {aiTextureType_METALNESS});
      material.emission_map = picture(from, {aiTextureType_EMISSION_COLOR, aiTextureType_EMISSIVE});
      material.occlusion_map = picture(from, {aiTextureType_AMBIENT_OCCLUSION});
    }
  }

  static void color(const aiMaterial& from, Material& material) {
    aiColor4D base;
    aiColor3D diffuse;
    if (from.Get(AI_MATKEY_BASE_COLOR, base) == AI_SUCCESS) {
      material.color = {base.r, base.g, base.b};
    } else if (from.Get(AI_MATKEY_COLOR_DIFFUSE, diffuse) == AI_SUCCESS) {
      material.color = {diffuse.r, diffuse.g, diffuse.b};
    } else {
      return;
    }
    material.color_from = MaterialNumber::given;
  }

  static TextureWrap wrap_of(const aiMaterial& from, const char* key, unsigned kind,
                             unsigned index) {
    int mode = aiTextureMapMode_Wrap;
    from.Get(key, kind, index, mode);
    return mode == aiTextureMapMode_Clamp || mode == aiTextureMapMode_Decal ? TextureWrap::clamp
           : mode == aiTextureMapMode_Mirror                                ? TextureWrap::mirror
                                                                            : TextureWrap::repeat;
  }

  /// The first of these kinds that a material has.
  MaterialPicture picture(const aiMaterial& from, std::initializer_list<aiTextureType> kinds) {
    MaterialPicture picture;
    for (const aiTextureType kind : kinds) {
      aiString path;
      unsigned set = 0;
      if (from.GetTexture(kind, 0, &path, nullptr, &set) != AI_SUCCESS || path.length == 0)
        continue;
      picture.uv_set = set;
      std::string name = path.C_Str();
      std::replace(name.begin(), name.end(), '\\', '/');
      const aiTexture* const embedded = scene_.GetEmbeddedTexture(path.C_Str());
      // Height 0: a file's bytes, as many as its width; others would be bare texels.
      if (embedded != nullptr && embedded->mHeight == 0) {
        const auto* const bytes = reinterpret_cast<const std::byte*>(embedded->pcData);
        std::shared_ptr<const std::vector<std::byte> >& shared = embedded_[embedded];
        if (shared == nullptr) {
          shared = std::make_shared<const std::vector<std::byte> >(bytes, bytes + embedded->mWidth);
        }
        picture.bytes = shared;
        picture.file = name.starts_with('*') ? "picture " + name.substr(1) : name;
      } else {
        picture.file = file_of(name);
        if (picture.file.empty()) return {};
      }
      picture.wrap = {wrap_of(from, AI_MATKEY_MAPPINGMODE_U(kind, 0)),
                      wrap_of(from, AI_MATKEY_MAPPINGMODE_V(kind, 0))};
      aiUVTransform placement;
      if (from.Get(AI_MATKEY_UVTRANSFORM(kind, 0), placement) == AI_SUCCESS) {
        place(placement, picture);
      }
      break;
    }
    return picture;
  }

  /// FBX's scaling alone multiplies UVs in all programs. With a translation Blender has S (u - T), Unreal and three.js
  /// S u + T; a rotation is in degrees or, as Blender writes it, in radians; other formats' are as little agreed on.
  void place(const aiUVTransform& placement, MaterialPicture& picture) {
    const aiVector2D& scale = placement.mScaling;
    if (placement.mTranslation == aiVector2D(0, 0) && placement.mRotation == 0 &&
        (scale == aiVector2D(1, 1) ||
         (lower_extension(input_.file) == ".fbx" && std::isfinite(scale.x) && scale.x != 0 &&
          std::isfinite(scale.y) && scale.y != 0))) {
      picture.uv_transform = {scale.x, 0, 0, 0, scale.y, 0};
    } else if (placed_++ == 0) {
      first_placed_ = picture.file.filename().string();
    }
  }

  /// Assimp turns Collada, 3DS and X itself, and gives FBX's axes as metadata.
  AffineMap own_turn() const {
    struct Axis {
      std::int32_t axis = 0, sign = 1;
    };
    // The axes that become X, Y and Z. "Front" looks at the viewer.
    constexpr const char* kNames[] = {"CoordAxis", "UpAxis", "FrontAxis"};
    std::array<Axis, 3> axes{};
    AffineMap map{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::string name = kNames[k];
      if (scene_.mMetaData == nullptr || !scene_.mMetaData->Get(name, axes[k].axis) ||
          !scene_.mMetaData->Get(name + "Sign", axes[k].sign)) {
        return kNoMove;
      }
      if (axes[k].axis < 0 || axes[k].axis > 2 || std::abs(axes[k].sign) != 1) return odd_axes();
      map[4 * static_cast<std::size_t>(axes[k].axis) + k] = axes[k].sign;
    }
    if (axes[0].axis == axes[1].axis || axes[1].axis == axes[2].axis ||
        axes[2].axis == axes[0].axis) {
      return odd_axes();
    }
    map[15] = 1;
    return map;
  }

  AffineMap odd_axes() const {
    input_.warn("odd-axes",
                "its axes are not three different ones, so that it was not turned. Say what is up, "
                "such as --up high=z.",
                1);
    return kNoMove;
  }

  bool is_collada() const { return lower_extension(input_.file) == ".dae"; }

  /// Takes Collada's own unit out of the root, where another one is to hold.
  void undo_unit(AffineMap& map) const {
    if (!is_collada() || !input_.options.override_unit || !(input_.options.metres > 0)) return;
    const aiMatrix4x4& root = scene_.mRootNode->mTransformation;
    const double unit = std::hypot(root.a1, root.b1, root.c1);
    for (std::size_t i = 0; i < 12 && unit > 0; ++i) map[i] /= unit;
  }

  /// A picture's file; empty, and counted, where it is not there, or may not be read.
  fs::path file_of(const std::string& name) {
    const fs::path plain = fs::path(name).lexically_normal();
    const bool leaves = plain.is_absolute() || (!plain.empty() && *plain.begin() == "..");
    const bool allowed = !leaves || input_.options.outside;
    // One that may not be read may have a copy beside the file.
    fs::path file = finder_.find(folder_ / (allowed ? plain : plain.filename()), input_.file);
    std::error_code error;
    if (is_picture_file(file)) return file;
    if (!allowed && fs::is_regular_file(folder_ / plain, error)) {
      if (outside_++ == 0) first_outside_ = name;
    } else if (missing_++ == 0) {
      first_missing_ = name;
    }
    return {};
  }

  /// Metres a unit of the positions that Assimp gives; 0: not known.
  double metres() const {
    float centimetres = 0;
    if (scene_.mMetaData != nullptr && scene_.mMetaData->Get("UnitScaleFactor", centimetres) &&
        centimetres > 0 && std::isfinite(centimetres)) {
      // As many digits as were written: 2.54 is no float.
      char text[32];
      std::snprintf(text, sizeof text, "%.7g", double{centimetres});
      return std::strtod(text, nullptr) / 100;
    }
    return is_collada() ? 1 : 0;  // Assimp turns Collada's to metres
  }

  void warn() const {
    if (skinned_ != 0) {
      input_.warn("skinned",
                  "meshes with bones, " + std::to_string(skinned_) +
                      " in all, are read as stored, not as posed.",
                  skinned_);
    }
    if (dropped_normals_ != 0) {
      input_.warn(
          "normals-computed",
          std::to_string(dropped_normals_) +
              " of its meshes have no normals though the file has some: Assimp before 5.3 does not "
              "read those that are given by vertex. They are computed from the corners' "
              "angles, as Blender does, all smooth.",
          dropped_normals_);
    }
    if (dropped_uvs_ != 0) {
      input_.warn("uvs-left-out",
                  std::to_string(dropped_uvs_) +
                      " of its meshes have no UVs though the file has some: Assimp before 5.3 does "
                      "not read "
                      "those that are given by vertex. Export it as glTF where they matter.",
                  dropped_uvs_);
    }
    if (more_uvs_ != 0) {
      input_.warn("unused-properties",
                  "meshes with more than one set of UVs, " + std::to_string(more_uvs_) +
                      " in all: set " + std::to_string(uv_set_.value_or(0)) + " is read.",
                  more_uvs_);
    }
    if (missing_ != 0) {
      input_.warn("picture-missing",
                  counted(missing_, "picture") + " of materials, such as '" +
                      printable(first_missing_) +
                      "', cannot be found: the materials' numbers stand alone.",
                  missing_);
    }
    if (outside_ != 0) {
      input_.warn("picture-outside",
                  counted(outside_, "picture") + " of materials, such as '" +
                      printable(first_outside_) +
                      "', lie outside the folder of the file, and were not read: put them beside "
                      "it, or allow it (--allow-outside).",
                  outside_);
    }
    if (placed_ != 0) {
      input_.warn("texture-options",
                  counted(placed_, "picture") + " of materials, such as '" +
                      printable(first_placed_) +
                      "', would be moved, turned or scaled in a way that programs read "
                      "differently: that is left out. Export glTF, or apply it to the UVs.",
                  placed_);
    }
  }

  const MeshInput& input_;
  const aiScene& scene_;
  MeshBuilder builder_;
  fs::path folder_;
  FileFinder finder_;
  bool has_normals_, has_uvs_;  // by any of an FBX's meshes
  Asset asset_;
  UniqueNames objects_, unique_materials_;
  std::map<unsigned, std::string> material_names_;
  std::map<std::string, unsigned> material_of_;
  std::map<const aiTexture*, std::shared_ptr<const std::vector<std::byte> > > embedded_;
  std::uint64_t skinned_ = 0, more_uvs_ = 0, placed_ = 0, missing_ = 0, outside_ = 0,
                dropped_normals_ = 0, dropped_uvs_ = 0;
  std::string first_missing_, first_outside_, first_placed_;
  std::optional<unsigned> uv_set_;  // that is read
  std::set<std::string> uv_sets_;   // that there are, in words
};

/// Assimp's scene of a file, which the importer keeps; nullptr: none. \param said  out: then why
const aiScene* read_scene(const MeshInput& input, Assimp::Importer& importer, std::string& said) {
  std::string hint = fs::path(input.file).extension().string();
  if (!hint.empty()) hint.erase(0, 1);
  importer.SetIOHandler(new NoFiles);  // the importer's own
  // Names and transforms of nodes as they are, not of a chain of made-up ones.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_ANIMATIONS, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_USE_COLLADA_NAMES, true);  // not ids
  if (input.options.override_up && input.options.up != UpAxis::as_given) {
    importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  }
  const aiScene* scene = nullptr;
  try {
    scene = importer.ReadFileFromMemory(input.bytes.data(), input.bytes.size(), 0, hint.c_str());
    if (scene == nullptr) said = importer.GetErrorString();
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    said = error.what();
  }
  while (!said.empty() && (said.back() == '.' || said.back() == '\n')) said.pop_back();
  // It quotes the file.
  std::replace_if(
      said.begin(), said.end(), [](unsigned char c) { return c < 32 || c > 126; }, '?');
  said.resize(std::min<std::size_t>(said.size(), 300));
  if (scene == nullptr && said.empty()) said = "it does not say why";
  return scene;
}

/// Assimp crashes on damaged files, or takes all there is: a child of this process reads each first, and what ends
/// it is an error. Costs the time of reading again. Where no child can be made, there is no such care.
void try_in_child(const MeshInput& input, const std::string& remedy) {
  const std::uint64_t bytes = input.bytes.size();
  // Ten times what real files take.
  const ChildLimits limits = {.seconds = 30 + 2 * (bytes >> 20U),
                              .bytes = (std::uint64_t{1} << 30U) + 200 * bytes};
  std::string said;
  const auto read = [&input] {
    Assimp::Importer importer;
    std::string problem;
    read_scene(input, importer, problem);
    return problem;
  };
  const ChildEnd end = run_in_child(limits, read, said);
  if (end == ChildEnd::slow || end == ChildEnd::crashed) {
    input.fail(
        "",
        std::string("Assimp ") +
            (end == ChildEnd::slow ? "takes too long to read it" : "crashes where it reads it") +
            ": the file is damaged, or of a kind that Assimp does not know",
        remedy);
  }
  if (!said.empty()) input.fail("", "Assimp could not read it: " + said, remedy);
}

}  // namespace

Asset read_by_assimp(const MeshInput& input) {
  const std::string remedy = "Export the mesh again, or as OBJ or glTF.";
  try_in_child(input, remedy);
  Assimp::Importer importer;
  std::string said;
  const aiScene* const scene = read_scene(input, importer, said);
  if (scene == nullptr) input.fail("", "Assimp could not read it: " + said, remedy);
  if (scene->mRootNode == nullptr) input.fail("", "it has no scene", remedy);
  Asset asset = SceneReader(input, *scene).read();
  asset.mesh.material_files = {fs::path(input.file).filename().string()};  // it describes its own
  return asset;
}

}  // namespace kiln
#endif
