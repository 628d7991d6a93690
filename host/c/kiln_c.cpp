#include "kiln/kiln_c.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "asset/mesh_reader.h"
#include "base/lower_case.h"
#include "c/objects.h"
#include "io/file/text_scanner.h"
#include "kiln/asset.h"
#include "kiln/bake.h"
#include "kiln/image.h"
#include "kiln/mesh_view.h"
#include "kiln/normals.h"
#include "kiln/progress.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "kiln/version.h"

struct kiln_source {
  kiln::Source source;
  Files read;
};
struct kiln_bake {
  kiln_bake(kiln::BakeResult baked, bool in_tangent_space, Files files)
      : result(std::move(baked)), tangent_space(in_tangent_space), read(std::move(files)) {
    for (const kiln::BakedMap& map : result.maps) names.emplace_back(map.kind.name);
    for (const kiln::Warning& warning : result.report.warnings) {
      warnings.push_back(warning.message.text());
    }
  }
  kiln::BakeResult result;
  std::vector<std::string> names;  ///< Names of the maps, zero-terminated
  std::vector<std::string> warnings;
  bool tangent_space;  ///< True if normals are in tangent space with green up
  Files read;
};

namespace kiln {
namespace {

/// A high poly with the shading normals that simplification and bakes use.
class ShadedHigh {
 public:
  explicit ShadedHigh(const Mesh& high) : high_(high) {
    if (high.normals.empty()) warnings_ = shade_high(made_.emplace(high)).warnings;
  }
  const Mesh& mesh() const { return made_ ? *made_ : high_; }
  const std::vector<Warning>& warnings() const { return warnings_; }

 private:
  const Mesh& high_;
  std::optional<Mesh> made_;
  std::vector<Warning> warnings_;
};

/// Warnings of the last call that created a mesh or a source.
thread_local std::vector<std::string> last_warnings;

std::vector<std::string> texts_of(const std::vector<Warning>& warnings) {
  std::vector<std::string> texts;
  for (const Warning& warning : warnings) texts.push_back(warning.message.text());
  return texts;
}

/// Rejects a map without any matched texel, as the command does.
/// \throws Error(input) with the warning that names the cause
void check_found(const BakeReport& report) {
  if (report.missed < report.samples) return;
  const char* const id = report.samples == 0 ? "no-texels" : "many-misses";
  Message message;
  for (const Warning& warning : report.warnings) {
    if (warning.code == id) message = warning.message;
  }
  throw Error(ErrorCode::input, message, id);
}

/// Copies the caller's struct, which may be smaller since it is from an older header, over the default values; a null
/// pointer gives the default values. `reserved` members must be 0, so that later versions can use them.
template <typename Options>
Options given(const Options* options, void (*init)(Options*)) {
  Options all;
  init(&all);
  if (options == nullptr) return all;
  if (options->size < sizeof(std::size_t)) {
    throw Error(ErrorCode::usage, "A struct's size is not set: call its kiln_..._init().",
                "struct-size");
  }
  std::memcpy(&all, options, std::min(options->size, sizeof all));
  if constexpr (requires { all.reserved; }) {
    if (all.reserved != 0) {
      throw Error(ErrorCode::usage,
                  "reserved is " + std::to_string(all.reserved) +
                      ": it must be 0, as kiln_..._init() sets it.",
                  "struct-reserved");
    }
  }
  return all;
}

Progress progress_of(kiln_progress callback, void* user) {
  if (callback == nullptr) return {};
  return [=](double done, std::string_view stage) {
    return callback(done, std::string(stage).c_str(), user) != 0;
  };
}

std::filesystem::path path_of(const char* path) {
  check_given(path, "path");
  const std::string_view text = path;
  return std::u8string(text.begin(), text.end());
}

/// The path at which to save.
/// \throws Error(usage) if it is one of the input files
std::filesystem::path path_beside(const Files& read, const char* path) {
  std::filesystem::path file = path_of(path);
  for (const std::filesystem::path& other : read) {
    std::error_code none;
    if (!std::filesystem::equivalent(file, other, none) || none) continue;
    throw Error(ErrorCode::usage,
                "'" + printable(file.string()) + "' is " +
                    (other == file ? "an input" : "the input '" + printable(other.string()) + "'") +
                    " and would be overwritten: choose another name or folder for the output.",
                "output-input");
  }
  return file;
}

std::vector<std::string> names_of(const char* list) {
  std::vector<std::string> names;
  std::string_view rest = list;
  while (!rest.empty()) {
    const std::size_t comma = rest.find(',');
    names.emplace_back(rest.substr(0, comma));
    rest = comma == std::string_view::npos ? std::string_view() : rest.substr(comma + 1);
  }
  return names;
}

template <typename T>
Strided<T> strided(const kiln_span& span) {
  if (span.data == nullptr) return {};
  if (span.stride != 0 && span.stride < sizeof(T)) {
    throw Error(ErrorCode::usage,
                "A span's stride is " + std::to_string(span.stride) +
                    " bytes, but an element has " + std::to_string(sizeof(T)) +
                    ": give bytes, or 0 for elements side by side.",
                "stride");
  }
  if (span.count != 0 && span.stride > PTRDIFF_MAX / span.count) {
    throw Error(ErrorCode::usage,
                "A span of " + std::to_string(span.count) + " elements has a stride of " +
                    std::to_string(span.stride) + " bytes, beyond all addresses: give bytes.",
                "stride");
  }
  return {span.data, span.count, span.stride};
}

MeshView view_of(const kiln_mesh_view& v) {
  MeshView view;
  view.positions = strided<std::array<float, 3>>(v.positions);
  if (v.indices != nullptr) view.indices = {v.indices, v.index_count};
  view.normals = strided<std::array<float, 3>>(v.normals);
  view.uvs = strided<std::array<float, 2>>(v.uvs);
  view.tangents = strided<std::array<float, 4>>(v.tangents);
  view.colors = strided<std::array<std::uint8_t, 4>>(v.colors);
  view.origin = {v.origin[0], v.origin[1], v.origin[2]};
  view.flip_v = v.flip_v != 0;
  if (v.name != nullptr) view.name = v.name;
  return view;
}

/// \throws Error(usage) for extensions of other formats
ImageFormat format_of(const std::filesystem::path& file) {
  const std::string ending = lower_extension(file);
  if (ending == ".png") return ImageFormat::png16;
  if (ending == ".exr") return ImageFormat::exr_half;
  throw Error(ErrorCode::usage, "'" + file.string() + "': a map's name ends in .png or .exr.",
              "output-name");
}

std::optional<Length> length_of(double value, bool relative) {
  if (value == 0) return std::nullopt;
  return Length{value, relative};
}

BakeOptions bake_options(const kiln_bake_options& o) {
  BakeOptions options;
  const bool relative = o.relative != 0;
  options.width = o.width;
  options.height = o.height;
  options.samples = o.samples;
  options.encoding.gutter = o.gutter;
  if (o.maps != nullptr) {
    options.maps.clear();
    for (const std::string& name : names_of(o.maps)) options.maps.push_back(find_map(name).kind);
  }
  if (o.match != nullptr) options.match.method = find_match(o.match).method;
  if (o.fallback != nullptr) {
    for (const std::string& name : names_of(o.fallback)) {
      options.match.fallback.push_back(find_match(name).method);
    }
  }
  options.match.max_distance = length_of(o.max_distance, relative);
  options.match.cage = length_of(o.cage, relative);
  options.match.two_sided = o.two_sided != 0;
  options.encoding.flip_y = o.flip_y != 0;
  options.encoding.space = o.object_space != 0 ? NormalMapSpace::object : NormalMapSpace::tangent;
  options.occlusion.rays = o.ao_rays;
  options.occlusion.distance = length_of(o.ao_distance, relative);
  options.progress = progress_of(o.progress, o.user);
  return options;
}

template <typename T>
const T* data_of(const auto& values) {
  return values.empty() ? nullptr : reinterpret_cast<const T*>(values.data());
}

}  // namespace
std::string& last_message() noexcept {
  static thread_local std::string message;
  return message;
}

std::string& last_code() noexcept {
  static thread_local std::string code;
  return code;
}

}  // namespace kiln

using namespace kiln;

extern "C" {

const char* kiln_error_message(void) { return last_message().c_str(); }
const char* kiln_error_code(void) { return last_code().c_str(); }
const char* kiln_warning(size_t index) {
  return index < last_warnings.size() ? last_warnings[index].c_str() : nullptr;
}
const char* kiln_c_version(void) { return version(); }

void kiln_mesh_view_init(kiln_mesh_view* view) { begin(view); }

kiln_status kiln_mesh_new(const kiln_mesh_view* view, kiln_mesh** mesh) {
  return guarded([&] {
    check_given(view, "view");
    check_given(mesh, "mesh");
    last_warnings.clear();
    *mesh = new kiln_mesh{to_mesh(view_of(given(view, kiln_mesh_view_init)))};
  });
}

kiln_status kiln_mesh_load(const char* path, kiln_mesh** mesh) {
  return guarded([&] {
    check_given(mesh, "mesh");
    std::vector<Warning> warnings;
    const std::filesystem::path file = path_of(path);
    // Absolute paths, since the working folder may change before a file is saved.
    Files read = {std::filesystem::absolute(file)};
    Mesh loaded = load_mesh(file, {}, &warnings);
    for (std::filesystem::path& mtl : material_file_paths(loaded, read.front().parent_path())) {
      read.push_back(std::move(mtl));
    }
    *mesh = new kiln_mesh{std::move(loaded), std::move(read)};
    last_warnings = texts_of(warnings);
  });
}

kiln_status kiln_mesh_save_obj(const kiln_mesh* mesh, const char* path) {
  return guarded([&] {
    check_given(mesh, "mesh");
    save_obj(mesh->mesh, path_beside(mesh->read, path));
  });
}

void kiln_mesh_arrays_init(kiln_mesh_arrays* arrays) { begin(arrays); }

kiln_status kiln_mesh_read(const kiln_mesh* mesh, kiln_mesh_arrays* arrays) {
  return guarded([&] {
    check_given(mesh, "mesh");
    check_given(arrays, "arrays");
    const Mesh& m = mesh->mesh;
    kiln_mesh_arrays all;
    begin(&all);
    all.positions = data_of<float>(m.positions);
    all.vertex_count = m.positions.size();
    all.triangles = data_of<std::uint32_t>(m.triangles);
    all.triangle_count = m.triangles.size();
    all.uvs = data_of<float>(m.uvs);
    all.uv_count = m.uvs.size();
    all.uv_triangles = data_of<std::uint32_t>(m.uv_triangles);
    all.normals = data_of<float>(m.normals);
    all.normal_count = m.normals.size();
    all.normal_triangles = data_of<std::uint32_t>(m.normal_triangles);
    all.colors = data_of<std::uint8_t>(m.colors);
    std::copy(m.origin.begin(), m.origin.end(), all.origin);
    give(arrays, all);
  });
}

kiln_status kiln_mesh_shade(kiln_mesh* mesh, double angle) {
  return guarded([&] {
    check_given(mesh, "mesh");
    ShadingOptions options;
    if (angle != 0) options = {.rule = ShadingRule::angle, .angle_degrees = angle};
    shade_high(mesh->mesh, options);
  });
}

void kiln_mesh_free(kiln_mesh* mesh) { delete mesh; }

void kiln_simplify_options_init(kiln_simplify_options* options) {
  begin(options);
  if (options == nullptr) return;
  options->max_error = SimplifyOptions().max_error;
}

kiln_status kiln_simplify(const kiln_mesh* high, const kiln_simplify_options* options,
                          kiln_mesh** low) {
  return guarded([&] {
    check_given(high, "high");
    check_given(low, "low");
    const kiln_simplify_options o = given(options, kiln_simplify_options_init);
    SimplifyOptions simplify_options;
    simplify_options.faces = o.faces;
    simplify_options.max_error = o.max_error;
    simplify_options.keep_uvs = o.keep_uvs != 0;
    simplify_options.keep_parts = o.keep_parts != 0;
    simplify_options.hull = o.hull != 0;
    const ProgressScope scope(progress_of(o.progress, o.user));
    SimplifyReport report;
    Mesh made = simplify(ShadedHigh(high->mesh).mesh(), simplify_options, &report);
    *low = new kiln_mesh{std::move(made), high->read, report};
    last_warnings = texts_of(report.warnings);
  });
}

void kiln_unwrap_options_init(kiln_unwrap_options* options) {
  begin(options);
  if (options == nullptr) return;
  options->map_size = UnwrapOptions().size;
  options->border_texels = UnwrapOptions().border_texels;
}

kiln_status kiln_unwrap(const kiln_mesh* mesh, const kiln_unwrap_options* options,
                        kiln_mesh** unwrapped) {
  return guarded([&] {
    check_given(mesh, "mesh");
    check_given(unwrapped, "unwrapped");
    const kiln_unwrap_options o = given(options, kiln_unwrap_options_init);
    UnwrapOptions unwrap_options;
    unwrap_options.size = o.map_size;
    unwrap_options.border_texels = o.border_texels;
    unwrap_options.method = o.pairs != 0 ? UnwrapMethod::pairs : UnwrapMethod::charts;
    const ProgressScope scope(progress_of(o.progress, o.user));
    UnwrapReport report;
    *unwrapped = new kiln_mesh{unwrap(mesh->mesh, unwrap_options, &report), mesh->read, mesh->made};
    last_warnings = texts_of(report.warnings);
  });
}

kiln_status kiln_source_new(const char* device, const kiln_mesh* high, kiln_progress progress,
                            void* user, kiln_source** source) {
  return guarded([&] {
    check_given(high, "high");
    check_given(source, "source");
    const ShadedHigh shaded(high->mesh);
    std::optional<Source> made = Source::build(Device::open(device != nullptr ? device : ""),
                                               shaded.mesh(), progress_of(progress, user));
    check_cancelled(!made);
    std::vector<Warning> warnings = shaded.warnings();
    warnings.insert(warnings.end(), made->warnings().begin(), made->warnings().end());
    *source = new kiln_source{*made, high->read};
    last_warnings = texts_of(warnings);
  });
}

void kiln_source_free(kiln_source* source) { delete source; }

void kiln_bake_options_init(kiln_bake_options* options) {
  begin(options);
  if (options == nullptr) return;
  const BakeOptions defaults;
  options->width = defaults.width;
  options->height = defaults.height;
  options->samples = defaults.samples;
  options->gutter = defaults.encoding.gutter;
  options->ao_rays = defaults.occlusion.rays;
}

kiln_status kiln_bake_new(const kiln_source* source, const kiln_mesh* low,
                          const kiln_bake_options* options, kiln_bake** bake) {
  return guarded([&] {
    check_given(source, "source");
    check_given(low, "low");
    check_given(bake, "bake");
    const kiln_bake_options o = given(options, kiln_bake_options_init);
    BakeOptions bake_by = bake_options(o);
    if (low->made) set_search_distances(*low->made, bake_by.match);
    BakeResult result = kiln::bake(source->source, low->mesh, bake_by);
    check_cancelled(result.cancelled);
    check_found(result.report);
    Files read = source->read;
    read.insert(read.end(), low->read.begin(), low->read.end());
    *bake = new kiln_bake(std::move(result), o.flip_y == 0 && o.object_space == 0, std::move(read));
  });
}

size_t kiln_bake_map_count(const kiln_bake* bake) {
  return bake != nullptr ? bake->result.maps.size() : 0;
}

void kiln_map_init(kiln_map* map) { begin(map); }

kiln_status kiln_bake_map(const kiln_bake* bake, size_t index, kiln_map* map) {
  return guarded([&] {
    check_given(bake, "bake");
    check_given(map, "map");
    if (index >= bake->result.maps.size()) {
      throw Error(ErrorCode::usage,
                  "index is " + std::to_string(index) + ", but there are " +
                      std::to_string(bake->result.maps.size()) + " maps.",
                  "index");
    }
    const BakedMap& baked = bake->result.maps[index];
    kiln_map all;
    begin(&all);
    all.name = bake->names[index].c_str();
    all.width = baked.image.width;
    all.height = baked.image.height;
    all.channels = baked.image.channels;
    all.pixels = baked.image.pixels.data();
    give(map, all);
  });
}

const uint8_t* kiln_bake_coverage(const kiln_bake* bake) {
  return bake != nullptr ? bake->result.coverage.data() : nullptr;
}

void kiln_report_init(kiln_report* report) { begin(report); }

kiln_status kiln_bake_report(const kiln_bake* bake, kiln_report* report) {
  return guarded([&] {
    check_given(bake, "bake");
    check_given(report, "report");
    const BakeReport& r = bake->result.report;
    kiln_report all;
    begin(&all);
    all.texels = r.texels;
    all.samples = r.samples;
    all.missed = r.missed;
    all.max_distance = r.max_distance;
    all.mean_abs_distance = r.mean_abs_distance;
    all.warnings = r.warnings.size();
    give(report, all);
  });
}

const char* kiln_bake_warning(const kiln_bake* bake, size_t index) {
  if (bake == nullptr || index >= bake->warnings.size()) return nullptr;
  return bake->warnings[index].c_str();
}

void kiln_bake_free(kiln_bake* bake) { delete bake; }

kiln_status kiln_map_save(const kiln_map* map, const char* path) {
  return guarded([&] {
    check_given(map, "map");
    const kiln_map m = given(map, kiln_map_init);
    check_given(m.pixels, "pixels");
    const std::filesystem::path file = path_of(path);
    SaveImageOptions options;
    options.format = format_of(file);
    Image image{m.width, m.height, m.channels, {}};
    // Largest size that save_image() accepts; pixels of larger images must not be read.
    constexpr std::uint32_t kMaxImageSide = 65536, kMaxImageChannels = 4;
    if (std::max(m.width, m.height) <= kMaxImageSide && m.channels <= kMaxImageChannels) {
      image.pixels.assign(m.pixels, m.pixels + std::size_t{m.width} * m.height * m.channels);
    }
    save_image(image, file, options);
  });
}

kiln_status kiln_glb_save(const kiln_mesh* low, const kiln_bake* bake, const char* path) {
  return guarded([&] {
    check_given(low, "low");
    AssetMaps maps;
    std::vector<BakedMap> stored(kiln_bake_map_count(bake));
    for (std::size_t i = 0; i < stored.size(); ++i) {
      const BakedMap& map = bake->result.maps[i];
      const Image** const slot = slot_of(maps, map.kind.name);
      if (slot == nullptr) continue;
      if (slot == &maps.normal && !bake->tangent_space) {
        throw Error(ErrorCode::usage,
                    "A GLB has normals in tangent space with green up: bake without object_space "
                    "and flip_y.",
                    "option-contradiction");
      }
      stored[i] = map;
      to_stored(stored[i], ImageFormat::png8);
      *slot = &stored[i].image;
    }
    Files read = low->read;
    if (bake != nullptr) read.insert(read.end(), bake->read.begin(), bake->read.end());
    save_glb(low->mesh, maps, path_beside(read, path));
  });
}

}  // extern "C"
