#include "job/mesh_files.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "asset/materials.h"
#include "base/file.h"
#include "base/percent.h"
#include "job/high_poly_input.h"
#include "options/parse.h"
#include "options/words.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kGridCells = 512;  // cells along a side of the grid over the UV square
constexpr std::uint32_t kNoTriangle = 0xFFFFFFFFU;

std::array<Vec2, 3> uvs_of(const Mesh& mesh, std::uint32_t t) {
  const auto& [a, b, c] = mesh.uv_triangles[t];
  return {mesh.uvs[a], mesh.uvs[b], mesh.uvs[c]};
}

/// The distinct UVs of a triangle's polygon in a fixed order. Mirrored copies of quads are triangulated along the other
/// diagonal, so that only polygons can be compared.
std::vector<Vec2> uvs_per_group(const Mesh& mesh, std::uint32_t t) {
  std::uint32_t first = t, end = t + 1;
  if (!mesh.polygons.empty()) {
    while (first > 0 && mesh.polygons[first - 1] == mesh.polygons[t]) --first;
    while (end < mesh.polygons.size() && mesh.polygons[end] == mesh.polygons[t]) ++end;
  }
  std::vector<Vec2> uvs;
  for (; first < end; ++first) {
    for (const Vec2& uv : uvs_of(mesh, first)) {
      if (std::isfinite(uv.x) && std::isfinite(uv.y)) uvs.push_back(uv);
    }
  }
  std::sort(uvs.begin(), uvs.end(),
            [](const Vec2& a, const Vec2& b) { return std::pair(a.x, a.y) < std::pair(b.x, b.y); });
  uvs.erase(std::unique(uvs.begin(), uvs.end()), uvs.end());
  return uvs;
}

/// True if the polygons of two triangles have the same UVs, as copies of one part have.
bool has_same_uvs(const Mesh& mesh, std::uint32_t t, std::uint32_t u) {
  const std::vector<Vec2> a = uvs_per_group(mesh, t), b = uvs_per_group(mesh, u);
  if (a.size() != b.size()) return false;
  for (std::size_t k = 0; k < a.size(); ++k) {
    if (std::abs(a[k].x - b[k].x) > 1e-4F || std::abs(a[k].y - b[k].y) > 1e-4F) return false;
  }
  return true;
}

/// Calls `use` for each grid cell whose centre lies inside a UV triangle.
template <typename Use>
void for_each_cell_inside(const std::array<Vec2, 3>& uvs, const Use& use) {
  const auto edge = [](const Vec2& a, const Vec2& b, double x, double y) {
    return (double{b.x} - a.x) * (y - a.y) - (double{b.y} - a.y) * (x - a.x);
  };
  const double area = edge(uvs[0], uvs[1], uvs[2].x, uvs[2].y);
  if (!(std::abs(area) > 0)) return;
  const auto range = [](std::array<float, 3> values) {
    const auto [low, high] = std::minmax({values[0], values[1], values[2]});
    const auto cell = [](double value) {
      return static_cast<std::uint32_t>(std::clamp(value * kGridCells, 0.0, double{kGridCells}));
    };
    return std::pair(cell(low), std::min(cell(high) + 1, kGridCells));
  };
  const auto [x0, x1] = range({uvs[0].x, uvs[1].x, uvs[2].x});
  const auto [y0, y1] = range({uvs[0].y, uvs[1].y, uvs[2].y});
  for (std::uint32_t y = y0; y < y1; ++y) {
    for (std::uint32_t x = x0; x < x1; ++x) {
      const double u = (x + 0.5) / kGridCells, v = (y + 0.5) / kGridCells;
      bool is_inside = true;
      for (std::size_t k = 0; k < 3; ++k) {
        is_inside = is_inside && edge(uvs[k], uvs[(k + 1) % 3], u, v) * area > 0;
      }
      if (is_inside) use(x, y);
    }
  }
}

/// The overlap of the UVs of two files: its area in grid cells, and one UV in it.
struct UvOverlap {
  std::uint64_t cells = 0;
  double u = 0, v = 0;
};

/// Reads a file with its nodes and materials. If the materials cannot be read, the mesh is returned with a warning.
Asset load_with_materials(const std::string& file, const LoadMeshOptions& options,
                          std::vector<Warning>& warnings) {
  const std::string ending = lower_extension(file);
  if (ending != ".obj") return load_asset(file, options, &warnings);
  Asset asset;
  asset.mesh = load_mesh(file, options, &warnings);
  if (asset.mesh.material_files.empty()) return asset;
  std::vector<Warning>
      // Only missing MTL files are reported here; other problems are reported when materials are baked.
      mtl_warnings;
  try {
    asset.materials = load_materials(asset.mesh, file, &mtl_warnings, options.outside);
    std::copy_if(mtl_warnings.begin(), mtl_warnings.end(), std::back_inserter(warnings),
                 [](const Warning& warning) { return warning.code == "mtl-missing"; });
  } catch (const Error& error) {
    warnings.push_back({"materials-unread", error.message() + " The file has no effect.", 1});
  }
  return asset;
}

/// Appends the nodes and materials of a file to those of all files.
void append_nodes_and_materials(const Asset& file, Asset& all) {
  const auto first = static_cast<std::uint32_t>(all.nodes.size());
  for (AssetNode node : file.nodes) {
    if (node.parent != AssetNode::kNone) node.parent += first;
    all.nodes.push_back(std::move(node));
  }
  for (std::size_t i = 0; i < file.object_nodes.size(); ++i) {
    all.mesh.object_names.push_back(file.mesh.object_names[i]);
    all.object_nodes.push_back(first + file.object_nodes[i]);
  }
  all.materials.insert(all.materials.end(), file.materials.begin(), file.materials.end());
  if (all.extras.empty()) all.extras = file.extras;
  if (all.copyright.empty()) all.copyright = file.copyright;
  if (all.scene.empty()) all.scene = file.scene;
}

}  // namespace

void move_uvs(const std::vector<std::size_t>& group_of,
              const std::function<Vec2(std::size_t, const Vec2&)>& move, Mesh& mesh) {
  std::vector<Vec2> new_uvs;
  // Key: group and old UV index. Value: index of the group's own copy of that UV.
  std::map<std::pair<std::size_t, std::uint32_t>, std::uint32_t> new_index;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::uint32_t& uv : mesh.uv_triangles[t]) {
      const auto [entry, added] =
          new_index.try_emplace({group_of[t], uv}, static_cast<std::uint32_t>(new_uvs.size()));
      if (added) new_uvs.push_back(move(group_of[t], mesh.uvs[uv]));
      uv = entry->second;
    }
  }
  mesh.uvs = std::move(new_uvs);
  mesh.other_uvs.clear();
}

void move_material_files(Mesh& mesh, const fs::path& from, const fs::path& to) {
  for (std::string& name : mesh.material_files) {
    std::replace(name.begin(), name.end(), '\\', '/');
    std::error_code error;
    const fs::path file = os::join(from, name);
    const fs::path relative_path = fs::relative(file, to.empty() ? "." : to, error);
    // A path to another drive cannot be relative.
    name = error || relative_path.empty() ? os::absolute(file, error).string()
                                          : relative_path.string();
  }
}

const std::string& MeshFiles::file_of(std::size_t triangle) const {
  const auto next_file = std::upper_bound(first.begin(), first.end(), triangle);
  return files[static_cast<std::size_t>(next_file - first.begin()) - 1];
}

MeshFiles load_meshes(const std::vector<JobInput>& inputs, const LoadMeshOptions& options,
                      bool named, std::vector<Warning>& warnings, bool with_materials) {
  MeshFiles result;
  std::vector<Mesh> meshes;
  std::size_t triangles = 0;
  const fs::path folder = fs::path(inputs[0].name).parent_path();
  for (const JobInput& input : inputs) {
    const std::string& file = input.name;
    result.files.push_back(file);
    if (input.asset) {
      if (with_materials) append_nodes_and_materials(*input.asset, result.nodes_and_materials);
      meshes.push_back(input.asset->mesh);
    } else if (with_materials) {
      Asset asset = load_with_materials(file, options, warnings);
      append_nodes_and_materials(asset, result.nodes_and_materials);
      meshes.push_back(std::move(asset.mesh));
    } else {
      meshes.push_back(load_mesh(file, options, &warnings));
    }
    if (meshes.size() > 1) move_material_files(meshes.back(), fs::path(file).parent_path(), folder);
    result.first.push_back(triangles);
    triangles += meshes.back().triangles.size();
  }
  result.first.push_back(triangles);
  const bool join = inputs.size() > 1 || named;
  result.mesh = join ? join_meshes(meshes, &warnings) : std::move(meshes[0]);
  keep_named_materials(result);
  return result;
}

void keep_named_materials(MeshFiles& files) {
  std::vector<Material>& materials = files.nodes_and_materials.materials;
  if (!materials.empty()) materials = materials_by_name(materials, files.mesh.material_names);
}

std::string quote_files(const std::vector<std::string>& files) {
  constexpr std::size_t kMaxListedFiles = 3;
  std::string text;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const bool is_last = i + 1 == files.size();
    if (i + 1 == kMaxListedFiles && files.size() > kMaxListedFiles) {
      return text + " and " + std::to_string(files.size() - i) + " more";
    }
    text += (i == 0 ? "'" : is_last ? " and '" : ", '") + files[i] + "'";
  }
  return text;
}

void warn_of_shared_texels(const MeshFiles& low, std::vector<Warning>& warnings) {
  if (low.files.size() < 2 || low.mesh.uv_triangles.empty()) return;
  std::vector<std::uint32_t> first_triangle_in(std::size_t{kGridCells} * kGridCells, kNoTriangle);
  std::vector<const std::string*> last_overlapping_file(
      first_triangle_in.size(),
      nullptr);  // for each cell, the last file with a triangle that overlaps one of another file
  std::map<std::pair<std::string, std::string>, UvOverlap> overlaps;
  for (std::uint32_t t = 0; t < low.mesh.triangles.size(); ++t) {
    for_each_cell_inside(uvs_of(low.mesh, t), [&](std::uint32_t x, std::uint32_t y) {
      std::uint32_t& first_triangle = first_triangle_in[std::size_t{y} * kGridCells + x];
      if (first_triangle == kNoTriangle) first_triangle = t;
      const std::string &a = low.file_of(first_triangle), &b = low.file_of(t);
      const std::string*& last = last_overlapping_file[std::size_t{y} * kGridCells + x];
      if (&a == &b || last == &b || has_same_uvs(low.mesh, first_triangle, t)) return;
      last = &b;
      UvOverlap& overlap = overlaps[{a, b}];
      if (overlap.cells++ == 0) {
        overlap.u = (x + 0.5) / kGridCells;
        overlap.v = (y + 0.5) / kGridCells;
      }
    });
  }
  for (const auto& [files, overlap] : overlaps) {
    const std::string text = formatted(
        " overlap on %s of the unit square, at UV (%.4g, %.4g) ",
        percent(static_cast<double>(overlap.cells) / (double{kGridCells} * kGridCells), 2).c_str(),
        overlap.u, overlap.v);
    warnings.push_back(
        {"files-overlap",
         "UVs of '" + files.first + "' and '" + files.second + "'" + text +
             "for example, but all LOW files share one map: place the layouts side by side, add " +
             option("unwrap") + ", or bake them separately.",
         overlap.cells});
  }
}

namespace {

constexpr Word<UpAxis> kUpAxisNames[] = {
    {"+x", UpAxis::x},       {"+y", UpAxis::y},       {"+z", UpAxis::z},
    {"-x", UpAxis::minus_x}, {"-y", UpAxis::minus_y}, {"-z", UpAxis::minus_z},
    {"x", UpAxis::x},        {"y", UpAxis::y},        {"z", UpAxis::z}};
constexpr Word<double> kUnitMetres[] = {
    {"cm", 0.01}, {"ft", 0.3048}, {"in", 0.0254}, {"m", 1}, {"mm", 0.001}};

}  // namespace

UpAxis parse_up(const std::string& text) {
  if (const UpAxis* const up = Words(kUpAxisNames).find(lower_case(text))) return *up;
  fail_usage(option("up") + " '" + text + "': write x, y, z, -x, -y or -z.");
}

namespace {

double parse_unit(const std::string& text) {
  if (const double* const unit = Words(kUnitMetres).find(lower_case(text))) return *unit;
  double metres = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, status] = std::from_chars(text.data(), end, metres);
  constexpr double kMaxUnitMetres = 1e9;
  if (status == std::errc() && stop == end && metres >= 1 / kMaxUnitMetres &&
      metres <= kMaxUnitMetres)
    return metres;
  fail_usage(option("unit") + " '" + text +
             "': write mm, cm, m, in, ft, or a number of metres from 1e-9 to 1e9, such as 0.01.");
}

/// Values of an option for both meshes, for HIGH, or for LOW.
struct SideValues {
  std::optional<std::string> both, high, low;

  /// Parses texts such as "y", "high=y" and "low=y". \throws Error(usage) if HIGH or LOW gets two values
  SideValues(const char* flag, const std::vector<std::string>& texts) {
    for (const std::string& text : texts) {
      std::optional<std::string>* side_value = &both;
      if (text.starts_with("high=")) side_value = &high;
      if (text.starts_with("low=")) side_value = &low;
      refuse_if(side_value->has_value(),
                option_of(flag) + " '" + text + "' is given twice: leave one out.");
      *side_value = side_value == &both ? text : text.substr(text.find('=') + 1);
    }
  }
  const std::optional<std::string>& value_of_side(MeshSide side) const {
    static const std::optional<std::string> unset_value;
    return side == MeshSide::high ? high : side == MeshSide::low ? low : unset_value;
  }
};

bool has_extension(const std::string& file, const std::vector<std::string>& extensions) {
  const std::string extension = lower_extension(file);
  return std::find(extensions.begin(), extensions.end(), extension) != extensions.end();
}

}  // namespace

void check_mesh_frame(const MeshFrameArguments& arguments, const std::vector<std::string>& high,
                      const std::vector<std::string>& low, const std::vector<std::string>& others) {
  struct FrameOption {
    const char* name;
    const std::vector<std::string>* texts;
    std::vector<std::string>
        stating_formats;  // extensions of file formats that state the option's value themselves
  };
  const FrameOption flags[] = {
      {"--up", &arguments.up, {".gltf", ".glb", ".fbx", ".dae", ".3ds", ".x"}},
      {"--unit", &arguments.unit, {".gltf", ".glb", ".fbx", ".dae"}},
      {"--uv-set", &arguments.uv_set, {}}};
  for (const FrameOption& flag : flags) {
    const SideValues values(flag.name, *flag.texts);
    refuse_if(
        values.low && low.empty(),
        option_of(flag.name) + " low= needs a given LOW: name one, or leave this option out.");
    const auto depends_on_option = [&](const std::string& file) {
      return !is_height_field(file) && !has_extension(file, flag.stating_formats);
    };
    const auto any_file_depends_on_option = [&](const std::vector<std::string>& files) {
      return std::any_of(files.begin(), files.end(), depends_on_option);
    };
    refuse_if(values.high && high.empty(),
              option_of(flag.name) + " high= needs a HIGH: name one, or leave this option out.");
    refuse_if(values.high && std::all_of(high.begin(), high.end(), is_height_field),
              option_of(flag.name) +
                  " high= applies to meshes, but HIGH is a height field: leave it out.");
    if (values.both && !any_file_depends_on_option(high) && !any_file_depends_on_option(low) &&
        !any_file_depends_on_option(others)) {
      fail_usage(option_of(flag.name, *values.both) +
                 " applies to files that do not state this themselves, but all given files do: "
                 "leave it out, or write " +
                 option_of(flag.name, "high=" + *values.both) + " to override HIGH's file.");
    }
  }
  for (const MeshSide side : {MeshSide::high, MeshSide::low}) load_options(arguments, side);
}

ShadingOptions parse_shading(const std::string& text) {
  constexpr std::pair<const char*, ShadingRule> kShadingRuleWords[] = {
      {"auto", ShadingRule::automatic},
      {"file", ShadingRule::file},
      {"smooth", ShadingRule::smooth},
      {"flat", ShadingRule::flat}};
  for (const auto& [word, rule] : kShadingRuleWords) {
    if (text == word) return {.rule = rule};
  }
  ShadingOptions options = {.rule = ShadingRule::angle};
  refuse_if(!read_number(text, options.angle_degrees) || !(options.angle_degrees > 0) ||
                options.angle_degrees > 180,
            option("high_normals") + " is '" + text +
                "': give auto, file, smooth, flat, or an angle above 0 and up to 180 degrees.");
  return options;
}

std::string shading_rule_name(const ShadingOptions& options) {
  switch (options.rule) {
    case ShadingRule::automatic:
      return "auto";
    case ShadingRule::file:
      return "file";
    case ShadingRule::smooth:
      return "smooth";
    case ShadingRule::flat:
      return "flat";
    case ShadingRule::angle:
      break;
  }
  return formatted("%g", options.angle_degrees);
}

LoadMeshOptions load_options(const MeshFrameArguments& arguments, MeshSide side) {
  LoadMeshOptions options;
  options.outside = arguments.allow_outside;
  const SideValues up("--up", arguments.up), unit("--unit", arguments.unit);
  const SideValues uv_set("--uv-set", arguments.uv_set);
  options.override_up = up.value_of_side(side).has_value();
  if (const auto& text = options.override_up ? up.value_of_side(side) : up.both)
    options.up = parse_up(*text);
  options.override_unit = unit.value_of_side(side).has_value();
  if (const auto& text = options.override_unit ? unit.value_of_side(side) : unit.both) {
    options.metres = parse_unit(*text);
  }
  if (side == MeshSide::other) return options;  // occluders need no UVs
  if (const auto& text = uv_set.value_of_side(side) ? uv_set.value_of_side(side) : uv_set.both) {
    const char* const end = text->data() + text->size();
    const auto [stop, status] = std::from_chars(text->data(), end, options.uv_set);
    if (status != std::errc() || stop != end) {
      options.uv_set = 0;
      options.uv_set_name = *text;
      refuse_if(text->empty(), option("uv_set") + ": write a number from 0 on, or the set's name.");
    }
  }
  return options;
}

}  // namespace kiln
