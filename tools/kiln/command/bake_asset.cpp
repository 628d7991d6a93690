// A low poly with its maps as one file that engines open.
#include <algorithm>

#include "arguments/bake_values.h"
#include "command/bake_run.h"
#include "kiln/asset.h"
#include "report/json_text.h"

namespace kiln::cli {
namespace {

bool has_number(MaterialNumber from) { return from != MaterialNumber::none; }

bool is_transparent(const Material& m) {
  return m.alpha_mode != AlphaMode::opaque && (m.opacity < 1 || !m.opacity_map.empty());
}

}  // namespace

void choose_asset_maps(BakeRun& run) {
  BakeArguments& arguments = run.arguments;
  if (arguments.asset.empty()) return;
  const Mesh& high = run.dense.mesh;
  if (!high.material_files.empty()) {
    try {
      run.materials = load_materials(high, arguments.high, nullptr, arguments.frame.allow_outside);
    } catch (const Error& error) {
      // Maps that need no materials are right without them.
      run.warnings.push_back(
          {"materials-unread", std::string(error.what()) + " The GLB has no colours of them.", 1});
    }
  }
  if (arguments.given.contains("--maps")) return;
  const auto any = [&](const auto& has) {
    return std::any_of(run.materials.begin(), run.materials.end(), has);
  };
  arguments.maps = {"normal", "ao"};
  if (!high.colors.empty() ||
      any([](const Material& m) { return has_number(m.color_from) || !m.color_map.empty(); })) {
    arguments.maps.emplace_back("color");
  }
  if (any(is_transparent)) arguments.maps.emplace_back("opacity");
  const auto transfer = [&](bool there, const char* slot) {
    if (there) arguments.transfers.push_back(std::string("mtl:") + slot);
  };
  transfer(any([](const Material& m) {
             return has_number(m.roughness_from) || !m.roughness_map.empty();
           }),
           "roughness");
  transfer(any([](const Material& m) {
             return !m.metallic_map.empty() || (has_number(m.metallic_from) && m.metallic > 0);
           }),
           "metallic");
  transfer(any([](const Material& m) {
             return !m.emission_map.empty() ||
                    (has_number(m.emission_from) && m.emission != std::array<float, 3>{});
           }),
           "emission");
  run.options = bake_options(arguments);
}

bool save_asset(BakeRun& run) {
  AssetMaps maps;
  std::string left;
  for (BakedMap& map : run.result.maps) {
    const std::string name = map_name(map.kind);
    store(run, map, name);
    const Image** const slot = name == "normal"      ? &maps.normal
                               : name == "ao"        ? &maps.occlusion
                               : name == "roughness" ? &maps.roughness
                               : name == "metallic"  ? &maps.metallic
                               : name == "opacity"   ? &maps.opacity
                               : name == "color"     ? &maps.color
                               : name == "emission"  ? &maps.emission
                                                     : nullptr;
    if (slot == nullptr) {
      left += (left.empty() ? "" : ", ") + name;
    } else {
      *slot = &map.image;
    }
  }
  if (!left.empty()) {
    run.warnings.push_back(
        {"maps-left-out",
         "A GLB's material has no place for the maps " + left + ": bake them into a folder.", 1});
  }
  SaveGlbOptions options;
  const auto any = [&](const auto& has) {
    return std::any_of(run.materials.begin(), run.materials.end(), has);
  };
  if (any([](const Material& m) {
        return is_transparent(m) && m.alpha_mode == AlphaMode::blend;
      })) {
    options.alpha_mode = AlphaMode::blend;
  }
  const auto first_mask = std::find_if(
      run.materials.begin(), run.materials.end(),
      [](const Material& m) { return is_transparent(m) && m.alpha_mode == AlphaMode::mask; });
  if (first_mask != run.materials.end()) {
    options.alpha_cutoff = first_mask->alpha_cutoff;
    if (options.alpha_mode == AlphaMode::blend || any([&](const Material& m) {
          return is_transparent(m) && m.alpha_cutoff != first_mask->alpha_cutoff;
        })) {
      run.warnings.push_back(
          {"alpha-modes-joined",
           "HIGH's materials are transparent in several ways, the GLB's one "
           "material in one: " +
               std::string(options.alpha_mode == AlphaMode::blend ? "all are blended."
                                                                  : "the first cutoff counts."),
           1});
    }
  }
  options.double_sided = any([](const Material& m) { return m.double_sided; });
  options.metres = run.arguments.low.empty() ? run.dense.mesh.metres : run.low.mesh.metres;
  const BakeReport& report = run.result.report;
  Json extras = {{"version", version()}, {"texels", describe_texels(report)}};
  if (!report.errors.empty()) extras["errors"] = describe(report.errors);
  options.extras = to_text(extras);
  if (!announce(run, run.arguments.asset)) return false;
  save_glb(run.low.mesh, maps, run.arguments.asset, options);
  return true;
}

}  // namespace kiln::cli
