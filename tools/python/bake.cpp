#include "bake.h"

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cctype>

#include "arrays.h"
#include "asset.h"
#include "base/option.h"
#include "image/mip_padding.h"
#include "job/check_result.h"
#include "job/map_file.h"
#include "job/map_words.h"
#include "job/match_inputs.h"
#include "job/run.h"
#include "job/transfers.h"
#include "kiln/asset.h"
#include "kiln/collision_hulls.h"
#include "kiln/image.h"
#include "kiln/options.h"
#include "match.h"
#include "options/parse.h"

namespace kiln::python {
namespace {

using nb::literals::operator""_a;

nb::dict dict_of(const ViewReport& views) {
  nb::dict d;
  d["size"] = views.size;
  d["pixel"] = views.pixel;
  d["views"] = views.directions.size();
  d["height_field"] = views.height_field;
  return d;
}

nb::list dict_of(const std::vector<Warning>& warnings) {
  nb::list list;
  for (const Warning& warning : warnings) {
    nb::dict d;
    d["code"] = warning.code;
    d["message"] = text_of(warning.message.text(option_as_keyword));
    d["count"] = warning.count;
    list.append(d);
  }
  return list;
}

nb::dict dict_of(const std::vector<MapError>& errors) {
  nb::dict errors_by_map;
  for (const MapError& error : errors) {
    nb::dict d;
    d["unit"] = std::string(error.unit);
    d["mean"] = error.mean;
    d["rms"] = error.rms;
    d["p95"] = error.p95;
    d["max"] = error.max;
    d["texels"] = error.texels;
    d["against"] = std::string(error.reference);
    errors_by_map[nb::str(error.kind.name.data(), error.kind.name.size())] = d;
  }
  return errors_by_map;
}

BakedMap& map_of(PyBake& self, const std::string& name) {
  const auto found_name = std::find(self.names.begin(), self.names.end(), name);
  if (found_name == self.names.end())
    throw nb::key_error(("no map '" + name + "' was baked").c_str());
  return self.result.maps[static_cast<std::size_t>(found_name - self.names.begin())];
}

nb::any pixels(PyBake& self, Image& image) {
  return view(image.pixels.data(), {image.height, image.width, image.channels}, nb::find(self));
}

Request make_request(const Keywords& words, const std::optional<PyMesh>& cage_mesh,
                     const std::vector<PyMesh>& occluders, bool by_high, bool by_low) {
  return {words, cage_mesh ? &*cage_mesh : nullptr, occluders, by_high, by_low};
}

TextureKind kind_of(const std::string& word) {
  if (word == "srgb") return TextureKind::srgb;
  if (word == "linear") return TextureKind::linear;
  if (word == "normal") return TextureKind::normal;
  throw Error(ErrorCode::usage,
              option("textures") + ": the kind '" + word + "' is not srgb, linear or normal.",
              "option-enum");
}

std::string name_or_default(const PyMesh& mesh, const char* otherwise) {
  return mesh.mesh->name.empty() ? otherwise : mesh.mesh->name;
}

/// Makes a job whose inputs and outputs are in memory.
Job job_in_memory(const PySource& source, const Keywords& words) {
  Job job;
  job.in_memory = true;
  job.sets = SetsBy::none;
  const PyMesh& high = source.high;
  job.high = {JobInput(Asset{}, high.file.empty() ? name_or_default(high, "high") : high.file)};
  set_options(job, words);
  check_transfers(job, high);
  return job;
}

PreparedHigh prepare_high(const Source& source, const PySource& py) {
  PreparedHigh high{source, *py.high.mesh};
  if (py.high.materials) high.materials = *py.high.materials;
  high.height_field = py.high.height_field;
  high.faces_inwards = py.faces_inwards;
  return high;
}

JobResult run_from(const PySource& source, const Job& job, RunHooks& hooks, const Call& call) {
  const Source kept_source = source.get();
  const PreparedHigh high = prepare_high(kept_source, source);
  hooks.high = &high;
  hooks.writes = false;
  JobResult job_result = call.run_whole([&](const Progress& progress) {
    return run_job([&] { return device_of(source.device); }, job, progress, hooks);
  });
  check_cancelled(job_result.cancelled);
  warn(job_result.causes);
  return job_result;
}

PyBake run_bake(const PySource& source, const PyMesh& low, const Keywords& words,
                const std::optional<PyMesh>& cage_mesh, const std::vector<PyMesh>& occluders,
                bool by_high, bool by_low, const nb::list& textures, const PyMatch* saved,
                nb::object progress) {
  const Call call(std::move(progress));
  Job job = job_in_memory(source, words);
  Asset asset;
  asset.mesh = *low.mesh;
  JobInput& input = job.low.given.emplace_back(std::move(asset), name_or_default(low, "low"));
  input.simplified = low.made;
  if (cage_mesh) job.bake.match.cage_mesh = cage_mesh->mesh.get();
  if (saved != nullptr) job.bake.match.saved = saved->match.get();
  job.bake.occlusion.by_high = by_high;
  job.bake.occlusion.by_low = by_low;
  for (const PyMesh& other : occluders) {
    job.bake.occlusion.by_others.push_back(other.mesh.get());
  }
  take_textures(textures, job.high_normal_map, job.bake);
  RunHooks hooks;
  BakeResult result;
  std::optional<PlannedBake> planned;
  hooks.on_baked = [&](BakedJob& baked) {
    result = std::move(baked.result);
    baked.result.report = result.report;
    planned = std::move(baked.planned);
  };
  const JobResult job_result = run_from(source, job, hooks, call);
  PyBake bake = py_bake(std::move(result), job_result.warnings, low.mesh->name);
  if (planned) {
    nb::dict chosen;
    chosen["match"] = std::string(planned->chosen.method.name);
    chosen["size"] = nb::make_tuple(planned->chosen.width, planned->chosen.height);
    chosen["degrees"] = planned->chosen.error.mean_degrees;
    chosen["wanted"] = planned->wanted;
    chosen["reached"] = planned->reached;
    bake.report["plan"] = chosen;
  }
  return bake;
}

PyMatch run_match(const PySource& source, const PyMesh& low, const Keywords& words,
                  const std::optional<PyMesh>& cage_mesh, nb::object progress) {
  const Call call(std::move(progress));
  Request request = make_request(words, cage_mesh, {}, true, false);
  if (request.chooses_match()) {
    throw Error(
        ErrorCode::usage,
        option("match", "auto") + " needs the maps of a bake: name a match, or call bake().",
        "option-enum");
  }
  const Source kept_source = source.get();
  MatchResult result = call.run([&] {
    request.prepare(&kept_source, source.high, source.faces_inwards, low);
    request.options.progress = call.progress();
    return match(kept_source, request.low(), request.options);
  });
  check_cancelled(result.cancelled);
  result.report.warnings.insert(result.report.warnings.begin(), request.warnings.begin(),
                                request.warnings.end());
  warn(result.report.warnings);
  return {std::make_shared<const Match>(std::move(result.match)), source.high,
          describe(result.report)};
}

/// Plans a low poly. \returns the low poly, its maps or None, and the plan's choices
nb::tuple run_plan(const PySource& source, const Keywords& words, nb::object progress) {
  const Call call(std::move(progress));
  const Job job = job_in_memory(source, words);
  RunHooks hooks;
  std::optional<BakeResult> result;
  Candidate trial;
  double requested_degrees = 0;
  bool reached = false;
  SimplifyReport simplified;
  hooks.on_baked = [&](BakedJob& baked) {
    trial = baked.plan->chosen;
    requested_degrees = baked.plan->wanted;
    reached = baked.plan->reached;
    simplified = *baked.simplified;
    if (baked.result.maps.empty()) return;
    result = std::move(baked.result);
    baked.result.report = result->report;
  };
  JobResult job_result = run_from(source, job, hooks, call);
  nb::dict d;
  d["faces"] = trial.faces;
  d["size"] = trial.size;
  d["samples"] = trial.samples;
  d["bits"] = trial.bits;
  d["match"] = std::string(trial.method.name);
  d["degrees"] = trial.measured;
  d["search_distance"] = simplified.search_distance();
  d["wanted"] = requested_degrees;
  d["reached"] = reached;
  job_result.low.name = source.high.mesh->name;
  PyMesh low{make_shared_mesh(std::move(job_result.low))};
  low.made = std::make_shared<const SimplifyReport>(std::move(simplified));
  nb::object bake = nb::none();
  if (result) {
    bake = nb::cast(py_bake(std::move(*result), job_result.warnings, low.mesh->name));
  }
  return nb::make_tuple(low, bake, d);
}

SaveImageOptions image_options(const std::string& format, bool dither) {
  const ImageFormat* const known_format = Words(kFormatWords).find(format);
  if (known_format == nullptr) {
    throw Error(ErrorCode::usage,
                option("format") + " is '" + format +
                    "': give png8, png16, exr, exr32, tiff8, tiff16, "
                    "tiff32, tga, webp, ktx2 or dds.",
                "option-enum");
  }
  return {*known_format, dither};
}

void save_map(PyBake& self, const std::string& name, const std::filesystem::path& path,
              const std::string& format, bool dither) {
  const Call call;
  SaveImageOptions options = image_options(format, dither);
  const BakedMap& map = map_of(self, name);
  call.run([&] { save_image(map, path, options); });
}

nb::bytes encoded(nb::handle pixels, const std::string& format, bool dither) {
  const Call call;
  const Image image = image_of(pixels, "pixels");
  const SaveImageOptions options = image_options(format, dither);
  const std::vector<std::byte> bytes = call.run([&] { return encode(image, options); });
  return nb::bytes(bytes.data(), bytes.size());
}

/// Returns a map as integer formats store it, in [0, 1].
nb::any stored(PyBake& self, const std::string& name) {
  const BakedMap& map = map_of(self, name);
  BakedMap copy = map;
  to_stored(copy, ImageFormat::png8);
  Image& image = copy.image;
  const std::size_t height = image.height, width = image.width, channels = image.channels;
  return array(std::move(image.pixels), {height, width, channels});
}

/// True if the mesh has transparent materials, which show its inner surfaces.
bool is_transparent_mesh(const PyMesh& high) {
  const Call call;
  return call.run([&] {
    const std::vector<Material> materials = materials_of(high);
    return std::any_of(materials.begin(), materials.end(), is_transparent);
  });
}

/// Converts maps to the pictures of a material.
/// \param names   names of the material's slots
/// \param padded  true to pad by pad_for_mips(), as jobs pad a GLB's pictures
/// \returns the pictures by slot; the emission that the value 1 represents; and the names of maps without a slot
nb::tuple asset_maps(const PyBake& self, const std::vector<std::string>& names, bool padded) {
  const Call call;
  std::vector<BakedMap> maps = self.result.maps;
  std::string left_out_maps;
  AssetMaps slots = call.run([&] {
    const AssetMaps pictures = kiln::asset_maps(maps, &left_out_maps);
    for (BakedMap& map : maps) {
      if (padded) pad_for_mips(map, self.result.coverage);
    }
    return pictures;
  });
  nb::dict files;
  for (const std::string& name : names) {
    for (BakedMap& map : maps) {
      Image& image = map.image;
      if (*slot_of(slots, name) != &image) continue;
      const std::size_t height = image.height, width = image.width, channels = image.channels;
      files[name.c_str()] = array(std::move(image.pixels), {height, width, channels});
    }
  }
  return nb::make_tuple(files, slots.emission_strength, left_out_maps);
}

}  // namespace

PyBake py_bake(BakeResult result, const std::vector<Warning>& warnings,
               const std::string& low_name) {
  PyBake bake;
  result.report.warnings = warnings;
  for (const BakedMap& map : result.maps) {
    bake.names.push_back(std::string(map.kind.name) +
                         (map.cluster == 0 ? "" : "_" + std::to_string(map.cluster)));
  }
  bake.report = nb::steal<nb::any>(describe(result.report).release());
  bake.low_name = low_name;
  bake.result = std::move(result);
  return bake;
}

PyBake wrap_bake_result(BakeResult result, const Request& request, const std::string& low_name) {
  check_cancelled(result.cancelled);
  std::vector<Warning> warnings = request.warnings;
  warnings.insert(warnings.end(), result.report.warnings.begin(), result.report.warnings.end());
  warn(warnings);
  return py_bake(std::move(result), warnings, low_name);
}

void check_transfers(const Job& job, const PyMesh& high) {
  const bool uses_materials =
      std::any_of(job.transfers.begin(), job.transfers.end(),
                  [](const std::string& transfer) { return transfer.starts_with("mtl:"); });
  if (high.is_of_file() || !uses_materials) return;
  throw Error(ErrorCode::usage,
              option("transfer") +
                  ": the high poly was not read from a file with materials: give textures as "
                  "textures={name: pixels}.",
              "option-contradiction");
}

void take_textures(const nb::list& textures, NormalTextureFormat normals, BakeOptions& options) {
  for (const nb::handle entry : textures) {
    const std::string name = nb::cast<std::string>(entry[0]);
    Texture texture;
    texture.kind = kind_of(nb::cast<std::string>(entry[2]));
    texture.images.push_back(std::make_shared<const Image>(image_of(entry[1], "textures")));
    texture.normal_format = normals;
    texture.weighted_by_alpha = {texture.kind == TextureKind::srgb};
    const auto baked = std::find_if(options.maps.begin(), options.maps.end(),
                                    [&](MapKind kind) { return kind.name == name; });
    const MapInfo* const info = baked == options.maps.end() ? nullptr : &find_map(name);
    if (info != nullptr && obeys(*info, "color")) {
      options.color = texture;
    } else if (info != nullptr && obeys(*info, "opacity")) {
      options.opacity = texture;
    } else {
      options.transfers.push_back({name, texture});
    }
  }
}

Request::Request(const Keywords& words, const PyMesh* cage_mesh,
                 const std::vector<PyMesh>& occluders, bool by_high, bool by_low)
    : job_(job_of(words)) {
  options = options_of(job_);
  options.occlusion.by_high = by_high;
  options.occlusion.by_low = by_low;
  if (cage_mesh != nullptr) {
    cage_mesh_ = cage_mesh->mesh;
    options.match.cage_mesh = cage_mesh_.get();
  }
  for (const PyMesh& other : occluders) {
    occluders_.push_back(other.mesh);
    options.occlusion.by_others.push_back(other.mesh.get());
  }
  copy_occluders_to_variants(options);
}

void Request::prepare(const Source* source, const PyMesh& high_poly, bool faces_inwards,
                      const PyMesh& low_poly) {
  if (job_.cage_auto && source == nullptr) {
    throw Error(ErrorCode::usage,
                option("cage", "auto") +
                    " is only valid for one shape of the high poly, which a session changes: give "
                    "a distance, or cage_mesh.",
                "option-contradiction");
  }
  std::shared_ptr<const Mesh> low_without_hulls = low_poly.mesh;
  const std::vector<std::uint8_t> is_hull = collision_hulls(*low_without_hulls);
  if (!job_.keep_hulls && std::find(is_hull.begin(), is_hull.end(), 1) != is_hull.end()) {
    Mesh mesh_without_hulls = *low_without_hulls;
    take_collision_hulls(mesh_without_hulls, &warnings);
    low_without_hulls = make_shared_mesh(std::move(mesh_without_hulls));
  }
  low_ = with_corrected_normals(low_without_hulls, "LOW", Trusted::normals, warnings);
  const Mesh &high = *high_poly.mesh, &low = *low_;
  check_transfers(job_, high_poly);
  if (!high_poly.file.empty()) job_.high = {JobInput(high_poly.file)};
  load_textures(
      job_, high, options, warnings,
      high_poly.materials ? std::span(*high_poly.materials) : std::span<const Material>());
  if (high_poly.height_field) {
    if (!job_.given.contains("--match")) {
      options.match.method = first_match("match.uv");
    }
    options.match.uv = height_field_uv_options(high, options.match.uv);
  }
  if (low_poly.made && !high_poly.height_field && !job_.cage_auto) {
    set_search_distances(*low_poly.made, options.match);
  }
  if (faces_inwards && !options.match.two_sided) {
    const Message inside_out = explain_inside_out(high, low);
    if (!inside_out.empty()) warnings.push_back({"high-inside-out", inside_out, 1});
  }
  if (job_.parts_by) {
    parts_ = pair_parts(high, low, part_names(job_));
    options.match.parts = &*parts_;
    warnings.insert(warnings.end(), parts_->warnings.begin(), parts_->warnings.end());
  }
  if (job_.cage_auto) {
    cage_ = find_cage(*source, low, options);
    options.match.cage_mesh = &cage_->mesh;
    // The search distance is only used to compute the cage; rays end at the cage itself
    options.match.max_distance.reset();
    warnings.insert(warnings.end(), cage_->warnings.begin(), cage_->warnings.end());
  }
}

nb::dict describe(const BakeReport& report) {
  nb::dict d;
  d["texels"] = report.texels;
  d["samples"] = report.samples;
  d["missed"] = report.missed;
  d["outward"] = report.outward;
  d["inward"] = report.inward;
  d["cage"] = report.cage;
  d["viewed"] = report.viewed;
  d["closest"] = report.closest;
  d["by_uv"] = report.by_uv;
  d["passed_over"] = report.passed_over;
  d["gutter_texels"] = report.gutter_texels;
  d["max_distance"] = report.max_distance;
  d["mean_abs_distance"] = report.mean_abs_distance;
  d["peak_device_bytes"] = report.peak_device_bytes;
  d["seconds_recall"] = report.seconds_recall;
  d["seconds_build"] = report.seconds_build;
  d["seconds_texels"] = report.seconds_texels;
  d["seconds_match"] = report.seconds_match;
  d["seconds_detail"] = report.seconds_detail;
  d["seconds_image"] = report.seconds_image;
  d["seconds_mips"] = report.seconds_mips;
  d["seconds_errors"] = report.seconds_errors;
  if (report.views) d["views"] = dict_of(*report.views);
  if (report.recall) {
    nb::dict recall;
    recall["places"] = report.recall->places;
    d["recall"] = recall;
  }
  nb::list ids;
  for (const IdEntry& id : report.ids) {
    nb::dict entry;
    entry["name"] = id.name;
    entry["color"] = nb::make_tuple(id.color[0], id.color[1], id.color[2]);
    entry["triangles"] = id.triangles;
    ids.append(entry);
  }
  d["ids"] = ids;
  d["errors"] = dict_of(report.errors);
  d["warnings"] = dict_of(report.warnings);
  return d;
}

void add_bake(nb::module_& module) {
  nb::class_<PyBake>(module, "BakeCore")
      .def_ro("names", &PyBake::names)
      .def_prop_ro("low_name", [](const PyBake& self) { return text_of(self.low_name); })
      .def_ro("report", &PyBake::report)
      .def("pixels", [](PyBake& self,
                        const std::string& name) { return pixels(self, map_of(self, name).image); })
      .def("mips",
           [](PyBake& self, const std::string& name) {
             nb::list levels;
             for (Image& level : map_of(self, name).mips) levels.append(pixels(self, level));
             return levels;
           })
      .def("origin",
           [](PyBake& self, const std::string& name) {
             const auto& origin = map_of(self, name).origin;
             return nb::make_tuple(origin[0], origin[1], origin[2]);
           })
      .def("ranges",
           [](PyBake& self, const std::string& name) {
             nb::list ranges;
             for (const ValueRange& range : map_of(self, name).ranges) {
               ranges.append(nb::make_tuple(range.low, range.high));
             }
             return ranges;
           })
      .def("stored", &stored)
      .def("coverage",
           [](PyBake& self) {
             const Image& first = self.result.maps.front().image;
             return view(self.result.coverage.data(), {first.height, first.width}, nb::find(self));
           })
      .def("save_map", &save_map);
  module.def("bake", &run_bake, "source"_a, "low"_a, "words"_a, "cage_mesh"_a.none(), "occluders"_a,
             "by_high"_a, "by_low"_a, "textures"_a, "saved"_a.none(), "progress"_a.none());
  module.def("plan", &run_plan, "source"_a, "words"_a, "progress"_a.none());
  module.def("match", &run_match, "source"_a, "low"_a, "words"_a, "cage_mesh"_a.none(),
             "progress"_a.none());
  module.def("extension_of", [](const std::string& format) {
    return std::string(extension_of(image_options(format, false).format));
  });
  module.def("encode", &encoded, "pixels"_a, "format"_a, "dither"_a);
  module.def("keywords", [] {
    nb::list list;
    for (const Keyword& keyword : keywords()) {
      list.append(nb::make_tuple(keyword.name, keyword.is_flag, keyword.help));
    }
    return list;
  });
  module.def("is_transparent", &is_transparent_mesh, "mesh"_a);
  module.def("asset_maps", &asset_maps, "bake"_a, "names"_a, "padded"_a);
  module.def("nearest_keyword", &nearest_keyword, "word"_a);
}

}  // namespace kiln::python
