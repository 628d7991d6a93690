// A low poly with its maps as one file that engines open.
#include "kiln/asset.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <set>

#include "base/fnv.h"
#include "base/formatted.h"
#include "clean/open_shells.h"
#include "image/mip_padding.h"
#include "job/map_words.h"
#include "job/run.h"
#include "job/transfers.h"
#include "kiln/files.h"
#include "options/json.h"
#include "options/parse.h"

namespace kiln {
namespace {

/// True if a surface shows otherwise than opaque, from its front.
bool is_special(const Material& m) { return is_transparent(m) || m.double_sided; }

/// The material of a name that a file describes; null: none.
const Material* find_material(const std::vector<Material>& materials, const std::string& name) {
  const auto found = std::find_if(materials.begin(), materials.end(), [&](const Material& m) {
    return m.name == name && !m.place.empty();
  });
  return found == materials.end() ? nullptr : &*found;
}

/// LOW as it is written: a material for each pair of a texture set and a source material.
struct AssetMesh {
  Mesh mesh;
  std::vector<AssetMaterial> materials;
  std::vector<std::size_t> sets;   ///< Per material
  std::vector<bool> states_sides;  ///< Per material: a glTF says whether it shows backs
};

/// The alpha mode that all materials have; none: each that of its source.
std::optional<AlphaMode> common_alpha_mode(const BakeRun& run) {
  if (run.arguments.alpha) return run.arguments.alpha;
  const std::vector<Material>& high = run.high.beside.materials;
  const bool own = run.own_images.contains("opacity");
  const bool any = std::any_of(high.begin(), high.end(), is_transparent);
  if (!run.has_opacity || (any && !own)) return std::nullopt;
  const bool blends = std::any_of(high.begin(), high.end(), [](const Material& m) {
    return is_transparent(m) && m.alpha_mode == AlphaMode::blend;
  });
  return blends ? AlphaMode::blend : AlphaMode::mask;
}

bool has_height_field(const BakeRun& run) {
  return run.high.heights || (run.hooks.high != nullptr && run.hooks.high->height_field);
}

/// Shows the backs of open shells where no glTF says whether they are to be shown.
/// \param written   its mesh names these materials
/// \param warnings  null: none are added
void show_backs_of_shells(const BakeRun& run, AssetMesh& written, std::vector<Warning>* warnings) {
  if (run.arguments.double_sided || !writes_gltf(run.arguments) || has_height_field(run)) return;
  std::vector<AssetMaterial>& materials = written.materials;
  const std::vector<bool>& stated = written.states_sides;
  if (std::find(stated.begin(), stated.end(), false) == stated.end()) return;
  const Mesh& mesh = written.mesh;
  const std::vector<OpenShells> shells = find_open_shells(mesh);
  OpenShells sum;
  bool any = false;
  for (std::size_t m = 0; m < std::min(shells.size(), materials.size()); ++m) {
    if (stated[m] || !shells[m].shows_backs()) continue;
    materials[m].double_sided = true;
    if (!any) sum.example = shells[m].example;
    any = true;
    sum.front += shells[m].front;
    sum.back += shells[m].back;
  }
  if (!any || warnings == nullptr) return;
  const std::string what = formatted(
      "'%s' is open, one part at (%.5g, %.5g, %.5g): %.0f%% of what views from outside see of it "
      "are backs of faces. Its material shows them (double-sided). To hide them, add ",
      mesh.name.c_str(), mesh.origin[0] + sum.example.x, mesh.origin[1] + sum.example.y,
      mesh.origin[2] + sum.example.z,
      100.0 * static_cast<double>(sum.back) / static_cast<double>(sum.front + sum.back));
  warnings->push_back({"double-sided", what + option("double_sided", "no") + ".", sum.back});
}

/// Look of a material of LOW, by the one of HIGH; else by LOW's own.
void describe_surface(const BakeRun& run, const Material* of_high, const Material* of_low,
                      AssetMaterial& material) {
  const Material* const shown = of_high != nullptr ? of_high : of_low;
  const std::optional<AlphaMode> common = common_alpha_mode(run);
  material.alpha_mode = common.value_or(AlphaMode::opaque);
  if (of_high != nullptr && is_transparent(*of_high)) {
    material.alpha_mode = common.value_or(of_high->alpha_mode);
    const bool cuts = of_high->alpha_mode == material.alpha_mode;
    if (cuts && !run.own_images.contains("opacity")) {
      material.alpha_cutoff = of_high->alpha_cutoff;
    }
  }
  if (shown != nullptr) {
    material.double_sided = shown->double_sided || (of_low != nullptr && of_low->double_sided);
  }
  material.double_sided = run.arguments.double_sided.value_or(material.double_sided);
  if (shown == nullptr) return;
  material.extras = of_low != nullptr ? of_low->extras : shown->extras;
}

AssetMesh with_materials(const BakeRun& run, const Mesh& low_poly,
                         std::vector<Warning>* warnings = nullptr) {
  AssetMesh result{low_poly, {}, {}, {}};
  Mesh& mesh = result.mesh;
  const std::vector<Material>&high = run.high.beside.materials, &low = run.low.beside.materials;
  const std::string plain = mesh.name.empty() ? "mesh" : mesh.name;
  const bool by_material = run.arguments.sets == SetsBy::material;
  if (!run.sets.empty()) mesh.tangents = tangents_of(mesh);  // before UVs move
  std::vector<std::size_t> set_of(mesh.triangles.size(), 0);
  for (std::size_t s = 0; s < run.sets.size(); ++s) {
    for (const std::uint32_t t : run.sets[s].set.members) set_of[t] = s;
  }
  if (std::any_of(run.sets.begin(), run.sets.end(),
                  [](const BakedSet& set) { return set.set.tile_u > 0 || set.set.tile_v > 0; })) {
    move_uvs(
        set_of,
        [&](std::size_t s, const Vec2& uv) {
          const TextureSet& set = run.sets[s].set;
          return Vec2{uv.x - static_cast<float>(set.tile_u), uv.y - static_cast<float>(set.tile_v)};
        },
        mesh);  // each tile's to the unit square
  }
  struct Key {
    std::size_t set;
    std::uint32_t own, hit;
    auto operator<=>(const Key&) const = default;
  };
  std::map<Key, std::uint32_t> known;
  const std::vector<std::string> names = std::move(mesh.material_names);
  std::vector<std::uint32_t> of = std::move(mesh.materials);
  if (of.empty()) of.assign(mesh.triangles.size(), 0);
  mesh.material_names.clear();
  mesh.materials.clear();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::string& own = names.empty() ? plain : names[of[t]];
    const Material* of_high = find_material(high, own);
    Key key{set_of[t], of[t], BakeRun::kNoMaterial};
    if (of_high == nullptr && !run.materials_hit.empty()) key.hit = run.materials_hit[t];
    const auto [entry, added] =
        known.emplace(key, static_cast<std::uint32_t>(mesh.material_names.size()));
    mesh.materials.push_back(entry->second);
    if (!added) continue;
    AssetMaterial& material = result.materials.emplace_back();
    material.name = own;
    if (key.hit != BakeRun::kNoMaterial) {
      of_high = &high[key.hit];
      material.name = high[key.hit].name;
    }
    if (!run.sets.empty()) {
      const BakedSet& set = run.sets[key.set];
      const std::string tile = set.set.tile.empty() ? "" : "." + set.set.tile;
      material.set = set.word + tile;
      if (!by_material) material.name += "." + set.set.name;
      material.name += tile;
    }
    if (!run.pictures.empty()) material.pictures = run.pictures[key.set];
    result.sets.push_back(key.set);
    const Material* const of_low = find_material(low, own);
    describe_surface(run, of_high, of_low, material);
    result.states_sides.push_back((of_high != nullptr && of_high->multiplies) ||
                                  (of_low != nullptr && of_low->multiplies));
    mesh.material_names.push_back(material.name);
  }
  show_backs_of_shells(run, result, warnings);
  return result;
}

/// The node of each object, by its name.
std::vector<std::uint32_t> object_nodes(const Asset& beside, const Mesh& mesh) {
  std::vector<std::uint32_t> nodes;
  const std::vector<std::string>& names = beside.mesh.object_names;
  for (const std::string& object : mesh.object_names) {
    const auto found = std::find(names.begin(), names.end(), object);
    nodes.push_back(found == names.end()
                        ? AssetNode::kNone
                        : beside.object_nodes[static_cast<std::size_t>(found - names.begin())]);
  }
  if (mesh.objects.empty()) nodes.assign(1, AssetNode::kNone);
  return nodes;
}

/// Files by name, with their bytes' FNV-1a of 64 bits; null: of a mesh in memory.
Json hashes_of(const std::vector<JobInput>& inputs) {
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

Mesh with_hulls(const Mesh& low, const Mesh& hulls) {
  if (hulls.triangles.empty()) return low;
  const Mesh parts[] = {low, hulls};
  Mesh whole = join_meshes(parts);
  whole.name = low.name;
  whole.material_files = low.material_files;
  return whole;
}

void note_materials_hit(BakeRun& run) {
  if (!run.result.match) return;
  const Match& match = *run.result.match;
  const Mesh &low = run.low.mesh, &high = run.high_mesh();
  const std::vector<Material>& materials = run.high.beside.materials;
  run.materials_hit.resize(low.triangles.size(), BakeRun::kNoMaterial);
  constexpr int kSteps = 8;  // places along an edge
  const auto texel = [](double value, std::uint32_t size) {
    const double inside = (value - std::floor(value)) * size;
    return std::min(static_cast<std::uint32_t>(inside), size - 1);
  };
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    const auto& [a, b, c] = low.uv_triangles[t];
    const Vec2 &p = low.uvs[a], &q = low.uvs[b], &r = low.uvs[c];
    if (!std::isfinite(p.x + p.y + q.x + q.y + r.x + r.y)) continue;  // of another set
    std::map<std::uint32_t, int> hits;
    for (int i = 0; i < kSteps; ++i) {
      for (int k = 0; i + k < kSteps; ++k) {
        const double u = (i + 1.0 / 3) / kSteps, v = (k + 1.0 / 3) / kSteps, w = 1 - u - v;
        const std::uint32_t x = texel(w * p.x + u * q.x + v * r.x, match.width);
        const std::uint32_t y = texel(1 - (w * p.y + u * q.y + v * r.y), match.height);
        const std::uint32_t hit = match.triangle[std::size_t{y} * match.width + x];
        if (hit < high.materials.size() && is_special(materials[high.materials[hit]])) {
          ++hits[high.materials[hit]];
        }
      }
    }
    const auto most = std::max_element(
        hits.begin(), hits.end(), [](const auto& x, const auto& y) { return x.second < y.second; });
    if (most != hits.end()) run.materials_hit[t] = most->first;
  }
}

void start_asset_maps(Job& arguments) {
  if (!asset_file(arguments).empty() && !arguments.given.contains("--maps")) {
    arguments.bake.maps = {MapKind::normal, "ao"};
  }
}

void choose_asset_maps(BakeRun& run) {
  Job& arguments = run.arguments;
  if (asset_file(arguments).empty()) return;
  if (arguments.given.contains("--maps")) return;
  const MaterialMaps found = material_maps(run.high_mesh(), run.high.beside.materials,
                                           writes_gltf(arguments), run.warnings);
  for (const std::string& name : found.maps) arguments.bake.maps.emplace_back(name);
  arguments.transfers.insert(arguments.transfers.end(), found.transfers.begin(),
                             found.transfers.end());
  run.options = options_of(arguments);
}

void keep_asset_match(BakeRun& run) {
  if (asset_file(run.arguments).empty() || run.arguments.low.given.empty()) return;
  const std::vector<Material>& materials = run.high.beside.materials;
  const std::vector<std::string>& names = run.low.mesh.material_names;
  const bool special = std::any_of(materials.begin(), materials.end(), is_special);
  const bool told =
      !names.empty() && std::all_of(names.begin(), names.end(), [&](const auto& name) {
        return find_material(materials, name) != nullptr;
      });
  if (special && !told) run.options.report.keep_match = true;
}

void encode_asset_maps(BakeRun& run) {
  std::string left;
  AssetMaps maps = asset_maps(
      run.result.maps, [&](BakedMap& map, const std::string& name) { store(run, map, name); },
      &left);
  if (!left.empty() && run.pictures.empty()) {
    run.warnings.push_back(
        {"maps-left-out",
         "A glTF's material has no place for the maps " + left + ": bake them into a folder.", 1});
  }
  for (auto& [name, image] : run.own_images) {
    const Image** const slot = slot_of(maps, name);
    if (slot == nullptr) continue;
    if (pads_for_mips(run)) pad_for_mips(image, run.result.coverage);
    *slot = &image;
    if (slot == &maps.emission) maps.emission_strength = 1;
  }
  run.has_opacity |= maps.opacity != nullptr;
  maps.coverage = run.result.coverage;
  const Job& job = run.arguments;
  if (job.max_bytes != 0) {
    fit_asset_maps(run, maps);
    note_materials_hit(run);
    return;
  }
  run.pictures.push_back(std::make_shared<const AssetPictures>(encode_maps(maps, job.pictures)));
  if (job.pictures.format == PictureFormat::jpeg && maps.opacity != nullptr) {
    run.warnings.push_back({"jpeg-alpha",
                            "JPEG has no alpha: colours with opacity are a PNG. " +
                                option("format", "webp") +
                                " "
                                "packs them, too.",
                            1});
  }
  if (job.pictures.max_normal_error > 0 && maps.normal != nullptr &&
      run.pictures.back()->normal_quality == 0) {
    run.warnings.push_back(
        {"normal-error",
         formatted("No lossy quality keeps normals within %.3g degrees in the mean: they are "
                   "lossless. Allow more ",
                   job.pictures.max_normal_error) +
             option("normal_error") + ".",
         1});
  }
  for (const AssetError& error : run.pictures.back()->errors) {
    run.stored_errors[std::string(error.map)] = describe(error.error, error.is_normal);
  }
  note_materials_hit(run);
}

namespace {

/// What an asset holds beside mesh, materials and asset_extras().
SaveAssetOptions asset_options(const BakeRun& run, const Mesh& written) {
  const Job& arguments = run.arguments;
  const Asset& beside = arguments.low.given.empty() ? run.high.beside : run.low.beside;
  SaveAssetOptions options;
  options.nodes = beside.nodes;
  if (!options.nodes.empty()) options.object_nodes = object_nodes(beside, written);
  if (!run.low.hulls.triangles.empty()) {
    options.hulls = &run.low.hulls;
    if (!options.nodes.empty()) options.hull_nodes = object_nodes(beside, run.low.hulls);
  }
  options.metres = arguments.low.given.empty() ? run.high_mesh().metres : run.low.mesh.metres;
  options.extras = beside.extras;
  options.copyright = beside.copyright;
  options.scene = beside.scene;
  options.compression = arguments.mesh_compression;
  return options;
}

}  // namespace

std::string asset_extras(const BakeRun& run) {
  const Job& arguments = run.arguments;
  const BakeReport& report = run.result.report;
  Json extras = {{"version", version()},
                 {"inputs", {{"high", hashes_of(arguments.high)}}},
                 {"options", describe(arguments, report)},
                 {"texels", describe_texels(report)}};
  if (!arguments.low.given.empty()) extras["inputs"]["low"] = hashes_of(arguments.low.given);
  if (!report.errors.empty()) extras["errors"] = describe(report.errors);
  if (run.sets.empty()) extras["stored_errors"] = run.stored_errors;
  if (!run.sets.empty()) extras["sets"] = run.set_reports;
  return to_text(extras);
}

std::uint64_t bytes_without_pictures(const BakeRun& run, const Mesh& low) {
  AssetMesh written = with_materials(run, low);
  const auto placeholder = std::make_shared<AssetPictures>();
  for (auto* picture :
       {&placeholder->color, &placeholder->surface, &placeholder->normal, &placeholder->emission}) {
    picture->resize(1);
  }
  placeholder->has_color = placeholder->has_opacity = placeholder->has_occlusion =
      placeholder->has_surface = placeholder->has_metallic = true;
  for (AssetMaterial& material : written.materials) material.pictures = placeholder;
  return encode_glb(written.mesh, written.materials, asset_options(run, written.mesh)).size();
}

bool save_asset(BakeRun& run) {
  const Job& arguments = run.arguments;
  AssetMesh written = with_materials(run, run.low.mesh, &run.warnings);
  SaveAssetOptions options = asset_options(run, written.mesh);
  options.kiln_extras = asset_extras(run);
  if (arguments.max_bytes != 0) {
    fit_pictures(run, [&] {
      for (std::size_t i = 0; i < written.materials.size(); ++i) {
        written.materials[i].pictures = run.pictures[written.sets[i]];
      }
      return encode_glb(written.mesh, written.materials, options).size();
    });
  }
  if (!announce(run, asset_file(arguments))) return false;
  if (arguments.in_memory) {
    run.glb = encode_glb(written.mesh, written.materials, options);
    return true;
  }
  const auto files = save_asset(written.mesh, written.materials, asset_file(arguments), options);
  for (const std::filesystem::path& file : files) {
    if (file != asset_file(arguments)) run.outputs.push_back(file.string());
  }
  return true;
}

bool save_obj_with_mtl(BakeRun& run) {
  const Job& arguments = run.arguments;
  const std::filesystem::path path = asset_file(arguments), mtl = path.stem().string() + ".mtl";
  AssetMesh written = with_materials(run, run.low.mesh);
  std::string text = "# Kiln " + std::string(version()) + "\n\n";
  std::set<std::string> taken;
  for (std::size_t i = 0; i < written.materials.size(); ++i) {
    std::string name = written.materials[i].name;
    for (char& c : name) {
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F || c == '\\') c = '_';
    }
    while (!taken.insert(name).second) name += "_";
    written.mesh.material_names[i] = name;
    const SetNames names = run.sets.empty() ? SetNames{run.low.stem, "", ""}
                                            : names_of(arguments, run.sets[written.sets[i]]);
    const auto file_of = [&](const std::string& map) {
      const std::vector<std::string> maps = all_maps(arguments);
      return std::find(maps.begin(), maps.end(), map) == maps.end()
                 ? ""
                 : names.stem + "_" + map + names.tile + extension(run.save_options);
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
    add("map_Bump", normal);  // many know no `norm`
    text += "Pr 1\nPm 0\n";
    add("map_Pr", "roughness");
    add("map_Pm", "metallic");
    if (!file_of("emission").empty()) text += "Ke 1 1 1\n";
    add("map_Ke", "emission");
    text += "\n";
  }
  written.mesh.material_files = {mtl.string()};
  if (!announce(run, path.parent_path() / mtl)) return false;
  save_text(path.parent_path() / mtl, text);
  if (!announce(run, path)) return false;
  save_obj(with_hulls(written.mesh, run.low.hulls), path);
  return true;
}

}  // namespace kiln
