// Binary glTF 2.0 out.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <unordered_map>
#include <vector>

#include "kiln/asset.h"
#include "kiln/files.h"
#include "kiln/version.h"
#include "mesh/frame.h"
#include "mesh/low_surface.h"

namespace kiln {
namespace {

using Json = nlohmann::ordered_json;

// Numbers of glTF's specification.
constexpr int kFloat = 5126, kUint = 5125, kVertices = 34962, kIndices = 34963;
constexpr int kLinear = 9729, kLinearMips = 9987, kRepeat = 10497;
constexpr std::uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

/// A vertex as the file has it; two of the same bits are one.
struct Vertex {
  std::array<float, 12> values;  // position, normal, tangent with its sign, UV

  bool operator==(const Vertex& other) const {
    return std::memcmp(values.data(), other.values.data(), sizeof values) == 0;
  }
};
struct VertexHash {
  std::size_t operator()(const Vertex& vertex) const {
    std::uint64_t hash = 0xCBF29CE484222325;
    for (const float value : vertex.values) {
      hash = (hash ^ std::bit_cast<std::uint32_t>(value)) * 0x100000001B3;
    }
    return static_cast<std::size_t>(hash);
  }
};

struct Part {
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;
};

/// A mesh's triangles, an object each.
std::vector<Part> parts_of(const Mesh& low) {
  const LowSurface surface = LowSurface::of(low, Frame::of(low));
  std::vector<Part> parts(low.objects.empty() ? 1 : low.object_names.size());
  std::vector<std::unordered_map<Vertex, std::uint32_t, VertexHash>> known(parts.size());
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    if (surface.usable[t] == 0) continue;
    const std::size_t object = low.objects.empty() ? 0 : low.objects[t];
    std::array<Vertex, 3> corners{};
    bool finite = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const LowSurface::Corner& corner = surface.triangles[t][k];
      const Vec3& p = low.positions[low.triangles[t][k]];
      // glTF counts v from the top; bitangents still point up, to +Y of the normal map.
      corners[k].values = {p.x + 0.0F,       p.y + 0.0F,      p.z + 0.0F,         corner.normal.x,
                           corner.normal.y,  corner.normal.z, corner.tangent.x,   corner.tangent.y,
                           corner.tangent.z, corner.sign,     corner.uv.x + 0.0F, 1 - corner.uv.y};
      for (const float value : corners[k].values) finite = finite && std::isfinite(value);
    }
    if (!finite) continue;  // without UVs
    for (const Vertex& corner : corners) {
      const auto [entry, added] =
          known[object].emplace(corner, static_cast<std::uint32_t>(parts[object].vertices.size()));
      if (added) parts[object].vertices.push_back(corner);
      parts[object].indices.push_back(entry->second);
    }
  }
  return parts;
}

/// The file as it grows: its JSON and its one buffer.
class Glb {
 public:
  Glb() {
    json_["asset"] = {{"version", "2.0"}, {"generator", "Kiln " + std::string(version())}};
    json_["scene"] = 0;
    json_["scenes"] = Json::array({Json{{"nodes", Json::array({0})}}});
  }

  Json& json() { return json_; }

  /// \returns the index of its view
  std::size_t add_view(const void* data, std::size_t size, int target) {
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    Json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", size}};
    if (target != 0) view["target"] = target;
    bytes_.append(static_cast<const char*>(data), size);
    json_["bufferViews"].push_back(std::move(view));
    return json_["bufferViews"].size() - 1;
  }

  /// Values of all vertices, from one of theirs on. \returns the index of its accessor
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
        {"componentType", kFloat},
        {"count", vertices.size()},
        {"type", type}};
    if (bounded) {
      accessor["min"] = low;
      accessor["max"] = high;
    }
    return add_accessor(std::move(accessor));
  }

  std::size_t add_indices(const std::vector<std::uint32_t>& indices) {
    const std::size_t view =
        add_view(indices.data(), indices.size() * sizeof(std::uint32_t), kIndices);
    return add_accessor({{"bufferView", view},
                         {"componentType", kUint},
                         {"count", indices.size()},
                         {"type", "SCALAR"}});
  }

  /// \returns a reference to its texture
  Json add_picture(const Image& image, const char* name) {
    const std::vector<std::byte> png = encode(image, {ImageFormat::png8, /*dither=*/true});
    const std::size_t view = add_view(png.data(), png.size(), 0);
    json_["images"].push_back({{"name", name}, {"mimeType", "image/png"}, {"bufferView", view}});
    if (!json_.contains("samplers")) {
      json_["samplers"] = Json::array({Json{{"magFilter", kLinear},
                                            {"minFilter", kLinearMips},
                                            {"wrapS", kRepeat},
                                            {"wrapT", kRepeat}}});
    }
    json_["textures"].push_back({{"sampler", 0}, {"source", json_["images"].size() - 1}});
    return Json{{"index", json_["textures"].size() - 1}};
  }

  /// The file's bytes.
  std::string finish(const std::string& name) {
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    json_["buffers"] = Json::array({Json{{"byteLength", bytes_.size()}}});
    std::string text = json_.dump(-1, ' ', false, Json::error_handler_t::replace);
    text.resize((text.size() + 3) / 4 * 4, ' ');
    constexpr std::uint64_t kHeads = 12 + 8 + 8;
    const std::uint64_t size = kHeads + text.size() + bytes_.size();
    if (size > std::numeric_limits<std::uint32_t>::max()) {
      throw Error(ErrorCode::output, "'" + name +
                                         "' would be larger than the 4 GiB that a GLB may have: "
                                         "bake smaller maps.");
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

 private:
  std::size_t add_accessor(Json accessor) {
    json_["accessors"].push_back(std::move(accessor));
    return json_["accessors"].size() - 1;
  }
  static void append(std::string& file, std::uint64_t word) {
    for (int shift = 0; shift < 32; shift += 8) file += static_cast<char>(word >> shift & 0xFFU);
  }

  Json json_;
  std::string bytes_;
};

void check_map(const Image* map, std::uint32_t least_channels, const char* name) {
  if (map == nullptr || map->channels >= least_channels) return;
  throw Error(ErrorCode::usage, std::string("save_glb(): the map of ") + name + " has " +
                                    std::to_string(map->channels) + " channels.");
}

/// The first channels of single maps, a channel each; `plain` where there is none.
Image joined(const std::vector<std::pair<const Image*, float>>& channels, const Image* first) {
  Image image;
  for (const auto& [map, plain] : channels) {
    if (map == nullptr) continue;
    if (image.width == 0) {
      image.width = map->width;
      image.height = map->height;
    }
    if (map->width != image.width || map->height != image.height) {
      throw Error(ErrorCode::usage, "save_glb(): maps that share a picture are not of one size.");
    }
  }
  image.channels = static_cast<std::uint32_t>(channels.size());
  const std::size_t texels = std::size_t{image.width} * image.height;
  image.pixels.reserve(texels * channels.size());
  for (std::size_t i = 0; i < texels; ++i) {
    for (std::size_t c = 0; c < channels.size(); ++c) {
      const Image* const map = channels[c].first;
      const std::size_t of = map != nullptr && map == first ? c : 0;
      image.pixels.push_back(map == nullptr ? channels[c].second
                                            : map->pixels[i * map->channels + of]);
    }
  }
  return image;
}

Json material_of(Glb& glb, const AssetMaps& maps, const SaveGlbOptions& options,
                 const std::string& name) {
  check_map(maps.normal, 3, "normals");
  check_map(maps.color, 3, "colour");
  check_map(maps.emission, 3, "emission");
  Json material = Json::object();
  material["name"] = name;
  Json surface = Json::object();
  surface["metallicFactor"] = maps.metallic != nullptr ? 1 : 0;
  surface["roughnessFactor"] = 1;
  if (maps.color != nullptr || maps.opacity != nullptr) {
    std::vector<std::pair<const Image*, float>> channels(3, {maps.color, 1.0F});
    if (maps.opacity != nullptr) channels.emplace_back(maps.opacity, 1.0F);
    surface["baseColorTexture"] = glb.add_picture(joined(channels, maps.color), "base color");
  }
  if (maps.opacity != nullptr && options.alpha_mode != AlphaMode::opaque) {
    const bool mask = options.alpha_mode == AlphaMode::mask;
    material["alphaMode"] = mask ? "MASK" : "BLEND";
    if (mask) material["alphaCutoff"] = options.alpha_cutoff;
  }
  const bool shiny = maps.roughness != nullptr || maps.metallic != nullptr;
  if (shiny || maps.occlusion != nullptr) {
    const float metallic = maps.metallic != nullptr ? 1.0F : 0.0F;
    const Json texture = glb.add_picture(
        joined({{maps.occlusion, 1.0F}, {maps.roughness, 1.0F}, {maps.metallic, metallic}},
               nullptr),
        "occlusion, roughness, metalness");
    if (shiny) surface["metallicRoughnessTexture"] = texture;
    if (maps.occlusion != nullptr) material["occlusionTexture"] = texture;
  }
  if (maps.normal != nullptr) material["normalTexture"] = glb.add_picture(*maps.normal, "normal");
  if (maps.emission != nullptr) {
    material["emissiveTexture"] = glb.add_picture(*maps.emission, "emission");
    material["emissiveFactor"] = Json::array({1, 1, 1});
  }
  if (options.double_sided) material["doubleSided"] = true;
  material["pbrMetallicRoughness"] = std::move(surface);
  return material;
}

}  // namespace

void save_glb(const Mesh& low, const AssetMaps& maps, const std::filesystem::path& path,
              const SaveGlbOptions& options) {
  Glb glb;
  Json& json = glb.json();
  if (!options.extras.empty()) {
    json["asset"]["extras"]["kiln"] = Json::parse(options.extras, nullptr, false);
    if (json["asset"]["extras"]["kiln"].is_discarded()) {
      throw Error(ErrorCode::usage, "save_glb(): SaveGlbOptions::extras are no JSON.");
    }
  }
  const std::string name = low.name.empty() ? "mesh" : low.name;
  Json root = Json::object();
  root["name"] = name;
  const double metres = options.metres > 0 ? options.metres : 1;
  if (metres != 1) root["scale"] = Json::array({metres, metres, metres});
  if (low.origin != std::array<double, 3>{}) {
    root["translation"] =
        Json::array({metres * low.origin[0], metres * low.origin[1], metres * low.origin[2]});
  }
  json["nodes"].push_back(std::move(root));
  const std::vector<Part> parts = parts_of(low);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Part& part = parts[i];
    if (part.indices.empty()) continue;
    Json attributes = {{"POSITION", glb.add_values(part.vertices, 0, 3, "VEC3", true)},
                       {"NORMAL", glb.add_values(part.vertices, 3, 3, "VEC3", false)},
                       {"TANGENT", glb.add_values(part.vertices, 6, 4, "VEC4", false)},
                       {"TEXCOORD_0", glb.add_values(part.vertices, 10, 2, "VEC2", false)}};
    const std::size_t indices = glb.add_indices(part.indices);
    const std::string& object = low.objects.empty() ? name : low.object_names[i];
    Json primitive = {{"attributes", std::move(attributes)}, {"indices", indices}, {"material", 0}};
    json["meshes"].push_back(
        Json{{"name", object}, {"primitives", Json::array({std::move(primitive)})}});
    const std::size_t mesh = json["meshes"].size() - 1;
    if (low.objects.empty()) {
      json["nodes"][0]["mesh"] = mesh;
      continue;
    }
    json["nodes"].push_back(Json{{"name", object}, {"mesh", mesh}});
    json["nodes"][0]["children"].push_back(json["nodes"].size() - 1);
  }
  if (!json.contains("meshes")) {
    throw Error(ErrorCode::input, "Mesh '" + low.name + "' has no triangle with UVs to write.");
  }
  json["materials"] = Json::array({material_of(glb, maps, options, name)});
  save_text(path, glb.finish(path.string()));
}

}  // namespace kiln
