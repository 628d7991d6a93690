#include "asset/assimp.h"

#ifndef KILN_HAS_ASSIMP
namespace kiln {

Asset read_by_assimp(const MeshInput& input) {
  input.fail("", "this build of Kiln does not include Assimp, which reads DAE, 3DS and X",
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
#include <limits>
#include <map>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "asset/axes.h"
#include "asset/hierarchy.h"
#include "asset/mesh_builder.h"
#include "asset/scene_parts.h"
#include "asset/smoothing_3ds.h"
#include "base/child.h"
#include "base/counted.h"
#include "base/disjoint_sets.h"
#include "base/lower_case.h"
#include "io/file/text_scanner.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

/// Refuses to open files. The input is in memory, and names that it contains must not give access
/// to other files.
class RejectFileAccess : public Assimp::IOSystem {
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

class SceneReader {
 public:
  SceneReader(const MeshInput& input, const aiScene& scene)
      : input_(input), scene_(scene), builder_(input), uv_sets_(input), pictures_(input) {}

  Asset read() {
    LoadMeshOptions options = input_.options;
    if (is_x() && options.override_up) options.up = convert_x_up_axis(options.up);
    const WorldFrame world = world_frame(options, kIdentityMap, metres());
    AffineMap to_world = world.map.value_or(kIdentityMap);
    remove_unit(to_world);
    if (is_3ds() && options.override_up && options.up != UpAxis::as_given) {
      // Undoes the rotation by which Assimp converted Z up to Y up
      to_world = product(to_world, rotation_to_y_up(UpAxis::minus_z));
    }
    add_nodes(to_world);
    if (is_3ds()) find_smooth_pieces();
    number_uv_sets();
    for (const PlacedMesh& placed_mesh : placed_meshes_) {
      builder_.set_object(placed_mesh.object);
      for (unsigned i = 0; i < placed_mesh.node->mNumMeshes; ++i) {
        add_mesh(placed_mesh.node->mMeshes[i], placed_mesh.world);
      }
    }
    if (ambiguous_groups_ != 0) {
      input_.warn("smoothing-groups",
                  counted(ambiguous_groups_, "mesh", "meshes") +
                      " with ambiguous smoothing groups: these are ignored, and normals are "
                      "computed. Export "
                      "the mesh with normals, as OBJ or FBX.",
                  ambiguous_groups_);
    }
    if (unresolved_skins_ != 0) {
      input_.warn("skinned",
                  counted(unresolved_skins_, "skinned mesh", "skinned meshes") +
                      ": read as stored, not posed, because a joint is missing or its name is not "
                      "unique. Export glTF or FBX.",
                  unresolved_skins_);
    }
    uv_sets_.check();
    builder_.is_placed = true;
    asset_.mesh = builder_.finish();
    materials();
    asset_.mesh.metres = world.metres;
    asset_.mesh.uv_set = uv_sets_.chosen();
    pictures_.warn();
    return std::move(asset_);
  }

 private:
  [[noreturn]] void fail(const std::string& place, const std::string& problem) const {
    input_.fail(place, problem, "Export the mesh again, or as OBJ or glTF.");
  }

  /// Adds the nodes in the order of the file, parents before children.
  void add_nodes(const AffineMap& to_world) {
    struct Visit {
      const aiNode* node;
      std::uint32_t parent;
      AffineMap parent_to_world;
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
      const AffineMap world = product(visit.parent_to_world, node.transform);
      if (visit.node->mNumMeshes != 0) {
        for (unsigned i = 0; i < visit.node->mNumMeshes; ++i) {
          if (visit.node->mMeshes[i] >= scene_.mNumMeshes) fail(node.name, "it refers to no mesh");
        }
        placed_meshes_.push_back(
            {visit.node, objects_.add(node.name.empty() ? "object" : node.name), world});
        asset_.object_nodes.push_back(index);
      }
      const auto [joint, added] = joints_.emplace(node.name, world);
      if (!added) joint->second.reset();
      for (unsigned i = visit.node->mNumChildren; i-- > 0;) {
        open.push_back({visit.node->mChildren[i], index, world});
      }
    }
  }

  /// Computes linear blend skinning. The transform of a vertex is the weighted mean of those of its
  /// joints, regardless of the node of its mesh; a joint's own transform is multiplied by its
  /// offset, which is the inverse bind matrix times the bind shape. Vertices without weights use
  /// the transform of the node.
  /// \returns a transform per vertex; empty if the mesh has no bones, or if one of their joints
  ///   does not exist
  std::vector<AffineMap> pose_vertices(const aiMesh& mesh, const AffineMap& world) {
    if (mesh.mNumBones == 0) return {};
    std::vector<AffineMap> transforms(mesh.mNumVertices, AffineMap{});
    std::vector<double> weight_totals(mesh.mNumVertices);
    for (unsigned b = 0; b < mesh.mNumBones; ++b) {
      const aiBone& bone = *mesh.mBones[b];
      const auto joint = joints_.find(bone.mName.C_Str());
      if (joint == joints_.end() || !joint->second) {
        ++unresolved_skins_;
        return {};
      }
      const AffineMap map = product(*joint->second, transform_of(bone.mOffsetMatrix));
      for (unsigned i = 0; i < bone.mNumWeights; ++i) {
        const aiVertexWeight& weight = bone.mWeights[i];
        if (weight.mVertexId >= mesh.mNumVertices) fail(bone.mName.C_Str(), "it affects no vertex");
        if (!(weight.mWeight > 0)) continue;
        weight_totals[weight.mVertexId] += weight.mWeight;
        for (std::size_t k = 0; k < 16; ++k)
          transforms[weight.mVertexId][k] += weight.mWeight * map[k];
      }
    }
    for (std::size_t v = 0; v < transforms.size(); ++v) {
      if (!(weight_totals[v] > 0)) transforms[v] = world;
      for (double& value : transforms[v]) value /= weight_totals[v] > 0 ? weight_totals[v] : 1;
    }
    return transforms;
  }

  /// Merges corners with equal position and colour into one vertex, since Assimp gives each corner
  /// its own vertex.
  /// \param poses  a transform per vertex; empty: that of the node for all
  std::vector<std::uint32_t> add_vertices(const aiMesh& mesh, const AffineMap& node_to_world,
                                          const std::vector<AffineMap>& poses) {
    using Key = std::array<std::uint64_t, 4>;
    std::map<Key, std::uint32_t> vertex_of_key;
    std::vector<std::uint32_t> merged_vertex(mesh.mNumVertices);
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D& p = mesh.mVertices[v];
      const AffineMap& world = poses.empty() ? node_to_world : poses[v];
      MeshBuilder::Position place{};
      Key key{};
      for (std::size_t i = 0; i < 3; ++i) {
        place[i] = world[i] * p.x + world[4 + i] * p.y + world[8 + i] * p.z + world[12 + i];
        key[i] = std::bit_cast<std::uint64_t>(place[i] + 0.0);  // Adding 0 turns -0 into 0
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
          vertex_of_key.emplace(key, static_cast<std::uint32_t>(builder_.positions.size()));
      merged_vertex[v] = entry->second;
      if (!added) continue;
      builder_.positions.push_back(place);
      if (mesh.HasVertexColors(0)) builder_.set_color_bytes(builder_.positions.size() - 1, color);
    }
    return merged_vertex;
  }

  /// Finds the smooth pieces of a 3DS by the smoothing groups in the file. Assimp would turn these
  /// into area-weighted normals, and would smooth everything in a file without groups. Here, a mesh
  /// without groups has no normals. Vertices at the same position count as one.
  void find_smooth_pieces() {
    pieces_.resize(scene_.mNumMeshes);
    const std::vector<Smoothing3ds> meshes = read_smoothing_3ds(input_.bytes);
    // For each mesh of the file, Assimp's meshes, of which there is one per material
    std::vector<std::vector<unsigned> > parts(meshes.size());
    for (unsigned m = 0; m < scene_.mNumMeshes; ++m) {
      // The name that Assimp gives to a 3DS mesh is its index in the file.
      const auto number = to_integer(scene_.mMeshes[m]->mName.C_Str());
      if (!number || *number < 0 || static_cast<std::uint64_t>(*number) >= meshes.size()) continue;
      pieces_[m].mesh = static_cast<std::uint32_t>(*number);
      parts[pieces_[m].mesh].push_back(m);
    }
    for (std::size_t i = 0; i < meshes.size(); ++i) {
      const std::vector<std::uint32_t>& masks = meshes[i].masks;
      if (std::all_of(masks.begin(), masks.end(), [](auto mask) { return mask == 0; })) continue;
      std::vector<Part3ds> part_descriptions;
      for (const unsigned m : parts[i]) {
        const aiMesh& part = *scene_.mMeshes[m];
        if (part.mMaterialIndex >= scene_.mNumMaterials) fail(part.mName.C_Str(), "no material");
        part_descriptions.push_back(
            {scene_.mMaterials[part.mMaterialIndex]->GetName().C_Str(), part.mNumFaces});
      }
      if (const auto masks_by_part = masks_of_parts(meshes[i], part_descriptions)) {
        join_smooth_pieces(parts[i], *masks_by_part);
      } else {
        ++ambiguous_groups_;
      }
    }
  }

  /// Joins the corners of a mesh of the file to smooth pieces.
  /// \param parts  Assimp's meshes that together form the mesh
  /// \param masks  for each of them, the smoothing mask of each face
  void join_smooth_pieces(const std::vector<unsigned>& parts,
                          const std::vector<std::vector<std::uint32_t> >& masks) {
    using PositionKey = std::array<std::uint64_t, 3>;
    std::map<PositionKey, std::uint32_t> places;
    std::vector<std::array<std::uint32_t, 2> > corners;  // Pairs of vertex and corner
    std::vector<std::uint32_t> corner_masks;             // Smoothing mask of each corner's face
    std::vector<std::uint32_t> first;                    // Index of the first corner of each part
    for (std::size_t p = 0; p < parts.size(); ++p) {
      const aiMesh& part = *scene_.mMeshes[parts[p]];
      first.push_back(static_cast<std::uint32_t>(corner_masks.size()));
      corner_masks.resize(corner_masks.size() + part.mNumVertices, 0);
      for (unsigned f = 0; f < part.mNumFaces; ++f) {
        const aiFace& face = part.mFaces[f];
        for (unsigned k = 0; k < face.mNumIndices; ++k) {
          const unsigned v = face.mIndices[k];
          if (v >= part.mNumVertices) continue;  // add_mesh() reports the invalid index
          const aiVector3D& at = part.mVertices[v];
          PositionKey place{};
          for (unsigned i = 0; i < 3; ++i) {
            place[i] = std::bit_cast<std::uint64_t>(at[i] + 0.0);  // Adding 0 turns -0 into 0
          }
          const std::uint32_t corner = first[p] + v;
          corner_masks[corner] = masks[p][f];
          corners.push_back(
              {places.emplace(place, static_cast<std::uint32_t>(places.size())).first->second,
               corner});
        }
      }
    }
    DisjointSets pieces(corner_masks.size());
    join_by_groups(std::move(corners), corner_masks, pieces);
    for (std::size_t p = 0; p < parts.size(); ++p) {
      std::vector<std::uint32_t>& pieces_of_vertex = pieces_[parts[p]].piece_of_vertex;
      for (unsigned v = 0; v < scene_.mMeshes[parts[p]]->mNumVertices; ++v) {
        pieces_of_vertex.push_back(pieces.find(first[p] + v));
      }
    }
  }

  /// Index of the builder's normal at each corner of a mesh, from smoothing groups; empty if the
  /// mesh has no groups.
  std::vector<std::uint32_t> smooth_normals(unsigned index) {
    if (pieces_.empty() || pieces_[index].piece_of_vertex.empty()) return {};
    SmoothPieces& pieces = pieces_[index];
    // The parts of a mesh have the same transform, so they share normals where they touch.
    std::map<std::uint32_t, std::uint32_t>& normal_of_piece =
        piece_normals_[{pieces.mesh, pieces.times_placed++}];
    std::vector<std::uint32_t> normals;
    for (const std::uint32_t piece : pieces.piece_of_vertex) {
      const auto [entry, added] = normal_of_piece.emplace(piece, 0U);
      if (added) entry->second = builder_.add_computed_normal();
      normals.push_back(entry->second);
    }
    return normals;
  }

  void add_mesh(unsigned index, const AffineMap& world) {
    const aiMesh& mesh = *scene_.mMeshes[index];
    if (mesh.mNumFaces == 0 || mesh.mVertices == nullptr) return;
    const std::optional<unsigned> uv_set = uv_set_of(mesh);
    builder_.set_material(material_name(mesh.mMaterialIndex));
    const std::vector<AffineMap> vertex_transforms = pose_vertices(mesh, world);
    const std::vector<std::uint32_t> vertex_of = add_vertices(mesh, world, vertex_transforms);
    const auto first_uv = static_cast<std::uint32_t>(builder_.uvs.size());
    const auto first_normal = static_cast<std::uint32_t>(builder_.normals.size());
    const NormalTransform node_normals_to_world(world);
    std::vector<NormalTransform> normal_transforms(vertex_transforms.begin(),
                                                   vertex_transforms.end());
    const auto normal_transform_of = [&](unsigned v) -> const NormalTransform& {
      return normal_transforms.empty() ? node_normals_to_world : normal_transforms[v];
    };
    const auto has_channel = [&mesh](const UvSet& set) { return mesh.HasTextureCoords(set.set); };
    const bool uvs = uv_set.has_value() ||
                     std::any_of(builder_.other_uvs.begin(), builder_.other_uvs.end(), has_channel);
    const auto uv_of = [&mesh](std::optional<unsigned> set, unsigned v) {
      constexpr float kMissingUv = std::numeric_limits<float>::quiet_NaN();
      if (!set || !mesh.HasTextureCoords(*set)) return Vec2{kMissingUv, kMissingUv};
      const aiVector3D& uv = mesh.mTextureCoords[*set][v];
      return Vec2{uv.x, uv.y};
    };
    const std::vector<std::uint32_t> smooth = smooth_normals(index);
    const bool own_normals = mesh.HasNormals() && !is_3ds();
    const bool normals = own_normals || !smooth.empty();
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      if (uvs) {
        builder_.uvs.push_back(uv_of(uv_set, v));
        for (UvSet& set : builder_.other_uvs) set.uvs.push_back(uv_of(set.set, v));
      }
      if (own_normals) {
        const aiVector3D& n = mesh.mNormals[v];
        builder_.normals.push_back(normal_transform_of(v)(n.x, n.y, n.z));
      }
    }
    std::vector<std::uint32_t> corners, corner_uvs, corner_normals;
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      corners.clear();
      corner_uvs.clear();
      corner_normals.clear();
      const bool mirrored = face.mNumIndices != 0 && face.mIndices[0] < mesh.mNumVertices &&
                            normal_transform_of(face.mIndices[0]).mirrors();
      for (unsigned i = 0; i < face.mNumIndices; ++i) {
        const unsigned v = face.mIndices[i];
        if (v >= mesh.mNumVertices) {
          fail("mesh \"" + printable(mesh.mName.C_Str()) + "\", face " + std::to_string(f),
               "it refers to vertex " + std::to_string(v) + ", but the mesh has only " +
                   std::to_string(mesh.mNumVertices));
        }
        corners.push_back(vertex_of[v]);
        if (uvs) corner_uvs.push_back(first_uv + v);
        if (normals) corner_normals.push_back(own_normals ? first_normal + v : smooth[v]);
      }
      builder_.add_face(corners, corner_uvs, corner_normals, mirrored);
    }
  }

  static std::vector<std::string> uv_set_names(const aiMesh& mesh) {
    std::vector<std::string> names;
    for (unsigned set = 0; set < mesh.GetNumUVChannels(); ++set) {
      const aiString* const set_name = mesh.GetTextureCoordsName(set);
      names.emplace_back(set_name == nullptr ? "" : set_name->C_Str());
    }
    return names;
  }

  /// Assigns numbers to the UV sets that pictures use, except for the set with which the mesh is
  /// read.
  void number_uv_sets() {
    std::set<unsigned> other_sets;
    std::optional<unsigned> read;
    for (const PlacedMesh& placed_mesh : placed_meshes_) {
      for (unsigned i = 0; i < placed_mesh.node->mNumMeshes; ++i) {
        const aiMesh& mesh = *scene_.mMeshes[placed_mesh.node->mMeshes[i]];
        const std::optional<unsigned> chosen_set = uv_sets_.find(uv_set_names(mesh));
        if (!read) read = chosen_set;
        // add_mesh() reports the invalid index
        if (mesh.mMaterialIndex >= scene_.mNumMaterials) continue;
        const aiMaterial& material = *scene_.mMaterials[mesh.mMaterialIndex];
        for (int kind = aiTextureType_DIFFUSE; kind <= AI_TEXTURE_TYPE_MAX; ++kind) {
          aiString path;
          unsigned set = 0;
          if (material.GetTexture(static_cast<aiTextureType>(kind), 0, &path, nullptr, &set) !=
              AI_SUCCESS) {
            continue;
          }
          if (chosen_set != set && mesh.HasTextureCoords(set)) other_sets.insert(set);
        }
      }
    }
    other_sets.erase(read.value_or(0));
    for (const unsigned set : other_sets) builder_.other_uvs.push_back({set, {}});
  }

  /// The channel of UVs that is the requested set, if the mesh has that set.
  std::optional<unsigned> uv_set_of(const aiMesh& mesh) {
    return uv_sets_.choose(uv_set_names(mesh));
  }

  const std::string& material_name(unsigned index) {
    if (index >= scene_.mNumMaterials) fail("material " + std::to_string(index), "it is missing");
    std::string& name = material_names_[index];
    if (name.empty()) {
      const std::string material_name = scene_.mMaterials[index]->GetName().C_Str();
      name = unique_materials_.add(material_name.empty() ? "material" : material_name);
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
      const aiMaterial& source_material = *scene_.mMaterials[found->second];
      material.place = input_.file + ": material " + std::to_string(found->second);
      color(source_material, material);
      if (source_material.Get(AI_MATKEY_OPACITY, material.opacity) != AI_SUCCESS)
        material.opacity = 1;
      if (source_material.Get(AI_MATKEY_ROUGHNESS_FACTOR, material.roughness) == AI_SUCCESS) {
        // Assimp converts the shininess of Phong's model to roughness as Blender does, 1 -
        // sqrt(shininess) / 10, but without limits.
        float shininess = 0;
        const bool has_shininess =
            source_material.Get(AI_MATKEY_SHININESS, shininess) == AI_SUCCESS;
        material.roughness = std::clamp(material.roughness, 0.0F, 1.0F);
        material.roughness_from = has_shininess ? MaterialNumber::converted : MaterialNumber::given;
      }
      if (source_material.Get(AI_MATKEY_METALLIC_FACTOR, material.metallic) == AI_SUCCESS) {
        material.metallic_from = MaterialNumber::given;
      }
      aiColor3D emission;
      if (source_material.Get(AI_MATKEY_COLOR_EMISSIVE, emission) == AI_SUCCESS) {
        material.emission = {emission.r, emission.g, emission.b};
        material.emission_from = MaterialNumber::given;
      }
      material.color_map =
          picture(source_material, {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE});
      material.opacity_map = picture(source_material, {aiTextureType_OPACITY});
      material.normal_map =
          picture(source_material,
                  {aiTextureType_NORMALS, aiTextureType_NORMAL_CAMERA, aiTextureType_HEIGHT});
      material.roughness_map = picture(source_material, {aiTextureType_DIFFUSE_ROUGHNESS});
      material.metallic_map = picture(source_material, {aiTextureType_METALNESS});
      material.emission_map =
          picture(source_material, {aiTextureType_EMISSION_COLOR, aiTextureType_EMISSIVE});
      material.occlusion_map = picture(source_material, {aiTextureType_AMBIENT_OCCLUSION});
    }
  }

  static void color(const aiMaterial& from, Material& material) {
    aiColor4D base_color;
    aiColor3D diffuse;
    if (from.Get(AI_MATKEY_BASE_COLOR, base_color) == AI_SUCCESS) {
      material.color = {base_color.r, base_color.g, base_color.b};
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

  /// The picture of the first of these texture types that the material has.
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
      // If the height is 0, the bytes are an encoded file of `width` bytes; otherwise they are raw
      // texels.
      if (embedded != nullptr && embedded->mHeight == 0) {
        const auto* const bytes = reinterpret_cast<const std::byte*>(embedded->pcData);
        std::shared_ptr<const std::vector<std::byte> >& shared = embedded_[embedded];
        if (shared == nullptr) {
          shared = std::make_shared<const std::vector<std::byte> >(bytes, bytes + embedded->mWidth);
        }
        picture.bytes = shared;
        picture.file = name.starts_with('*') ? "picture " + name.substr(1) : name;
      } else {
        picture.file = pictures_.find(name);
        if (picture.file.empty()) {
          pictures_.count_missing(name);
          return {};
        }
      }
      picture.wrap = {wrap_of(from, AI_MATKEY_MAPPINGMODE_U(kind, 0)),
                      wrap_of(from, AI_MATKEY_MAPPINGMODE_V(kind, 0))};
      aiUVTransform placement;
      if (from.Get(AI_MATKEY_UVTRANSFORM(kind, 0), placement) == AI_SUCCESS) {
        pictures_.set_transform(
            picture, placement.mScaling.x, placement.mScaling.y,
            placement.mTranslation != aiVector2D(0, 0) || placement.mRotation != 0, false);
      }
      break;
    }
    return picture;
  }

  bool is_collada() const { return lower_extension(input_.file) == ".dae"; }
  bool is_3ds() const { return lower_extension(input_.file) == ".3ds"; }
  bool is_x() const { return lower_extension(input_.file) == ".x"; }

  /// X files are left-handed. Assimp mirrors them along Z, so the file's Z axis is -Z in the
  /// resulting positions.
  static UpAxis convert_x_up_axis(UpAxis up) {
    return up == UpAxis::z ? UpAxis::minus_z : up == UpAxis::minus_z ? UpAxis::z : up;
  }

  /// Removes Collada's unit from a root node's transform, if an option overrides the unit.
  void remove_unit(AffineMap& map) const {
    if (!is_collada() || !input_.options.override_unit || !(input_.options.metres > 0)) return;
    const aiMatrix4x4& root = scene_.mRootNode->mTransformation;
    const double unit = std::hypot(root.a1, root.b1, root.c1);
    for (std::size_t i = 0; i < 12 && unit > 0; ++i) map[i] /= unit;
  }

  /// Metres per unit of the positions that Assimp returns; 0: unknown.
  double metres() const { return is_collada() ? 1 : 0; }  // Assimp converts Collada to metres

  const MeshInput& input_;
  const aiScene& scene_;
  MeshBuilder builder_;
  UvSetChoice uv_sets_;
  ScenePictures pictures_;
  Asset asset_;
  struct PlacedMesh {
    const aiNode* node;
    std::string object;
    AffineMap world;
  };
  std::vector<PlacedMesh> placed_meshes_;  // Nodes that have meshes, in the order of the file
  // Transforms of nodes, by the nodes' names; nullopt if several nodes have the name
  std::map<std::string, std::optional<AffineMap> > joints_;
  struct SmoothPieces {
    std::uint32_t mesh = 0;  // index of the mesh in the file
    std::uint32_t times_placed = 0;
    // For each vertex, the index of its normal; empty if the mesh has no smoothing groups
    std::vector<std::uint32_t> piece_of_vertex;
  };
  // For each mesh of Assimp, its smooth pieces; empty if the file is no 3DS
  std::vector<SmoothPieces> pieces_;
  std::map<std::array<std::uint32_t, 2>, std::map<std::uint32_t, std::uint32_t> > piece_normals_;
  std::uint64_t unresolved_skins_ = 0, ambiguous_groups_ = 0;
  UniqueNames objects_, unique_materials_;
  std::map<unsigned, std::string> material_names_;
  std::map<std::string, unsigned> material_of_;
  std::map<const aiTexture*, std::shared_ptr<const std::vector<std::byte> > > embedded_;
};

/// Reads the scene by Assimp. The importer owns it.
/// \param said  [out] the reason of a failure
/// \returns null on failure
const aiScene* read_scene(const MeshInput& input, Assimp::Importer& importer, std::string& reason) {
  std::string hint = fs::path(input.file).extension().string();
  if (!hint.empty()) hint.erase(0, 1);
  importer.SetIOHandler(new RejectFileAccess);  // the importer owns the handler
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_USE_COLLADA_NAMES, true);
  if (input.options.override_up && input.options.up != UpAxis::as_given) {
    importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  }
  const aiScene* scene = nullptr;
  try {
    scene = importer.ReadFileFromMemory(input.bytes.data(), input.bytes.size(), 0, hint.c_str());
    if (scene == nullptr) reason = importer.GetErrorString();
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    reason = error.what();
  }
  while (!reason.empty() && (reason.back() == '.' || reason.back() == '\n')) reason.pop_back();
  // The message quotes the file, so it may contain control characters.
  std::replace_if(
      reason.begin(), reason.end(), [](unsigned char c) { return c < 32 || c > 126; }, '?');
  reason.resize(std::min<std::size_t>(reason.size(), 300));
  if (scene == nullptr && reason.empty()) reason = "no reason is given";
  return scene;
}

/// Reads the file in a child process first, since a damaged file may crash Assimp or exhaust
/// memory. Throws an error if the child fails. This doubles the time of reading. If no child
/// process can be created, the check is skipped.
void check_in_child(const MeshInput& input, const Message& remedy) {
  const std::uint64_t bytes = input.bytes.size();
  // The child gets ten times the time and memory that real files need.
  const ChildLimits limits = {.seconds = 30 + 2 * (bytes >> 20U),
                              .bytes = (std::uint64_t{1} << 30U) + 200 * bytes};
  std::string reason;
  const auto read = [&input] {
    Assimp::Importer importer;
    std::string problem;
    read_scene(input, importer, problem);
    return problem;
  };
  const ChildEnd end = run_in_child(limits, read, reason);
  if (end == ChildEnd::timed_out || end == ChildEnd::crashed) {
    input.fail("",
               std::string("Assimp ") +
                   (end == ChildEnd::timed_out ? "takes too long to read it"
                                               : "crashes while reading it") +
                   ": the file is damaged, or Assimp does not support it",
               remedy);
  }
  if (!reason.empty()) input.fail("", "Assimp could not read it: " + reason, remedy);
}

}  // namespace

Asset read_by_assimp(const MeshInput& input) {
  const std::string remedy = "Export the mesh again, or as OBJ or glTF.";
  check_in_child(input, remedy);
  Assimp::Importer importer;
  std::string reason;
  const aiScene* const scene = read_scene(input, importer, reason);
  if (scene == nullptr) input.fail("", "Assimp could not read it: " + reason, remedy);
  if (scene->mRootNode == nullptr) input.fail("", "it has no scene", remedy);
  Asset asset = SceneReader(input, *scene).read();
  // The materials are in the file itself, see has_own_materials()
  asset.mesh.material_files = {fs::path(input.file).filename().string()};
  return asset;
}

}  // namespace kiln
#endif
