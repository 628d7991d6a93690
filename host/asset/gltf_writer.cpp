// Writes glTF 2.0: one binary file, or JSON with a separate buffer and pictures.
#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <unordered_map>
#include <vector>

#include "asset/gltf_draco_write.h"
#include "asset/gltf_pictures.h"
#include "asset/hierarchy.h"
#include "base/fnv.h"
#include "base/json_depth.h"
#include "base/lower_case.h"
#include "base/srgb.h"
#include "io/image/picture.h"
#include "kiln/asset.h"
#include "kiln/files.h"
#include "kiln/version.h"
#include "mesh/frame.h"
#include "mesh/index_width.h"
#include "mesh/low_surface.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// Numeric constants of the glTF specification.
constexpr int kInt16 = 5122, kUint16 = 5123, kUint32 = 5125, kFloat32 = 5126, kVertices = 34962,
              kIndices = 34963;
constexpr int kLinear = 9729, kLinearMips = 9987, kRepeat = 10497;
constexpr std::uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

constexpr const char* kTextureWebp = "EXT_texture_webp";
constexpr const char* kMeshopt = "EXT_meshopt_compression";
constexpr const char* kDracoExtension = "KHR_draco_mesh_compression";
constexpr const char* kQuantization = "KHR_mesh_quantization";
constexpr const char* kLevels = "MSFT_lod";
constexpr const char* kCoverages = "MSFT_screencoverage";

constexpr AffineMap kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

[[noreturn]] void fail_usage(const std::string& what) {
  throw Error(ErrorCode::usage, "save_asset(): " + what);
}

Json parse_extras(const std::string& text, const char* of) {
  if (is_nested_too_deep(text)) {
    fail_usage(std::string("the extras of ") + of + " are nested more than " +
               std::to_string(kMaxJsonDepth) + " levels deep.");
  }
  Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) fail_usage(std::string("the extras of ") + of + " are not valid JSON.");
  return json;
}

/// A vertex of the output. Vertices whose bits are equal are merged.
struct Vertex {
  std::array<float, 12> values;  // Position, normal, tangent with the sign of the bitangent, UV
  std::array<std::uint8_t, 4> color;  // In sRGB, as in Mesh

  bool operator==(const Vertex& other) const {
    return std::memcmp(values.data(), other.values.data(), sizeof values) == 0 &&
           color == other.color;
  }
};
struct VertexHash {
  std::size_t operator()(const Vertex& vertex) const {
    Fnv1a hash;
    for (const float value : vertex.values) hash.add(std::bit_cast<std::uint32_t>(value));
    hash.add(std::bit_cast<std::uint32_t>(vertex.color));
    return static_cast<std::size_t>(hash.value);
  }
};

/// The vertices and indices of a primitive.
struct Part {
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;
  std::unordered_map<Vertex, std::uint32_t, VertexHash> known;

  void add(const Vertex& vertex) {
    const auto [entry, added] = known.emplace(vertex, static_cast<std::uint32_t>(vertices.size()));
    if (added) vertices.push_back(vertex);
    indices.push_back(entry->second);
  }
};

/// The transform from the world to an object's space. It does not mirror.
struct WorldToObject {
  std::array<double, 3> origin{};  // Origin of the mesh's positions in the world
  // Rows of the inverse transform
  std::array<Vec3d, 3> rows{Vec3d(1, 0, 0), Vec3d(0, 1, 0), Vec3d(0, 0, 1)};
  Vec3d translation{};                  // Translation of the transform
  std::array<Vec3d, 3> columns = rows;  // Columns of the transform

  Vec3 place(const Vec3& p) const {
    const Vec3d relative = to_double(p) + Vec3d(origin[0], origin[1], origin[2]) - translation;
    return to_float({dot(rows[0], relative), dot(rows[1], relative), dot(rows[2], relative)});
  }
  /// Normals are multiplied by the transposed transform.
  Vec3 normal(const Vec3& n) const {
    const Vec3d world_normal = to_double(n);
    return unit({dot(columns[0], world_normal), dot(columns[1], world_normal),
                 dot(columns[2], world_normal)});
  }
  Vec3 tangent(const Vec3& t) const {
    const Vec3d world_tangent = to_double(t);
    return unit(
        {dot(rows[0], world_tangent), dot(rows[1], world_tangent), dot(rows[2], world_tangent)});
  }
  static Vec3 unit(const Vec3d& v) { return to_float(v * (1 / length(v))); }
};

double determinant(const AffineMap& m) {
  return dot(Vec3d(m[0], m[1], m[2]), cross(Vec3d(m[4], m[5], m[6]), Vec3d(m[8], m[9], m[10])));
}

/// Inverts a transform that does not mirror.
/// \returns false if it is singular, or if values exceed the range of floats
bool invert(const AffineMap& m, double reach, WorldToObject& to_object) {
  constexpr double kMinVolumeRatio = 1e-9;
  const Vec3d x(m[0], m[1], m[2]), y(m[4], m[5], m[6]), z(m[8], m[9], m[10]);
  const double size = determinant(m);
  if (!(size > kMinVolumeRatio * length(x) * length(y) * length(z))) return false;
  to_object.columns = {x, y, z};
  to_object.rows = {cross(y, z) * (1 / size), cross(z, x) * (1 / size), cross(x, y) * (1 / size)};
  to_object.translation = {m[12], m[13], m[14]};
  return std::all_of(to_object.rows.begin(), to_object.rows.end(), [&](const Vec3d& row) {
    const double largest = std::abs(row.x) + std::abs(row.y) + std::abs(row.z);
    return largest * (reach + length(to_object.translation)) <
           double{std::numeric_limits<float>::max()};
  });
}

/// The largest absolute value of the mesh's coordinates.
double max_coordinate_of(const Mesh& mesh) {
  double reach = 0;
  for (const Vec3& p : mesh.positions) {
    if (!is_finite(p)) continue;
    reach = std::max({reach, std::abs(mesh.origin[0] + p.x), std::abs(mesh.origin[1] + p.y),
                      std::abs(mesh.origin[2] + p.z)});
  }
  return reach;
}

/// The grid to which the positions of an object are quantised. Its cells are cubes, so that normals
/// need no other scale.
struct Grid {
  static constexpr double kMaxQuantized = 65535;
  std::array<double, 3> origin{};
  double step = 1;

  static Grid of(const std::vector<const Part*>& parts) {
    std::array<double, 3> low, high;
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
    for (const Part* const part : parts) {
      for (const Vertex& vertex : part->vertices) {
        for (std::size_t k = 0; k < 3; ++k) {
          low[k] = std::min(low[k], double{vertex.values[k]});
          high[k] = std::max(high[k], double{vertex.values[k]});
        }
      }
    }
    Grid grid{low, 0};
    for (std::size_t k = 0; k < 3; ++k)
      grid.step = std::max(grid.step, (high[k] - low[k]) / kMaxQuantized);
    return grid;
  }
  std::uint16_t rounded(double value, std::size_t axis) const {
    return static_cast<std::uint16_t>(
        std::clamp(std::floor((value - origin[axis]) / step + 0.5), 0.0, kMaxQuantized));
  }
};

/// The triangles of each object and material form a primitive. In a mesh with UVs, those without
/// UVs form separate ones.
struct PrimitiveKey {
  std::size_t object = 0, material = 0;
  bool lacks_uvs = false;
  auto operator<=>(const PrimitiveKey&) const = default;
};
using Primitives = std::map<PrimitiveKey, Part>;

/// The attributes of a primitive, besides positions and normals.
struct Attributes {
  bool has_uvs = false, has_tangents = false;
  const char* color_name = nullptr;  ///< Name of the attribute of vertex colours; null: none
};

/// True if primitives with this material need tangents, that is, if it has a normal map. A mesh
/// without any picture keeps its tangents, since it may be read again for a bake.
bool needs_tangents(const AssetMaterial& material) {
  const AssetPictures* const pictures = material.pictures.get();
  return pictures == nullptr || !pictures->normal.empty() ||
         (pictures->color.empty() && pictures->surface.empty() && pictures->emission.empty());
}

/// Splits a mesh into primitives.
/// \param locals  for each object, the transform to its space
/// \param materials  one for each material of the mesh, one for all, or none
Primitives primitives_of(const Mesh& low, const std::vector<WorldToObject>& to_objects,
                         std::span<const AssetMaterial> materials) {
  const bool one_material = materials.size() <= 1;
  std::vector<bool> tangents;
  for (const AssetMaterial& material : materials) tangents.push_back(needs_tangents(material));
  const bool has_layout = !low.uvs.empty();
  // Copy of a mesh without UVs, with placeholder UVs that are not written
  Mesh mesh_without_layout;
  if (!has_layout) {
    mesh_without_layout = low;
    mesh_without_layout.uvs = {{0, 0}, {1, 0}, {0, 1}};
    mesh_without_layout.uv_triangles.assign(low.triangles.size(), {0, 1, 2});
  }
  const LowSurface surface = LowSurface::of(has_layout ? low : mesh_without_layout, Frame::of(low));
  Primitives primitives;
  for (const std::size_t t : surface.usable_triangles()) {
    const std::size_t object = low.objects.empty() ? 0 : low.objects[t];
    const std::size_t material = one_material ? 0 : low.materials[t];
    const WorldToObject& to_object = to_objects[object];
    std::array<Vertex, 3> corners{};
    bool has_uvs = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const LowSurface::Corner& corner = surface.triangles[t][k];
      const std::uint32_t vertex = low.triangles[t][k];
      const Vec3 p = to_object.place(low.positions[vertex]),
                 normal = to_object.normal(corner.normal),
                 tangent = to_object.tangent(corner.tangent);
      // In glTF, v is 0 at the top of a picture. The bitangent still points up, along +Y of the
      // normal map.
      corners[k].values = {p.x + 0.0F, p.y + 0.0F,  p.z + 0.0F,         normal.x,
                           normal.y,   normal.z,    tangent.x,          tangent.y,
                           tangent.z,  corner.sign, corner.uv.x + 0.0F, 1 - corner.uv.y};
      if (!low.colors.empty()) corners[k].color = low.colors[vertex];
      has_uvs = has_uvs && std::isfinite(corner.uv.x) && std::isfinite(corner.uv.y);
    }
    if (!has_uvs || !has_layout) {
      for (Vertex& corner : corners) std::fill_n(&corner.values[6], 6, 0.0F);
    } else if (!tangents.empty() && !tangents[material]) {
      // Without tangents, vertices that differ in nothing else are merged.
      for (Vertex& corner : corners) std::fill_n(&corner.values[6], 4, 0.0F);
    }
    Part& part = primitives[{object, material, !has_uvs}];
    for (const Vertex& corner : corners) part.add(corner);
  }
  return primitives;
}

/// Encodes a file name as a URI.
std::string encode_uri(const std::string& name) {
  std::string uri;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    const bool is_unreserved = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') ||
                               (c >= 'A' && c <= 'Z') || std::strchr("-._~", c) != nullptr;
    if (is_unreserved && c != 0) {
      uri += c;
    } else {
      constexpr const char* kDigits = "0123456789ABCDEF";
      uri += {'%', kDigits[byte >> 4U], kDigits[byte & 15U]};
    }
  }
  return uri;
}

/// A file that is being built: its JSON and its buffer, and its pictures if they are separate
/// files.
class GltfOutput {
 public:
  explicit GltfOutput(const fs::path& path)
      : path_(path), is_text_(lower_extension(path) == ".gltf") {
    json_["asset"] = {{"version", "2.0"}, {"generator", "Kiln " + std::string(version())}};
    json_["scene"] = 0;
    json_["scenes"] = Json::array({Json{{"nodes", Json::array()}}});
    json_["nodes"] = Json::array();
  }

  Json& json() { return json_; }

  std::size_t add_node(Json node, std::size_t parent = kRoot) {
    Json& nodes = json_["nodes"];
    nodes.push_back(std::move(node));
    const std::size_t index = nodes.size() - 1;
    (parent == kRoot ? json_["scenes"][0]["nodes"] : nodes[parent]["children"]).push_back(index);
    return index;
  }
  static constexpr std::size_t kRoot = std::numeric_limits<std::size_t>::max();

  /// Adds a node that is listed neither by a scene nor by another node.
  /// \returns its index
  std::size_t add_detached_node(Json node) {
    json_["nodes"].push_back(std::move(node));
    return json_["nodes"].size() - 1;
  }

  /// Adds a primitive without compression.
  /// \param material  index of its material; kRoot: none
  Json add_primitive(const Part& part, std::size_t material, const Attributes& written) {
    Json attributes = {{"POSITION", add_values(part.vertices, 0, 3, "VEC3", true)},
                       {"NORMAL", add_values(part.vertices, 3, 3, "VEC3", false)}};
    if (written.has_tangents) {
      attributes["TANGENT"] = add_values(part.vertices, 6, 4, "VEC4", false);
    }
    if (written.has_uvs) {
      attributes["TEXCOORD_0"] = add_values(part.vertices, 10, 2, "VEC2", false);
    }
    if (written.color_name != nullptr) attributes[written.color_name] = add_colors(part.vertices);
    Json primitive = {{"attributes", std::move(attributes)},
                      {"indices", add_indices(part.indices, part.vertices.size())}};
    if (material != kRoot) primitive["material"] = material;
    return primitive;
  }

  /// Adds a primitive that meshopt compresses.
  /// \param grid  grid to which its positions are quantised
  Json add_meshopt_primitive(const Part& part, const Grid& grid, std::size_t material,
                             const Attributes& written) {
    use_extension(kMeshopt, true);
    use_extension(kQuantization, true);
    const std::size_t count = part.vertices.size();
    std::vector<std::uint32_t> indices(part.indices.size()), new_index_of_vertex(count);
    meshopt_optimizeVertexCache(indices.data(), part.indices.data(), indices.size(), count);
    meshopt_optimizeVertexFetchRemap(new_index_of_vertex.data(), indices.data(), indices.size(),
                                     count);
    std::vector<const Vertex*> vertices(count);
    for (std::size_t i = 0; i < count; ++i) vertices[new_index_of_vertex[i]] = &part.vertices[i];
    for (std::uint32_t& index : indices) index = new_index_of_vertex[index];

    // The stride of an attribute must be a multiple of 4 bytes
    constexpr std::size_t kPaddedValues = 4;
    std::vector<std::uint16_t> places(kPaddedValues * count, 0);
    std::array<std::uint16_t, 3> low{0xFFFF, 0xFFFF, 0xFFFF}, high{};
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint16_t place = grid.rounded(vertices[i]->values[k], k);
        places[kPaddedValues * i + k] = place;
        low[k] = std::min(low[k], place);
        high[k] = std::max(high[k], place);
      }
    }
    Json attributes;
    attributes["POSITION"] =
        add_accessor({{"bufferView", add_compressed_view(places, kPaddedValues * 2, nullptr)},
                      {"componentType", kUint16},
                      {"count", count},
                      {"type", "VEC3"},
                      {"min", low},
                      {"max", high}});
    attributes["NORMAL"] = add_directions(vertices, 3, 3);
    if (written.has_tangents) attributes["TANGENT"] = add_directions(vertices, 6, 4);
    if (written.has_uvs) attributes["TEXCOORD_0"] = add_packed_uvs(vertices);
    if (written.color_name != nullptr) {
      const std::vector<std::uint16_t> colors = colors_of(vertices);
      attributes[written.color_name] =
          add_accessor({{"bufferView", add_compressed_view(colors, 8, nullptr)},
                        {"componentType", kUint16},
                        {"normalized", true},
                        {"count", count},
                        {"type", "VEC4"}});
    }
    std::string packed(meshopt_encodeIndexBufferBound(indices.size(), count), '\0');
    packed.resize(meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(packed.data()),
                                            packed.size(), indices.data(), indices.size()));
    const bool has_16_bit_indices = fits_16_bit_indices(count);
    const std::size_t view = add_packed_view(
        packed, indices.size(), has_16_bit_indices ? sizeof(std::uint16_t) : sizeof(std::uint32_t),
        "TRIANGLES", nullptr, kIndices);
    Json primitive = {
        {"attributes", std::move(attributes)},
        {"indices", add_accessor({{"bufferView", view},
                                  {"componentType", has_16_bit_indices ? kUint16 : kUint32},
                                  {"count", indices.size()},
                                  {"type", "SCALAR"}})}};
    if (material != kRoot) primitive["material"] = material;
    return primitive;
  }

  /// Adds a primitive that Draco compresses.
  Json add_draco_primitive(const Part& part, std::size_t material, const Attributes& written) {
    use_extension(kDracoExtension, true);
    std::vector<const Vertex*> vertices;
    for (const Vertex& vertex : part.vertices) vertices.push_back(&vertex);
    struct Attribute {
      const char *name, *type;
      std::size_t first, width;
      DracoStream::Use use;
    };
    std::vector<Attribute> written_attributes = {
        {"POSITION", "VEC3", 0, 3, DracoStream::Use::position},
        {"NORMAL", "VEC3", 3, 3, DracoStream::Use::normal}};
    if (written.has_tangents) {
      written_attributes.push_back({"TANGENT", "VEC4", 6, 4, DracoStream::Use::other});
    }
    if (written.has_uvs) {
      written_attributes.push_back({"TEXCOORD_0", "VEC2", 10, 2, DracoStream::Use::uv});
    }
    std::vector<DracoStream> streams;
    for (const Attribute& attribute : written_attributes) {
      DracoStream& stream = streams.emplace_back();
      stream.use = attribute.use;
      stream.width = attribute.width;
      for (const Vertex& vertex : part.vertices) {
        const float* const source_values = &vertex.values[attribute.first];
        stream.values.insert(stream.values.end(), source_values, source_values + attribute.width);
      }
    }
    if (written.color_name != nullptr) {
      DracoStream& stream = streams.emplace_back();
      stream.width = 4;
      stream.shares = colors_of(vertices);
    }
    const DracoPrimitive packed = pack_draco(part.indices, part.vertices.size(), streams);
    Json extension = {{"bufferView", add_view(packed.bytes.data(), packed.bytes.size(), 0)}};
    Json attributes;
    const auto add = [&](const char* name, std::size_t stream, Json accessor) {
      accessor["count"] = packed.vertices;
      attributes[name] = add_accessor(std::move(accessor));
      extension["attributes"][name] = packed.ids[stream];
    };
    for (std::size_t i = 0; i < written_attributes.size(); ++i) {
      Json accessor = {{"componentType", kFloat32}, {"type", written_attributes[i].type}};
      if (i == 0) {
        std::array<float, 3> low, high;
        low.fill(std::numeric_limits<float>::infinity());
        high.fill(-std::numeric_limits<float>::infinity());
        for (const Vertex& vertex : part.vertices) {
          for (std::size_t k = 0; k < 3; ++k) {
            low[k] = std::min(low[k], vertex.values[k]);
            high[k] = std::max(high[k], vertex.values[k]);
          }
        }
        accessor["min"] = low;
        accessor["max"] = high;
      }
      add(written_attributes[i].name, i, std::move(accessor));
    }
    if (written.color_name != nullptr) {
      add(written.color_name, written_attributes.size(),
          {{"componentType", kUint16}, {"normalized", true}, {"type", "VEC4"}});
    }
    Json primitive = {
        {"attributes", std::move(attributes)},
        {"indices",
         add_accessor({{"componentType", fits_16_bit_indices(packed.vertices) ? kUint16 : kUint32},
                       {"count", packed.indices},
                       {"type", "SCALAR"}})}};
    primitive["extensions"][kDracoExtension] = std::move(extension);
    if (material != kRoot) primitive["material"] = material;
    return primitive;
  }

  /// Adds a picture, unless it was added before.
  /// \param fallback  the same picture for programs without WebP; empty: none
  /// \returns a reference to its texture
  Json add_picture(const std::vector<std::byte>& bytes, const std::vector<std::byte>* fallback,
                   const std::string& name) {
    const auto [entry, added] = textures_.emplace(&bytes, json_["textures"].size());
    if (added) {
      const bool is_webp = std::string_view(kind_of(bytes).mime) == "image/webp";
      const std::size_t image = add_image(bytes, name);
      if (!json_.contains("samplers")) {
        json_["samplers"] = Json::array({Json{{"magFilter", kLinear},
                                              {"minFilter", kLinearMips},
                                              {"wrapS", kRepeat},
                                              {"wrapT", kRepeat}}});
      }
      Json texture = {{"sampler", 0}};
      (is_webp ? texture["extensions"][kTextureWebp] : texture)["source"] = image;
      if (is_webp && fallback != nullptr) texture["source"] = add_image(*fallback, name);
      json_["textures"].push_back(std::move(texture));
      if (is_webp) use_extension(kTextureWebp, fallback == nullptr);
    }
    return Json{{"index", entry->second}};
  }

  void use_extension(const char* name, bool required = false) {
    for (const char* list : {"extensionsUsed", "extensionsRequired"}) {
      Json& names = json_[list];
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
      if (!required) return;
    }
  }

  /// Returns the contents of a GLB file.
  std::string encode() {
    finish_buffer();
    return make_glb();
  }

  std::vector<fs::path> save() {
    if (!is_text_) {
      save_text(path_, encode());
      return {path_};
    }
    finish_buffer();
    std::vector<fs::path> written;
    const auto write = [&](const fs::path& name, std::string_view bytes) {
      written.push_back(path_.parent_path() / name);
      save_text(written.back(), bytes);
    };
    const std::string buffer = path_.stem().string() + ".bin";
    json_["buffers"][0]["uri"] = encode_uri(buffer);
    write(buffer, bytes_);
    for (const auto& [name, png] : files_) {
      write(name, {reinterpret_cast<const char*>(png->data()), png->size()});
    }
    write(path_.filename(), json_.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
    return written;
  }

 private:
  void finish_buffer() {
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    json_["buffers"] = Json::array({Json{{"byteLength", bytes_.size()}}});
    if (unpacked_bytes_ == 0) return;
    Json unpacked = {{"byteLength", unpacked_bytes_}};
    unpacked["extensions"][kMeshopt]["fallback"] = true;
    json_["buffers"].push_back(std::move(unpacked));
  }

  struct Kind {
    const char *mime, *ending;
  };
  static Kind kind_of(const std::vector<std::byte>& picture) {
    const auto first = picture.empty() ? 0 : std::to_integer<int>(picture.front());
    return first == 'R'    ? Kind{"image/webp", ".webp"}
           : first == 0xFF ? Kind{"image/jpeg", ".jpg"}
                           : Kind{"image/png", ".png"};
  }

  std::size_t add_image(const std::vector<std::byte>& bytes, const std::string& name) {
    const Kind kind = kind_of(bytes);
    Json image = {{"name", name}, {"mimeType", kind.mime}};
    if (is_text_) {
      files_.emplace_back(unique_names_.add(path_.stem().string() + "_" + name) + kind.ending,
                          &bytes);
      image["uri"] = encode_uri(files_.back().first);
    } else {
      image["bufferView"] = add_view(bytes.data(), bytes.size(), 0);
    }
    json_["images"].push_back(std::move(image));
    return json_["images"].size() - 1;
  }

  /// Copies data to the buffer, and adds a view of it.
  /// \returns the index of the view
  std::size_t add_view(const void* data, std::size_t size, int target) {
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    Json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", size}};
    if (target != 0) view["target"] = target;
    bytes_.append(static_cast<const char*>(data), size);
    json_["bufferViews"].push_back(std::move(view));
    return json_["bufferViews"].size() - 1;
  }

  /// Adds an attribute of all vertices.
  /// \param first  index in Vertex::values of the attribute's first number
  /// \returns the index of its accessor
  std::size_t add_values(const std::vector<Vertex>& vertices, std::size_t first, std::size_t count,
                         const char* type, bool bounded) {
    std::vector<float> values;
    values.reserve(vertices.size() * count);
    std::vector<float> low(count, std::numeric_limits<float>::infinity()), high(count, -low[0]);
    for (const Vertex& vertex : vertices) {
      for (std::size_t k = 0; k < count; ++k) {
        const float value = vertex.values[first + k];
        values.push_back(value);
        low[k] = std::min(low[k], value);
        high[k] = std::max(high[k], value);
      }
    }
    Json accessor = {
        {"bufferView", add_view(values.data(), values.size() * sizeof(float), kVertices)},
        {"componentType", kFloat32},
        {"count", vertices.size()},
        {"type", type}};
    if (bounded) {
      accessor["min"] = low;
      accessor["max"] = high;
    }
    return add_accessor(std::move(accessor));
  }

  /// Adds a view of bytes that meshopt has compressed. The decompressed data is declared as part of
  /// a placeholder buffer without bytes.
  std::size_t add_packed_view(const std::string& packed, std::size_t count, std::size_t step,
                              const char* mode, const char* filter, int target) {
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    Json extension = {{"buffer", 0},
                      {"byteOffset", bytes_.size()},
                      {"byteLength", packed.size()},
                      {"byteStride", step},
                      {"count", count},
                      {"mode", mode}};
    if (filter != nullptr) extension["filter"] = filter;
    Json view = {{"buffer", 1},
                 {"byteOffset", unpacked_bytes_},
                 {"byteLength", count * step},
                 {"target", target}};
    if (target == kVertices) view["byteStride"] = step;
    view["extensions"][kMeshopt] = std::move(extension);
    bytes_ += packed;
    unpacked_bytes_ += (count * step + 3) / 4 * 4;
    json_["bufferViews"].push_back(std::move(view));
    return json_["bufferViews"].size() - 1;
  }

  /// Compresses an attribute by meshopt, and adds a view of it.
  /// \param step  bytes per vertex, a multiple of 4
  template <typename T>
  std::size_t add_compressed_view(const std::vector<T>& values, std::size_t step,
                                  const char* filter) {
    const std::size_t count = values.size() * sizeof(T) / step;
    std::string packed(meshopt_encodeVertexBufferBound(count, step), '\0');
    packed.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(packed.data()),
                                             packed.size(), values.data(), count, step));
    return add_packed_view(packed, count, step, "ATTRIBUTES", filter, kVertices);
  }

  /// Adds unit vectors in octahedral encoding. The fourth number is a sign.
  /// \returns the index of their accessor
  std::size_t add_directions(const std::vector<const Vertex*>& vertices, std::size_t first,
                             std::size_t width) {
    constexpr int kOctahedralBits = 13;
    constexpr std::size_t kStride = 8;
    std::vector<float> values(4 * vertices.size(), 0.0F);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      std::copy_n(&vertices[i]->values[first], width, &values[4 * i]);
    }
    std::vector<std::int16_t> filtered(4 * vertices.size());
    meshopt_encodeFilterOct(filtered.data(), vertices.size(), kStride, kOctahedralBits,
                            values.data());
    return add_accessor({{"bufferView", add_compressed_view(filtered, kStride, "OCTAHEDRAL")},
                         {"componentType", kInt16},
                         {"normalized", true},
                         {"count", vertices.size()},
                         {"type", width == 4 ? "VEC4" : "VEC3"}});
  }

  /// Adds UVs: as multiples of 1/65535 if all lie in [0, 1], otherwise as floats.
  std::size_t add_packed_uvs(const std::vector<const Vertex*>& vertices) {
    std::vector<float> values;
    std::vector<std::uint16_t> shares;
    bool are_fractions = true;
    for (const Vertex* const vertex : vertices) {
      for (std::size_t k = 10; k < 12; ++k) {
        const float value = vertex->values[k];
        are_fractions = are_fractions && value >= 0 && value <= 1;
        values.push_back(value);
        shares.push_back(
            static_cast<std::uint16_t>(std::floor(std::clamp(value, 0.0F, 1.0F) * 65535.0 + 0.5)));
      }
    }
    Json accessor = {{"bufferView", are_fractions ? add_compressed_view(shares, 4, nullptr)
                                                  : add_compressed_view(values, 8, nullptr)},
                     {"componentType", are_fractions ? kUint16 : kFloat32},
                     {"count", vertices.size()},
                     {"type", "VEC2"}};
    if (are_fractions) accessor["normalized"] = true;
    return add_accessor(std::move(accessor));
  }

  /// In linear light, 16 bits suffice to preserve 8 bits of sRGB.
  static std::vector<std::uint16_t> colors_of(const std::vector<const Vertex*>& vertices) {
    std::vector<std::uint16_t> values;
    values.reserve(4 * vertices.size());
    for (const Vertex* const vertex : vertices) {
      for (std::size_t k = 0; k < 4; ++k) {
        const std::uint8_t byte = vertex->color[k];
        values.push_back(static_cast<std::uint16_t>(
            k < 3 ? std::lround(linear_values_of_bytes()[byte] * 65535.0F) : byte * 257));
      }
    }
    return values;
  }

  std::size_t add_colors(const std::vector<Vertex>& vertices) {
    std::vector<const Vertex*> vertex_pointers;
    for (const Vertex& vertex : vertices) vertex_pointers.push_back(&vertex);
    const std::vector<std::uint16_t> values = colors_of(vertex_pointers);
    return add_accessor(
        {{"bufferView", add_view(values.data(), values.size() * sizeof values[0], kVertices)},
         {"componentType", kUint16},
         {"normalized", true},
         {"count", vertices.size()},
         {"type", "VEC4"}});
  }

  /// Adds indices, with 16 bits if these suffice. Indices of 8 bits are not written, since GPUs
  /// convert them.
  std::size_t add_indices(const std::vector<std::uint32_t>& indices, std::size_t vertices) {
    const bool has_16_bit_indices = fits_16_bit_indices(vertices);
    const std::vector<std::uint16_t> short_indices(
        indices.begin(), has_16_bit_indices ? indices.end() : indices.begin());
    const std::size_t view =
        has_16_bit_indices ? add_view(short_indices.data(),
                                      short_indices.size() * sizeof short_indices[0], kIndices)
                           : add_view(indices.data(), indices.size() * sizeof indices[0], kIndices);
    return add_accessor({{"bufferView", view},
                         {"componentType", has_16_bit_indices ? kUint16 : kUint32},
                         {"count", indices.size()},
                         {"type", "SCALAR"}});
  }

  std::size_t add_accessor(Json accessor) {
    json_["accessors"].push_back(std::move(accessor));
    return json_["accessors"].size() - 1;
  }

  /// The bytes of the GLB.
  std::string make_glb() const {
    std::string text = json_.dump(-1, ' ', false, Json::error_handler_t::replace);
    text.resize((text.size() + 3) / 4 * 4, ' ');
    constexpr std::uint64_t kGlbHeaderBytes = 12 + 8 + 8;
    const std::uint64_t size = kGlbHeaderBytes + text.size() + bytes_.size();
    if (size > std::numeric_limits<std::uint32_t>::max()) {
      throw Error(
          ErrorCode::output,
          "'" + path_.string() +
              "' would exceed 4 GiB, the limit of a GLB: write a .gltf, or bake smaller maps.");
    }
    std::string file;
    file.reserve(static_cast<std::size_t>(size));
    for (const std::uint64_t word : {std::uint64_t{kMagic}, std::uint64_t{2}, size}) {
      append(file, word);
    }
    append(file, text.size());
    append(file, kJsonChunk);
    file += text;
    append(file, bytes_.size());
    append(file, kBinaryChunk);
    return file + bytes_;
  }
  static void append(std::string& file, std::uint64_t word) {
    for (int shift = 0; shift < 32; shift += 8) file += static_cast<char>(word >> shift & 0xFFU);
  }

  fs::path path_;
  bool is_text_;
  Json json_;
  std::string bytes_;
  /// Size of all views compressed by meshopt after their decompression
  std::size_t unpacked_bytes_ = 0;
  std::map<const std::vector<std::byte>*, std::size_t> textures_;
  UniqueNames unique_names_;
  std::vector<std::pair<std::string, const std::vector<std::byte>*>> files_;
};

void check_map(const Image* map, std::uint32_t least_channels, const char* name) {
  if (map == nullptr || map->channels >= least_channels) return;
  throw Error(ErrorCode::usage, std::string("encode_maps(): the map of ") + name + " has " +
                                    std::to_string(map->channels) + " channels.");
}

/// Combines maps of one channel to a picture. The first channel of each becomes a channel of the
/// picture; `plain` gives the values of missing maps.
Image combine_channels(const std::vector<std::pair<const Image*, float>>& channels,
                       const Image* first) {
  Image image;
  for (const auto& [map, plain] : channels) {
    if (map == nullptr) continue;
    if (image.width == 0) {
      image.width = map->width;
      image.height = map->height;
    }
    if (map->width != image.width || map->height != image.height) {
      throw Error(
          ErrorCode::usage,
          "encode_maps(): maps that share a picture differ in size: give them the same size.");
    }
  }
  image.channels = static_cast<std::uint32_t>(channels.size());
  const std::size_t texels = std::size_t{image.width} * image.height;
  image.pixels.reserve(texels * channels.size());
  for (std::size_t i = 0; i < texels; ++i) {
    for (std::size_t c = 0; c < channels.size(); ++c) {
      const Image* const map = channels[c].first;
      const std::size_t source_channel = map != nullptr && map == first ? c : 0;
      image.pixels.push_back(map == nullptr ? channels[c].second
                                            : map->pixels[i * map->channels + source_channel]);
    }
  }
  return image;
}

Json material_of(GltfOutput& file, const AssetMaterial& from) {
  const AssetPictures no_pictures;
  const AssetPictures& pictures = from.pictures ? *from.pictures : no_pictures;
  const auto picture = [&](const std::vector<std::byte>& bytes, const char* name) {
    const AssetPictures* const fallback_pictures = pictures.fallback.get();
    const std::vector<std::byte>* const fallback =
        fallback_pictures == nullptr  ? nullptr
        : &bytes == &pictures.color   ? &fallback_pictures->color
        : &bytes == &pictures.surface ? &fallback_pictures->surface
        : &bytes == &pictures.normal  ? &fallback_pictures->normal
                                      : &fallback_pictures->emission;
    return file.add_picture(bytes, fallback, from.set.empty() ? name : from.set + "_" + name);
  };
  Json material = {{"name", from.name}};
  Json surface = {{"metallicFactor", pictures.has_metallic ? 1 : 0}, {"roughnessFactor", 1}};
  if (!pictures.color.empty()) surface["baseColorTexture"] = picture(pictures.color, "color");
  if (pictures.has_opacity && from.alpha_mode != AlphaMode::opaque) {
    const bool mask = from.alpha_mode == AlphaMode::mask;
    material["alphaMode"] = mask ? "MASK" : "BLEND";
    if (mask) material["alphaCutoff"] = from.alpha_cutoff;
  }
  if (!pictures.surface.empty()) {
    const Json texture = picture(pictures.surface, "occlusion_roughness_metallic");
    if (pictures.has_surface) surface["metallicRoughnessTexture"] = texture;
    if (pictures.has_occlusion) material["occlusionTexture"] = texture;
  }
  if (!pictures.normal.empty()) material["normalTexture"] = picture(pictures.normal, "normal");
  if (!pictures.emission.empty()) {
    material["emissiveTexture"] = picture(pictures.emission, "emission");
    const float strength = pictures.emission_strength, factor = std::min(strength, 1.0F);
    material["emissiveFactor"] = Json::array({factor, factor, factor});
    if (strength > 1) {
      constexpr const char* kStrength = "KHR_materials_emissive_strength";
      material["extensions"][kStrength]["emissiveStrength"] = strength;
      file.use_extension(kStrength);
    }
  }
  if (from.double_sided) material["doubleSided"] = true;
  material["pbrMetallicRoughness"] = std::move(surface);
  if (!from.extras.empty()) material["extras"] = parse_extras(from.extras, "a material");
  return material;
}

/// Checks the nodes of a mesh's objects.
/// \param name  name of the member that holds them, for messages
void check_object_nodes(const Mesh& mesh, const std::vector<std::uint32_t>& object_nodes,
                        const SaveAssetOptions& options, const std::string& name) {
  const std::size_t objects = mesh.objects.empty() ? 1 : mesh.object_names.size();
  if (!options.nodes.empty() && object_nodes.size() != objects) {
    fail_usage(name + " must have one node for each object.");
  }
  for (const std::uint32_t node : object_nodes) {
    if (node != AssetNode::kNone && node >= options.nodes.size()) {
      fail_usage(name + " refers to a node that does not exist.");
    }
  }
}

void check_nodes(const Mesh& low, const SaveAssetOptions& options) {
  check_object_nodes(low, options.object_nodes, options, "SaveAssetOptions::object_nodes");
  for (std::size_t i = 0; i < options.nodes.size(); ++i) {
    const AssetNode& node = options.nodes[i];
    const AffineMap& m = node.transform;
    if (node.parent != AssetNode::kNone && node.parent >= i) {
      fail_usage("node " + std::to_string(i) +
                 " comes before its parent: parents must come first.");
    }
    if (!std::all_of(m.begin(), m.end(), [](double value) { return std::isfinite(value); }) ||
        m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1) {
      fail_usage("the transform of node " + std::to_string(i) + " is not an affine map.");
    }
  }
  if (options.hulls != nullptr && !options.nodes.empty() &&
      options.hull_nodes.size() != options.hulls->object_names.size()) {
    fail_usage("SaveAssetOptions::hull_nodes must have one node for each hull.");
  }
  if (options.hulls != nullptr) {
    for (const std::uint32_t node : options.hull_nodes) {
      if (node != AssetNode::kNone && node >= options.nodes.size()) {
        fail_usage("SaveAssetOptions::hull_nodes refers to a node that does not exist.");
      }
    }
  }
  double coverage = 1;
  for (const AssetLevel& level : options.levels) {
    check_object_nodes(level.low, level.object_nodes, options, "AssetLevel::object_nodes");
    if (!(level.coverage >= 0 && level.coverage <= coverage)) {
      fail_usage(
          "AssetLevel::coverage must be from 0 to 1, and not above that of the previous level.");
    }
    coverage = level.coverage;
  }
}

/// For each object, its node and the transform to its space.
struct ObjectPlacements {
  std::vector<std::size_t> nodes;
  std::vector<WorldToObject> to_objects;
};

/// The hierarchy of nodes of one level. It is that of the input file, to which nodes for objects
/// may be added.
class Hierarchy {
 public:
  /// \param is_detached  true for levels after the first, which MSFT_lod lists instead of a scene
  Hierarchy(GltfOutput& file, const Mesh& low, const SaveAssetOptions& options, bool is_detached)
      : file_(file), name_(low.name.empty() ? "mesh" : low.name) {
    const double metres = options.metres > 0 ? options.metres : 1;
    is_flat_ = options.nodes.empty();
    if (is_flat_ || metres != 1 || !options.levels.empty()) {
      Json node = {{"name", name_}};
      if (metres != 1) node["scale"] = Json::array({metres, metres, metres});
      if (is_flat_ && low.origin != std::array<double, 3>{}) {
        node["translation"] =
            Json::array({metres * low.origin[0], metres * low.origin[1], metres * low.origin[2]});
      }
      root_ =
          is_detached ? file.add_detached_node(std::move(node)) : file.add_node(std::move(node));
    }
    for (const AssetNode& node : options.nodes) {
      const bool is_root = node.parent == AssetNode::kNone;
      Json json = Json::object();
      if (!node.name.empty()) json["name"] = node.name;
      if (node.transform != kIdentity) json["matrix"] = node.transform;
      if (!node.extras.empty()) json["extras"] = parse_extras(node.extras, "a node");
      nodes_.push_back(file.add_node(std::move(json), is_root ? root_ : nodes_[node.parent]));
      world_transforms_.push_back(
          is_root ? node.transform : product(world_transforms_[node.parent], node.transform));
    }
    has_mesh_.resize(nodes_.size());
  }

  /// The node above all others; GltfOutput::kRoot if there is no such node.
  std::size_t root() const { return root_; }

  /// Assigns a node to each object.
  /// \param node_of_object  the node that each object had in the input; empty if there is no hierarchy
  ObjectPlacements place(const Mesh& mesh, const std::vector<std::uint32_t>& node_of_object) {
    ObjectPlacements places;
    if (is_flat_) {
      places.to_objects.resize(mesh.objects.empty() ? 1 : mesh.object_names.size());
      for (std::size_t i = 0; i < places.to_objects.size(); ++i) {
        places.nodes.push_back(
            mesh.objects.empty() ? root_ : file_.add_node({{"name", mesh.object_names[i]}}, root_));
      }
      return places;
    }
    const double reach = max_coordinate_of(mesh);
    for (std::size_t i = 0; i < node_of_object.size(); ++i) {
      const std::string& object = mesh.objects.empty() ? name_ : mesh.object_names[i];
      const std::uint32_t node_index = node_of_object[i];
      WorldToObject& to_object = places.to_objects.emplace_back();
      to_object.origin = mesh.origin;
      const bool mirrors =
          node_index != AssetNode::kNone && determinant(world_transforms_[node_index]) < 0;
      constexpr AffineMap kMirror{-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
      if (node_index == AssetNode::kNone ||
          !invert(mirrors ? product(world_transforms_[node_index], kMirror)
                          : world_transforms_[node_index],
                  reach, to_object)) {
        to_object = {};
        Json new_node = {{"name", object}};
        if (mesh.origin != std::array<double, 3>{}) new_node["translation"] = mesh.origin;
        places.nodes.push_back(file_.add_node(std::move(new_node), root_));
      } else if (mirrors || has_mesh_[node_index]) {
        Json new_node = {{"name", object}};
        if (mirrors) new_node["scale"] = Json::array({-1, 1, 1});
        places.nodes.push_back(file_.add_node(std::move(new_node), nodes_[node_index]));
      } else {
        has_mesh_[node_index] = true;
        places.nodes.push_back(nodes_[node_index]);
      }
    }
    return places;
  }

 private:
  GltfOutput& file_;
  std::string name_;
  bool is_flat_ = false;
  std::size_t root_ = GltfOutput::kRoot;
  std::vector<std::size_t> nodes_;
  std::vector<AffineMap> world_transforms_;
  std::vector<bool> has_mesh_;  ///< For each node, true if it has a mesh already
};

/// Compresses the primitives of one object, and adds them to its node.
class PackedObject {
 public:
  PackedObject() = default;
  PackedObject(GltfOutput& file, MeshCompression compression, const std::vector<const Part*>& parts,
               std::size_t node)
      : file_(&file), compression_(compression), node_(node) {
    if (compression != MeshCompression::meshopt) return;
    grid_ = Grid::of(parts);
    node_ = file.add_node(
        {{"translation", grid_.origin}, {"scale", std::array{grid_.step, grid_.step, grid_.step}}},
        node);
  }
  std::size_t node() const { return node_; }
  Json add(const Part& part, std::size_t material, const Attributes& written) const {
    switch (compression_) {
      case MeshCompression::meshopt:
        return file_->add_meshopt_primitive(part, grid_, material, written);
      case MeshCompression::draco:
        return file_->add_draco_primitive(part, material, written);
      case MeshCompression::none:
        break;
    }
    return file_->add_primitive(part, material, written);
  }

 private:
  GltfOutput* file_ = nullptr;
  MeshCompression compression_ = MeshCompression::none;
  std::size_t node_ = 0;
  Grid grid_;
};

/// Writes each collision hull as a mesh.
void add_hulls(GltfOutput& file, Hierarchy& hierarchy, const SaveAssetOptions& options) {
  Mesh hulls = *options.hulls;
  hulls.uvs = {};
  hulls.uv_triangles = {};
  hulls.tangents = {};
  hulls.colors = {};
  const ObjectPlacements places = hierarchy.place(hulls, options.hull_nodes);
  Json& json = file.json();
  for (const auto& [of, part] : primitives_of(hulls, places.to_objects, {})) {
    const PackedObject object(file, options.compression, {&part}, places.nodes[of.object]);
    Json primitive = object.add(part, GltfOutput::kRoot, {});
    json["nodes"][object.node()]["mesh"] = json["meshes"].size();
    json["meshes"].push_back({{"name", hulls.object_names[of.object]},
                              {"primitives", Json::array({std::move(primitive)})}});
    const std::uint32_t node =
        options.nodes.empty() ? AssetNode::kNone : options.hull_nodes[of.object];
    if (node != AssetNode::kNone && !options.nodes[node].mesh_extras.empty()) {
      json["meshes"].back()["extras"] = parse_extras(options.nodes[node].mesh_extras, "a mesh");
    }
  }
}

}  // namespace

const Image** slot_of(AssetMaps& maps, std::string_view name) {
  return name == "normal"      ? &maps.normal
         : name == "normals"   ? &maps.normal  // the map's name for the materials' own normal map
         : name == "ao"        ? &maps.occlusion
         : name == "occlusion" ? &maps.occlusion  // the map's name for the materials' own occlusion
         : name == "roughness" ? &maps.roughness
         : name == "metallic"  ? &maps.metallic
         : name == "opacity"   ? &maps.opacity
         : name == "color"     ? &maps.color
         : name == "emission"  ? &maps.emission
                               : nullptr;
}

namespace {

/// The lowest quality of lossy compression at which the mean error of normals stays below a bound;
/// 0 if there is none.
std::uint32_t normal_quality(const Image& normal, PictureEncoding encoding, double most,
                             std::span<const std::uint8_t> coverage) {
  constexpr std::uint32_t kMinQuality = 30, kMaxQuality = 100;
  const auto is_within = [&](std::uint32_t quality) {
    encoding.quality = quality;
    return picture_error(normal, encoding, coverage).mean <= most;
  };
  if (!is_within(kMaxQuality)) return 0;
  // Invariant: at quality `high`, the error is below the bound
  std::uint32_t low = kMinQuality, high = kMaxQuality;
  while (low < high) {
    const std::uint32_t middle_quality = (low + high) / 2;
    if (is_within(middle_quality)) {
      high = middle_quality;
    } else {
      low = middle_quality + 1;
    }
  }
  return high;
}

}  // namespace

std::string_view name_of(PictureSlot picture) {
  switch (picture) {
    case PictureSlot::normal:
      return "normal";
    case PictureSlot::color:
      return "color";
    case PictureSlot::surface:
      return "surface";
    case PictureSlot::emission:
      break;
  }
  return "emission";
}

std::vector<std::byte>& file_of(AssetPictures& pictures, PictureSlot picture) {
  switch (picture) {
    case PictureSlot::normal:
      return pictures.normal;
    case PictureSlot::color:
      return pictures.color;
    case PictureSlot::surface:
      return pictures.surface;
    case PictureSlot::emission:
      break;
  }
  return pictures.emission;
}

Image color_picture(const AssetMaps& maps) {
  check_map(maps.color, 3, "colour");
  if (maps.color == nullptr && maps.opacity == nullptr) return {};
  std::vector<std::pair<const Image*, float>> channels(3, {maps.color, 1.0F});
  if (maps.opacity != nullptr) channels.emplace_back(maps.opacity, 1.0F);
  return combine_channels(channels, maps.color);
}

Image surface_picture(const AssetMaps& maps) {
  if (maps.occlusion == nullptr && maps.roughness == nullptr && maps.metallic == nullptr) return {};
  return combine_channels({{maps.occlusion, 1.0F},
                           {maps.roughness, 1.0F},
                           {maps.metallic, maps.metallic != nullptr ? 1.0F : 0.0F}},
                          nullptr);
}

AssetPictures described_pictures(const AssetMaps& maps) {
  check_map(maps.normal, 3, "normals");
  check_map(maps.color, 3, "colour");
  check_map(maps.emission, 3, "emission");
  AssetPictures pictures;
  pictures.has_color = maps.color != nullptr;
  pictures.has_opacity = maps.opacity != nullptr;
  pictures.has_occlusion = maps.occlusion != nullptr;
  pictures.has_metallic = maps.metallic != nullptr;
  pictures.has_surface = pictures.has_metallic || maps.roughness != nullptr;
  pictures.emission_strength = maps.emission_strength;
  return pictures;
}

AssetPictures encode_maps(const AssetMaps& maps, const EncodeMapsOptions& options) {
  const PictureFormat format = options.format;
  if (options.quality > 100) {
    throw Error(ErrorCode::usage, "EncodeMapsOptions::quality is " +
                                      std::to_string(options.quality) + "; use 1 to 100, or 0.");
  }
  AssetPictures pictures = described_pictures(maps);
  const auto stored = [&](TextureUse use, bool lossless) {
    PictureEncoding encoding{.format = format, .dither = options.dither, .use = use};
    encoding.smallest = options.smallest;
    if (lossless && format == PictureFormat::jpeg) encoding.format = PictureFormat::png;
    if (!lossless && format != PictureFormat::png) encoding.quality = options.quality;
    return encoding;
  };
  PictureEncoding normal_encoding = stored(TextureUse::normal, true);
  if (maps.normal != nullptr && options.max_normal_error > 0 && format != PictureFormat::png) {
    PictureEncoding lossy = normal_encoding;
    lossy.format = format;
    pictures.normal_quality =
        normal_quality(*maps.normal, lossy, options.max_normal_error, maps.coverage);
    lossy.quality = pictures.normal_quality;
    if (lossy.quality != 0) normal_encoding = lossy;
  }
  const PictureEncoding color_encoding =
      stored(TextureUse::color, pictures.has_opacity && format == PictureFormat::jpeg);
  const PictureEncoding surface_encoding = stored(TextureUse::values, false);
  const PictureEncoding emission_encoding = stored(TextureUse::color, false);
  const auto note = [&](std::string_view name, const Image* map, std::uint32_t channels,
                        const PictureEncoding& encoding) {
    if (map == nullptr) return;
    const bool is_normal = encoding.use == TextureUse::normal;
    const Image first =
        map->channels == channels ? Image() : combine_channels({{map, 1.0F}}, nullptr);
    pictures.errors.push_back(
        {name, is_normal,
         picture_error(map->channels == channels ? *map : first, encoding, maps.coverage)});
  };
  note("normal", maps.normal, 3, normal_encoding);
  note("ao", maps.occlusion, 1, surface_encoding);
  note("roughness", maps.roughness, 1, surface_encoding);
  note("metallic", maps.metallic, 1, surface_encoding);
  note("opacity", maps.opacity, 1, stored(TextureUse::values, true));
  note("color", maps.color, 3, color_encoding);
  note("emission", maps.emission, 3, emission_encoding);

  // Pictures are encoded one after the other, since most encoders use all threads.
  if (const Image color = color_picture(maps); !color.pixels.empty()) {
    pictures.color = encode_picture(color, color_encoding);
  }
  if (const Image surface = surface_picture(maps); !surface.pixels.empty()) {
    pictures.surface = encode_picture(surface, surface_encoding);
  }
  if (maps.normal != nullptr) pictures.normal = encode_picture(*maps.normal, normal_encoding);
  if (maps.emission != nullptr)
    pictures.emission = encode_picture(*maps.emission, emission_encoding);
  if (options.fallback && format == PictureFormat::webp) {
    EncodeMapsOptions fallback_options = options;
    fallback_options.format = PictureFormat::png;
    fallback_options.fallback = false;
    pictures.fallback = std::make_shared<const AssetPictures>(encode_maps(maps, fallback_options));
  }
  return pictures;
}

AssetPictures encode_maps(const AssetMaps& maps, ImageFormat format) {
  if (format != ImageFormat::png8 && format != ImageFormat::webp) {
    throw Error(ErrorCode::usage, "encode_maps(): pictures in a glTF must be png8, webp or jpeg.");
  }
  EncodeMapsOptions options;
  if (format == ImageFormat::webp) options.format = PictureFormat::webp;
  return encode_maps(maps, options);
}

namespace {

/// \throws Error(usage) for a wrong number of materials; Error(input) if a mesh with pictures has
///   no UVs
void check_materials(const Mesh& low, std::span<const AssetMaterial> materials) {
  const bool one_material = materials.size() == 1;
  if (!one_material && (low.materials.empty() || materials.size() != low.material_names.size())) {
    fail_usage("there must be one material for each material of the mesh, or one for all.");
  }
  const bool has_pictures =
      std::any_of(materials.begin(), materials.end(), [](const AssetMaterial& material) {
        const AssetPictures* const p = material.pictures.get();
        return p != nullptr && !(p->color.empty() && p->surface.empty() && p->normal.empty() &&
                                 p->emission.empty());
      });
  if (has_pictures && low.uvs.empty()) {
    throw Error(ErrorCode::input, "Mesh '" + low.name + "' has no UVs for its pictures.");
  }
}

/// Adds the asset's properties that belong to no mesh.
void add_extras(GltfOutput& file, const SaveAssetOptions& options) {
  Json& json = file.json();
  if (!options.extras.empty()) {
    json["asset"]["extras"] = parse_extras(options.extras, "the asset");
    if (!json["asset"]["extras"].is_object())
      fail_usage("the asset's extras are not a JSON object.");
  }
  if (!options.kiln_extras.empty()) {
    json["asset"]["extras"]["kiln"] = parse_extras(options.kiln_extras, "Kiln");
  }
  if (!options.copyright.empty()) json["asset"]["copyright"] = options.copyright;
  if (!options.scene.empty()) {
    const Json scene = parse_extras(options.scene, "the scene");
    for (const char* const key : {"name", "extras"}) {
      if (scene.contains(key)) json["scenes"][0][key] = scene[key];
    }
  }
}

/// Adds a mesh with its materials.
/// \param hierarchy  hierarchy of the mesh's level
/// \param is_coarser  true for levels after the first, which reuse equal materials of earlier
///   levels
void add_mesh(GltfOutput& file, Hierarchy& hierarchy, const Mesh& low,
              std::span<const AssetMaterial> materials,
              const std::vector<std::uint32_t>& object_nodes, const SaveAssetOptions& options,
              bool is_coarser) {
  Json& json = file.json();
  const ObjectPlacements places = hierarchy.place(low, object_nodes);
  const Primitives primitives = primitives_of(low, places.to_objects, materials);
  if (primitives.empty()) {
    throw Error(ErrorCode::input,
                "Mesh '" + low.name +
                    "' has no triangle with both an area and UVs, so there is nothing to write.");
  }
  // For each material, its indices in the file: for primitives with UVs, and for those without
  std::vector<std::array<std::size_t, 2>> numbers(materials.size(),
                                                  {GltfOutput::kRoot, GltfOutput::kRoot});
  std::size_t object = GltfOutput::kRoot;
  PackedObject packed;
  for (const auto& [of, part] : primitives) {
    AssetMaterial material = materials[of.material];
    // Without UVs, only one texel of a picture would be visible
    if (of.lacks_uvs) material.pictures = nullptr;
    std::size_t& number = numbers[of.material][of.lacks_uvs ? 1 : 0];
    if (number == GltfOutput::kRoot) {
      Json material_json = material_of(file, material);
      Json& all = json["materials"];
      // Levels after the first use materials of earlier levels if these are equal.
      number = is_coarser ? 0 : all.size();
      while (number < all.size() && all[number] != material_json) ++number;
      if (number == all.size()) all.push_back(std::move(material_json));
    }
    if (of.object != object) {
      object = of.object;
      const std::string& name = low.objects.empty() ? low.name : low.object_names[object];
      std::vector<const Part*> parts;
      for (auto object_primitive = primitives.lower_bound({object});
           object_primitive != primitives.end() && object_primitive->first.object == object;
           ++object_primitive) {
        parts.push_back(&object_primitive->second);
      }
      packed = PackedObject(file, options.compression, parts, places.nodes[object]);
      json["nodes"][packed.node()]["mesh"] = json["meshes"].size();
      json["meshes"].push_back({{"name", name}, {"primitives", Json::array()}});
      const std::uint32_t node = options.nodes.empty() ? AssetNode::kNone : object_nodes[object];
      if (node != AssetNode::kNone && !options.nodes[node].mesh_extras.empty()) {
        json["meshes"].back()["extras"] = parse_extras(options.nodes[node].mesh_extras, "a mesh");
      }
    }
    const bool has_color_picture = material.pictures && material.pictures->has_color;
    // The primitive is made first: adding keys to the file's JSON moves its members, which would
    // invalidate references.
    Attributes written;
    written.has_uvs = !low.uvs.empty() && !of.lacks_uvs;
    written.has_tangents = written.has_uvs && needs_tangents(material);
    if (!low.colors.empty()) written.color_name = has_color_picture ? "_COLOR_0" : "COLOR_0";
    Json primitive = packed.add(part, number, written);
    json["meshes"].back()["primitives"].push_back(std::move(primitive));
  }
}

/// Adds a low poly with its materials and its coarser levels to a file that is being built.
void add_asset(GltfOutput& file, const Mesh& low, std::span<const AssetMaterial> materials,
               const SaveAssetOptions& options) {
  check_materials(low, materials);
  for (const AssetLevel& level : options.levels) check_materials(level.low, level.materials);
  check_nodes(low, options);
  add_extras(file, options);
  Hierarchy hierarchy(file, low, options, /*is_detached=*/false);
  add_mesh(file, hierarchy, low, materials, options.object_nodes, options, /*is_coarser=*/false);
  if (options.hulls != nullptr) add_hulls(file, hierarchy, options);
  if (options.levels.empty()) return;
  Json ids = Json::array(), coverages = Json::array();
  for (const AssetLevel& level : options.levels) {
    Hierarchy level_hierarchy(file, level.low, options, /*is_detached=*/true);
    add_mesh(file, level_hierarchy, level.low, level.materials, level.object_nodes, options,
             /*is_coarser=*/true);
    ids.push_back(level_hierarchy.root());
    coverages.push_back(level.coverage);
  }
  coverages.push_back(0);  // The coarsest level is visible at any distance
  Json& root = file.json()["nodes"][hierarchy.root()];
  root["extensions"][kLevels]["ids"] = std::move(ids);
  root["extras"][kCoverages] = std::move(coverages);
  file.use_extension(kLevels);
}

}  // namespace

std::vector<fs::path> save_asset(const Mesh& low, std::span<const AssetMaterial> materials,
                                 const fs::path& path, const SaveAssetOptions& options) {
  GltfOutput file(path);
  add_asset(file, low, materials, options);
  return file.save();
}

std::vector<std::byte> encode_glb(const Mesh& low, std::span<const AssetMaterial> materials,
                                  const SaveAssetOptions& options) {
  GltfOutput file("memory.glb");
  add_asset(file, low, materials, options);
  const std::string bytes = file.encode();
  const auto* const first = reinterpret_cast<const std::byte*>(bytes.data());
  return {first, first + bytes.size()};
}

void save_glb(const Mesh& low, const AssetMaps& maps, const fs::path& path,
              const SaveGlbOptions& options) {
  AssetMaterial material;
  material.name = low.name.empty() ? "mesh" : low.name;
  material.pictures = std::make_shared<const AssetPictures>(encode_maps(maps));
  material.alpha_mode = options.alpha_mode;
  material.alpha_cutoff = options.alpha_cutoff;
  material.double_sided = options.double_sided;
  SaveAssetOptions asset;
  asset.metres = options.metres;
  asset.kiln_extras = options.extras;
  save_asset(low, std::span(&material, 1), path, asset);
}

}  // namespace kiln
