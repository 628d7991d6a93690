// Writes a low poly with its maps as one asset: GLB, glTF, or OBJ with MTL.
#include "kiln/asset.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <set>
#include <string_view>
#include <unordered_map>

#include "asset/asset_maps.h"
#include "base/fnv.h"
#include "base/formatted.h"
#include "image/mip_padding.h"
#include "job/map_words.h"
#include "job/open_shell_sides.h"
#include "job/stages.h"
#include "job/transfers.h"
#include "kiln/files.h"
#include "kiln/version.h"
#include "options/json.h"
#include "options/parse.h"

namespace kiln {
namespace {

/// True if a material is transparent or double-sided: triangles that match it need a material of their own in the
/// asset.
bool is_transparent_or_double_sided(const Material& m) {
  return is_transparent(m) || m.double_sided;
}

/// Finds the materials of a file by name. Refers to the materials, which must outlive it.
class MaterialNames {
 public:
  explicit MaterialNames(const std::vector<Material>& materials) {
    for (const Material& m : materials) {
      if (!m.place.empty())
        by_name_.emplace(m.name, &m);  // the first of several materials with the same name is used
    }
  }
  /// \returns null if there is none
  const Material* find(std::string_view name) const {
    const auto found = by_name_.find(name);
    return found == by_name_.end() ? nullptr : found->second;
  }

 private:
  std::unordered_map<std::string_view, const Material*> by_name_;
};

/// LOW with the asset's materials: one for each pair of a texture set and a source material that occurs.
struct AssetMesh {
  Mesh mesh;
  std::vector<AssetMaterial> materials;
  std::vector<std::size_t> sets;  ///< Index of each material's texture set
  /// Per material: true if a glTF file states whether its back faces are shown
  std::vector<bool> sidedness_is_stated;
};

/// The alpha mode that applies to all materials; nullopt if each material keeps the mode of its source.
std::optional<AlphaMode> common_alpha_mode(const BakeScene& scene, const AssetParts& asset) {
  if (scene.run.job.alpha) return scene.run.job.alpha;
  const std::vector<Material>& high = scene.high.input.nodes_and_materials.materials;
  const bool any_transparent = std::any_of(high.begin(), high.end(), is_transparent);
  if (!asset.has_opacity || (any_transparent && !asset.opacity_is_sampled)) return std::nullopt;
  const bool has_blending = std::any_of(high.begin(), high.end(), [](const Material& m) {
    return is_transparent(m) && m.alpha_mode == AlphaMode::blend;
  });
  return has_blending ? AlphaMode::blend : AlphaMode::mask;
}

/// Copies the alpha mode, sidedness and extras from HIGH's material, or from LOW's own material if HIGH's is null.
/// \param common  common_alpha_mode()
void copy_surface_properties(const BakeScene& scene, const AssetParts& asset,
                             std::optional<AlphaMode> common, const Material* high_material,
                             const Material* low_material, AssetMaterial& material) {
  const Material* const source_material = high_material != nullptr ? high_material : low_material;
  material.alpha_mode = common.value_or(AlphaMode::opaque);
  if (high_material != nullptr && is_transparent(*high_material)) {
    material.alpha_mode = common.value_or(high_material->alpha_mode);
    const bool same_alpha_mode = high_material->alpha_mode == material.alpha_mode;
    if (same_alpha_mode && !asset.opacity_is_sampled)
      material.alpha_cutoff = high_material->alpha_cutoff;
  }
  if (source_material != nullptr) {
    material.double_sided =
        source_material->double_sided || (low_material != nullptr && low_material->double_sided);
  }
  material.double_sided = scene.run.job.double_sided.value_or(material.double_sided);
  if (source_material == nullptr) return;
  material.extras = low_material != nullptr ? low_material->extras : source_material->extras;
}

AssetMesh make_asset_mesh(const BakeScene& scene, const Mesh& low_poly, const AssetParts& asset) {
  AssetMesh result{low_poly, {}, {}, {}};
  Mesh& mesh = result.mesh;
  const std::span<const BakedSet> sets = scene.sets;
  const std::vector<Material>&high = scene.high.input.nodes_and_materials.materials,
        &low = scene.low.nodes_and_materials.materials;
  const MaterialNames high_names(high), low_names(low);
  const std::optional<AlphaMode> common = common_alpha_mode(scene, asset);
  const std::string default_name = mesh.name.empty() ? "mesh" : mesh.name;
  const bool by_material = scene.run.job.sets == SetsBy::material;
  if (!sets.empty())
    mesh.tangents =
        tangents_of(mesh);  // MikkTSpace needs the UVs before they move to the unit square
  std::vector<std::size_t> set_of_triangle(mesh.triangles.size(), 0);
  for (std::size_t s = 0; s < sets.size(); ++s) {
    for (const std::uint32_t t : sets[s].set.members) set_of_triangle[t] = s;
  }
  if (std::any_of(sets.begin(), sets.end(),
                  [](const BakedSet& set) { return set.set.tile_u > 0 || set.set.tile_v > 0; })) {
    move_uvs(
        set_of_triangle,
        [&](std::size_t s, const Vec2& uv) {
          const TextureSet& set = sets[s].set;
          return Vec2{uv.x - static_cast<float>(set.tile_u), uv.y - static_cast<float>(set.tile_v)};
        },
        mesh);  // moves the UVs of each UDIM tile to the unit square
  }
  struct MaterialKey {
    std::size_t set;
    std::uint32_t own, hit;
    auto operator<=>(const MaterialKey&) const = default;
  };
  std::map<MaterialKey, std::uint32_t> material_of_key;
  const std::vector<std::string> names = std::move(mesh.material_names);
  std::vector<std::uint32_t> material_of = std::move(mesh.materials);
  if (material_of.empty()) material_of.assign(mesh.triangles.size(), 0);
  mesh.material_names.clear();
  mesh.materials.clear();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::string& own_name = names.empty() ? default_name : names[material_of[t]];
    const Material* high_material = high_names.find(own_name);
    MaterialKey key{set_of_triangle[t], material_of[t], AssetParts::kNoMaterial};
    if (high_material == nullptr && !asset.materials_hit.empty()) key.hit = asset.materials_hit[t];
    const auto [entry, added] =
        material_of_key.emplace(key, static_cast<std::uint32_t>(mesh.material_names.size()));
    mesh.materials.push_back(entry->second);
    if (!added) continue;
    AssetMaterial& material = result.materials.emplace_back();
    material.name = own_name;
    if (key.hit != AssetParts::kNoMaterial) {
      high_material = &high[key.hit];
      material.name = high[key.hit].name;
    }
    if (!sets.empty()) {
      const BakedSet& set = sets[key.set];
      const std::string tile = set.set.tile.empty() ? "" : "." + set.set.tile;
      material.set = set.word + tile;
      if (!by_material) material.name += "." + set.set.name;
      material.name += tile;
    }
    if (!asset.pictures.empty()) material.pictures = asset.pictures[key.set];
    result.sets.push_back(key.set);
    const Material* const low_material = low_names.find(own_name);
    copy_surface_properties(scene, asset, common, high_material, low_material, material);
    result.sidedness_is_stated.push_back((high_material != nullptr && high_material->multiplies) ||
                                         (low_material != nullptr && low_material->multiplies));
    mesh.material_names.push_back(material.name);
  }
  return result;
}

/// Returns the node of each object, found by the object's name; AssetNode::kNone if the file has no such node.
std::vector<std::uint32_t> object_nodes(const Asset& nodes_and_materials, const Mesh& mesh) {
  std::vector<std::uint32_t> nodes;
  const std::vector<std::string>& names = nodes_and_materials.mesh.object_names;
  std::unordered_map<std::string_view, std::uint32_t> node_by_name;
  for (std::size_t i = 0; i < names.size(); ++i)
    node_by_name.emplace(names[i], nodes_and_materials.object_nodes[i]);
  for (const std::string& object : mesh.object_names) {
    const auto found = node_by_name.find(object);
    nodes.push_back(found == node_by_name.end() ? AssetNode::kNone : found->second);
  }
  if (mesh.objects.empty()) nodes.assign(1, AssetNode::kNone);
  return nodes;
}

/// Names and 64-bit FNV-1a hashes of the input files; the hash is null for a mesh in memory.
Json hash_inputs(const std::vector<JobInput>& inputs) {
  Json json = Json::array();
  for (const JobInput& input : inputs) {
    const std::string& file = input.name;
    if (input.asset) {
      json.push_back({{"file", file}, {"fnv1a", Json()}});
      continue;
    }
    std::ifstream in(file, std::ios::binary);
    std::vector<char> buffer(1U << 20U);
    std::uint64_t hash = Fnv1a().value;
    while (in.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || in.gcount() > 0) {
      hash = fnv1a({buffer.data(), static_cast<std::size_t>(in.gcount())}, hash);
    }
    json.push_back({{"file", std::filesystem::path(file).filename().string()},
                    {"fnv1a", formatted("%016llx", static_cast<unsigned long long>(hash))}});
  }
  return json;
}

}  // namespace

Mesh join_collision_hulls(const Mesh& low, const Mesh& hulls) {
  if (hulls.triangles.empty()) return low;
  const Mesh parts[] = {low, hulls};
  Mesh joined_mesh = join_meshes(parts);
  joined_mesh.name = low.name;
  joined_mesh.material_files = low.material_files;
  return joined_mesh;
}

void find_materials_hit(const BakeScene& scene, const BakeResult& result, AssetParts& asset) {
  if (!result.match) return;
  const Match& match = *result.match;
  const Mesh &low = scene.low.mesh, &high = scene.high.mesh();
  const std::vector<Material>& materials = scene.high.input.nodes_and_materials.materials;
  asset.materials_hit.resize(low.triangles.size(), AssetParts::kNoMaterial);
  constexpr int kSamplesPerEdge = 8;  // sample points per edge of a triangle
  const auto texel = [](double value, std::uint32_t size) {
    const double position_in_tile = (value - std::floor(value)) * size;
    return std::min(static_cast<std::uint32_t>(position_in_tile), size - 1);
  };
  const auto find = [&](std::size_t t) {
    const auto& [a, b, c] = low.uv_triangles[t];
    const Vec2 &p = low.uvs[a], &q = low.uvs[b], &r = low.uvs[c];
    // the triangle belongs to another texture set
    if (!std::isfinite(p.x + p.y + q.x + q.y + r.x + r.y)) return;
    std::map<std::uint32_t, int> triangle_hits;
    for (int i = 0; i < kSamplesPerEdge; ++i) {
      for (int k = 0; i + k < kSamplesPerEdge; ++k) {
        const double u = (i + 1.0 / 3) / kSamplesPerEdge, v = (k + 1.0 / 3) / kSamplesPerEdge,
                     w = 1 - u - v;
        const std::uint32_t x = texel(w * p.x + u * q.x + v * r.x, match.width);
        const std::uint32_t y = texel(1 - (w * p.y + u * q.y + v * r.y), match.height);
        const std::uint32_t hit = match.triangle[std::size_t{y} * match.width + x];
        if (hit < high.materials.size() &&
            is_transparent_or_double_sided(materials[high.materials[hit]])) {
          ++triangle_hits[high.materials[hit]];
        }
      }
    }
    const auto most_hit =
        std::max_element(triangle_hits.begin(), triangle_hits.end(),
                         [](const auto& x, const auto& y) { return x.second < y.second; });
    if (most_hit != triangle_hits.end()) asset.materials_hit[t] = most_hit->first;
  };
  if (scene.set == nullptr) {
    for (std::size_t t = 0; t < low.triangles.size(); ++t) find(t);
  } else {
    for (const std::uint32_t t : scene.set->set.members) find(t);
  }
}

void set_default_asset_maps(Job& job) {
  if (!asset_file(job).empty() && !job.given.contains("--maps")) {
    job.bake.maps = {MapKind::normal, "ao"};
  }
}

bool add_material_maps(Job& job, const LoadedHigh& high, RunLog& log) {
  if (asset_file(job).empty() || job.given.contains("--maps")) return false;
  const MaterialMaps found = material_maps(high.mesh(), high.input.nodes_and_materials.materials,
                                           writes_gltf(job), log.warnings);
  for (const std::string& name : found.maps) job.bake.maps.emplace_back(name);
  job.transfers.insert(job.transfers.end(), found.transfers.begin(), found.transfers.end());
  return true;
}

bool needs_asset_match(const BakeScene& scene) {
  const Job& job = scene.run.job;
  if (asset_file(job).empty() || job.low.given.empty()) return false;
  const std::vector<Material>& materials = scene.high.input.nodes_and_materials.materials;
  if (std::none_of(materials.begin(), materials.end(), is_transparent_or_double_sided))
    return false;
  const std::vector<std::string>& names = scene.low.mesh.material_names;
  const MaterialNames known_names(materials);
  return names.empty() || std::any_of(names.begin(), names.end(), [&](const auto& name) {
           return known_names.find(name) == nullptr;
         });
}

void encode_asset_maps(const BakeScene& scene, const Source& source, const PlannedLow* planned,
                       BakedLayout& baked, AssetParts& asset) {
  RunLog& log = scene.run.log;
  std::string left_out_maps;
  AssetMaps maps = asset_maps(
      baked.result.maps,
      [&](BakedMap& map, const std::string& name) { convert_to_stored(scene, map, name, baked); },
      &left_out_maps);
  if (!left_out_maps.empty() && asset.pictures.empty()) {
    log.warnings.push_back({"maps-left-out",
                            "A glTF's material has no place for the maps " + left_out_maps +
                                ": bake them into a folder.",
                            1});
  }
  const bool pads_for_mip_levels = pads_for_mips(scene.run.job),
             keeps_given_padding = chooses_padding(scene.run.job);
  for (BakedMap& map : baked.result.maps) {
    if (pads_for_mip_levels) pad_for_mips(map, baked.result.coverage, keeps_given_padding);
  }
  for (auto& [name, image] : baked.sampled_images) {
    const Image** const slot = slot_of(maps, name);
    if (slot == nullptr) continue;
    if (pads_for_mip_levels) pad_for_mips(image, baked.result.coverage, keeps_given_padding);
    *slot = &image;
    if (slot == &maps.emission) maps.emission_strength = 1;
  }
  asset.opacity_is_sampled |= baked.sampled_images.contains("opacity");
  asset.has_opacity |= maps.opacity != nullptr;
  maps.coverage = baked.result.coverage;
  find_materials_hit(scene, baked.result, asset);
  const Job& job = scene.run.job;
  if (job.max_bytes != 0) {
    fit_asset_maps(scene, source, maps, baked.options, planned, asset);
    return;
  }
  asset.pictures.push_back(std::make_shared<const AssetPictures>(encode_maps(maps, job.pictures)));
  if (job.pictures.format == PictureFormat::jpeg && maps.opacity != nullptr) {
    log.warnings.push_back({"jpeg-alpha",
                            "JPEG has no alpha: colours with opacity are a PNG. " +
                                option("format", "webp") +
                                " "
                                "packs them, too.",
                            1});
  }
  if (job.pictures.max_normal_error > 0 && maps.normal != nullptr &&
      asset.pictures.back()->normal_quality == 0) {
    log.warnings.push_back(
        {"normal-error",
         formatted("No lossy quality keeps normals within %.3g degrees in the mean: they are "
                   "lossless. Allow more ",
                   job.pictures.max_normal_error) +
             option("normal_error") + ".",
         1});
  }
  for (const AssetError& error : asset.pictures.back()->errors) {
    baked.stored.errors[std::string(error.map)] = describe(error.error, error.is_normal);
  }
}

namespace {

/// The asset's nodes, hulls, units and metadata, all except its materials and asset_extras().
SaveAssetOptions asset_options(const BakeScene& scene, const Mesh& written) {
  const Job& job = scene.run.job;
  const LowMesh& low = scene.low;
  const Asset& source_asset =
      job.low.given.empty() ? scene.high.input.nodes_and_materials : low.nodes_and_materials;
  SaveAssetOptions options;
  options.nodes = source_asset.nodes;
  if (!options.nodes.empty()) options.object_nodes = object_nodes(source_asset, written);
  if (!low.hulls.triangles.empty()) {
    options.hulls = &low.hulls;
    if (!options.nodes.empty()) options.hull_nodes = object_nodes(source_asset, low.hulls);
  }
  options.metres = job.low.given.empty() ? scene.high.mesh().metres : low.mesh.metres;
  options.extras = source_asset.extras;
  options.copyright = source_asset.copyright;
  options.scene = source_asset.scene;
  options.compression = job.mesh_compression;
  return options;
}

}  // namespace

std::string asset_extras(const BakeScene& scene, const BakeReport& report, const Json& errors,
                         const Json& set_reports) {
  const Job& job = scene.run.job;
  Json extras = {{"version", version()},
                 {"inputs", {{"high", hash_inputs(job.high)}}},
                 {"options", describe(job, report)},
                 {"texels", describe_texels(report)}};
  if (!job.low.given.empty()) extras["inputs"]["low"] = hash_inputs(job.low.given);
  if (!report.errors.empty()) extras["errors"] = describe(report.errors);
  if (scene.sets.empty()) {
    extras["stored_errors"] = errors;
  } else {
    extras["sets"] = set_reports;
  }
  return to_text(extras);
}

namespace {

/// Leaves out the vertex colours of a low poly that Kiln made if the colour pictures of all its materials replace them.
/// They would be stored as `_COLOR_0`, which no renderer reads, and take a quarter of the bytes of compressed
/// triangles. Vertex colours of a given low poly are kept, since they may be masks that its author painted.
void drop_replaced_vertex_colors(const BakeScene& scene, AssetMesh& written) {
  if (!scene.run.job.low.given.empty()) return;
  const bool pictures_replace_colors = std::all_of(
      written.materials.begin(), written.materials.end(), [](const AssetMaterial& material) {
        return material.pictures && material.pictures->has_color;
      });
  if (pictures_replace_colors) written.mesh.colors.clear();
}

}  // namespace

std::uint64_t bytes_without_pictures(const BakeScene& scene, const Mesh& low) {
  AssetMesh written = make_asset_mesh(scene, low, {});
  const auto placeholder = std::make_shared<AssetPictures>();
  for (auto* picture :
       {&placeholder->color, &placeholder->surface, &placeholder->normal, &placeholder->emission}) {
    picture->resize(1);
  }
  placeholder->has_color = placeholder->has_opacity = placeholder->has_occlusion =
      placeholder->has_surface = placeholder->has_metallic = true;
  for (AssetMaterial& material : written.materials) material.pictures = placeholder;
  const std::vector<std::string> maps = all_map_names(scene.run.job);
  if (std::find(maps.begin(), maps.end(), "color") != maps.end())
    drop_replaced_vertex_colors(scene, written);
  return encode_glb(written.mesh, written.materials, asset_options(scene, written.mesh)).size();
}

namespace {

/// Makes LOW as it is written to the asset: with materials, which are double-sided where views show back faces of open
/// shells.
AssetMesh make_final_asset_mesh(const BakeScene& scene, const AssetParts& asset) {
  const Job& job = scene.run.job;
  AssetMesh written = make_asset_mesh(scene, scene.low.mesh, asset);
  if (!job.double_sided && writes_gltf(job) && !scene.high.is_height_field()) {
    std::optional<Warning> warning =
        show_backs_of_shells(written.mesh, written.sidedness_is_stated, written.materials);
    if (warning) scene.run.log.warnings.push_back(std::move(*warning));
  }
  drop_replaced_vertex_colors(scene, written);
  return written;
}

}  // namespace

AssetLevel make_asset_level(const BakeScene& scene, const AssetParts& asset, std::size_t number) {
  AssetMesh written = make_final_asset_mesh(scene, asset);
  AssetLevel level;
  level.object_nodes = asset_options(scene, written.mesh).object_nodes;
  level.low = std::move(written.mesh);
  level.materials = std::move(written.materials);
  for (AssetMaterial& material : level.materials) material.set = "lod" + std::to_string(number);
  return level;
}

void write_asset(const BakeScene& scene, const std::string& file, const std::string& extras,
                 AssetParts& asset, JobOutputs& outputs, std::vector<AssetLevel> levels) {
  const Job& job = scene.run.job;
  AssetMesh written = make_final_asset_mesh(scene, asset);
  SaveAssetOptions options = asset_options(scene, written.mesh);
  options.kiln_extras = extras;
  options.levels = std::move(levels);
  if (job.max_bytes != 0) {
    const auto file_bytes = [&] {
      for (std::size_t i = 0; i < written.materials.size(); ++i) {
        written.materials[i].pictures = asset.pictures[written.sets[i]];
      }
      return encode_glb(written.mesh, written.materials, options).size();
    };
    fit_pictures(job, file_bytes, asset);
  }
  register_output(scene.run, file, outputs);
  if (job.in_memory) {
    outputs.glb = encode_glb(written.mesh, written.materials, options);
    return;
  }
  for (const auto& path : save_asset(written.mesh, written.materials, file, options)) {
    if (path != file) outputs.files.push_back(path.string());
  }
}

void write_obj_with_mtl(const BakeScene& scene, const AssetParts& asset, JobOutputs& outputs) {
  const Job& job = scene.run.job;
  const std::filesystem::path path = asset_file(job), mtl = path.stem().string() + ".mtl";
  AssetMesh written = make_asset_mesh(scene, scene.low.mesh, asset);
  std::string text = "# Kiln " + std::string(version()) + "\n\n";
  std::set<std::string> used_names;
  for (std::size_t i = 0; i < written.materials.size(); ++i) {
    std::string name = written.materials[i].name;
    for (char& c : name) {
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F || c == '\\') c = '_';
    }
    while (!used_names.insert(name).second) name += "_";
    written.mesh.material_names[i] = name;
    const SetNames names = scene.sets.empty() ? SetNames{scene.low.stem, "", ""}
                                              : names_of(job, scene.sets[written.sets[i]]);
    const auto file_of = [&](const std::string& map) {
      const std::vector<std::string> maps = all_map_names(job);
      return std::find(maps.begin(), maps.end(), map) == maps.end()
                 ? ""
                 : names.stem + "_" + map + names.tile + extension(job.image);
    };
    const auto add = [&](const char* statement, const std::string& map) {
      if (const std::string file = file_of(map); !file.empty()) {
        text += std::string(statement) + " " + file + "\n";
      }
    };
    text += "newmtl " + name + "\nKd 1 1 1\nillum 2\n";
    add("map_Kd", "color");
    if (written.materials[i].alpha_mode != AlphaMode::opaque) add("map_d", "opacity");
    const std::string normal = file_of("normals").empty() ? "normal" : "normals";
    add("norm", normal);
    add("map_Bump", normal);  // map_Bump is added because many programs ignore `norm`
    text += "Pr 1\nPm 0\n";
    add("map_Pr", "roughness");
    add("map_Pm", "metallic");
    if (!file_of("emission").empty()) text += "Ke 1 1 1\n";
    add("map_Ke", "emission");
    text += "\n";
  }
  written.mesh.material_files = {mtl.string()};
  register_output(scene.run, path.parent_path() / mtl, outputs);
  save_text(path.parent_path() / mtl, text);
  register_output(scene.run, path, outputs);
  save_obj(join_collision_hulls(written.mesh, scene.low.hulls), path);
}

}  // namespace kiln
