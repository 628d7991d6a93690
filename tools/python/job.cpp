#include "job.h"

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/set.h>
#include <nanobind/stl/string.h>

#include <map>
#include <set>
#include <string>

#include "arrays.h"
#include "bake.h"
#include "job/files.h"
#include "job/run.h"
#include "kiln/files.h"
#include "kiln/job.h"
#include "kiln/option_error.h"
#include "kiln/options.h"
#include "match.h"
#include "mesh.h"

namespace kiln::python {
namespace {

using nb::literals::operator""_a;

/// Makes a job input from a Python mesh, with the materials of its file.
JobInput input_of(const PyMesh& mesh, const Call& call) {
  return call.run([&] {
    const std::string& name = mesh.file.empty() ? mesh.mesh->name : mesh.file;
    JobInput input(name.empty() ? "mesh" : name);
    if (mesh.asset && mesh.mesh.get() == &mesh.asset->mesh) {
      input.asset = mesh.asset;
    } else {
      input.asset =
          std::make_shared<const Asset>(Asset{*mesh.mesh, materials_of(mesh), {}, {}, {}, {}, {}});
    }
    input.simplified = mesh.made;
    return input;
  });
}

/// Calls the caller's function with a match. \returns the function's images by material slot
std::map<std::string, Image> call_sample_function(const nb::object& function, const Match& match,
                                                  const Mesh& high) {
  Mesh position_mesh;  // a mesh with only those attributes from which positions are computed
  position_mesh.origin = high.origin;
  position_mesh.positions = high.positions;
  position_mesh.triangles = high.triangles;
  auto kept_places = make_shared_mesh(std::move(position_mesh));
  auto found = std::make_shared<const Match>(match);
  const nb::gil_scoped_acquire locked;
  const nb::dict named_pixels = nb::cast<nb::dict>(
      function(PyMatch{std::move(found), PyMesh{std::move(kept_places)}, nb::none()}));
  std::map<std::string, Image> images;
  for (const auto [name, pixels] : named_pixels) {
    images[nb::cast<std::string>(name)] = image_of(pixels, "sample");
  }
  return images;
}

/// Runs a job.
/// \param json  options, and the files of inputs that are not meshes
nb::dict run_whole_job(const std::string& json, const std::optional<PyMesh>& high,
                       const std::optional<PyMesh>& low, bool in_memory, nb::object progress) {
  const Call call(std::move(progress));
  Job job = job_from_json(json);
  if (high) job.high = {input_of(*high, call)};
  if (low) job.low.given = {input_of(*low, call)};
  job.in_memory = in_memory;
  JobResult job_result = call.run_whole([&](const Progress& progress) {
    check(job);
    return run(device_of(job.device), job, progress);
  });
  check_cancelled(job_result.cancelled);
  warn(job_result.causes);
  nb::dict d;
  d["files"] = texts_of(job_result.files);
  nb::list summary;
  for (const Message& line : job_result.summary)
    summary.append(text_of(line.text(option_as_keyword)));
  d["summary"] = summary;
  d["report"] = text_of(job_result.report);
  d["failure"] = text_of(job_result.failure.text(option_as_keyword));
  d["glb"] = nb::bytes(reinterpret_cast<const char*>(job_result.glb.data()), job_result.glb.size());
  nb::list maps;
  for (JobMap& map : job_result.maps) {
    Image& image = map.map.image;
    const std::size_t height = image.height, width = image.width, channels = image.channels;
    nb::dict one;
    one["name"] = map.name;
    one["set"] = text_of(map.set);
    one["tile"] = text_of(map.tile);
    one["pixels"] = array(std::move(image.pixels), {height, width, channels});
    maps.append(one);
  }
  d["maps"] = maps;
  d["mesh"] = nb::cast(PyMesh{make_shared_mesh(std::move(job_result.low))});
  return d;
}

/// Runs a job whose output is a GLB in memory.
/// \param json         options, and the high poly's file if `high` is None
/// \param not_written  maps that are baked only because other maps need them
/// \param sample       None, or a function from a kiln.Match to images by material slot
/// \returns the file; the low poly; the maps as baked, or None
nb::tuple run_glb(const std::string& json, const std::optional<PyMesh>& high,
                  const std::set<std::string>& not_written, const nb::object& sample,
                  nb::object progress) {
  const Call call(std::move(progress));
  Job job = job_from_json(json);
  job.in_memory = true;
  if (high) {
    job.high = {input_of(*high, call)};
    check_transfers(job, *high);
  }
  RunHooks hooks;
  hooks.needs_uvs = true;
  hooks.not_written = not_written;
  if (!sample.is_none()) {
    hooks.sample = [&](const Match& match, const Mesh& mesh) {
      return call_sample_function(sample, match, mesh);
    };
  }
  std::optional<BakeResult> result;
  PyMesh low;
  hooks.on_baked = [&](BakedJob& baked) {
    if (!baked.result.maps.empty()) result = baked.result;
    if (baked.simplified != nullptr) {
      low.made = std::make_shared<const SimplifyReport>(*baked.simplified);
    }
  };
  JobResult job_result = call.run_whole([&](const Progress& progress) {
    return run_job([&] { return device_of(job.device); }, job, progress, hooks);
  });
  check_cancelled(job_result.cancelled);
  warn(job_result.causes);
  low.mesh = make_shared_mesh(std::move(job_result.low));
  nb::object bake = nb::none();
  if (result) bake = nb::cast(py_bake(std::move(*result), job_result.warnings, low.mesh->name));
  return nb::make_tuple(
      nb::bytes(reinterpret_cast<const char*>(job_result.glb.data()), job_result.glb.size()), low,
      bake);
}

void write_file(const std::filesystem::path& path, nb::bytes data) {
  const Call call;
  const std::string_view bytes(data.c_str(), data.size());
  call.run([&] {
    OutputSet::check(path);
    save_text(path, bytes);
  });
}

/// Creates the folder of a file that will be written, as the command does, and checks that it is writable.
void prepare_file(const std::filesystem::path& path) {
  const Call call;
  call.run([&] {
    prepare_parent(path);
    OutputSet::check(path);
  });
}

/// Checks that a device has this name. \throws Error(device) if none has
void check_device(const std::string& name) {
  const Call call;
  call.run([&] { device_of(name); });
}

}  // namespace

void add_job(nb::module_& module) {
  module.def("run_glb", &run_glb, "json"_a, "high"_a.none(), "not_written"_a, "sample"_a.none(),
             "progress"_a.none());
  module.def("write_file", &write_file, "path"_a, "data"_a);
  module.def("prepare_file", &prepare_file, "path"_a);
  module.def("check_device", &check_device, "name"_a);
  module.def("run_job", &run_whole_job, "json"_a, "high"_a.none(), "low"_a.none(), "in_memory"_a,
             "progress"_a.none());
  module.def("job_schema", &job_schema);
}

}  // namespace kiln::python
