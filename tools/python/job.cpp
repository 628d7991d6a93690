#include "job.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <string>

#include "arrays.h"
#include "kiln/job.h"
#include "kiln/options.h"
#include "mesh.h"

namespace kiln::python {
namespace {

using nb::literals::operator""_a;

/// \param json  options, and the files of sides that are no mesh here
nb::dict run_job(const std::string& json, const std::optional<PyMesh>& high,
                 const std::optional<PyMesh>& low, bool in_memory, nb::object progress) {
  const Call call(std::move(progress));
  Job job = job_from_json(json);
  if (high) job.high = {JobInput(*high->mesh, "high")};
  if (low) job.low.given = {JobInput(*low->mesh, "low")};
  job.in_memory = in_memory;
  JobResult made = call.run([&] {
    check(job);
    return run(device_of(job.device), job, call.progress());
  });
  check_cancelled(made.cancelled);
  warn(made.causes);
  nb::dict d;
  d["files"] = texts_of(made.files);
  d["summary"] = texts_of(made.summary);
  d["report"] = text_of(made.report);
  d["failure"] = text_of(made.failure);
  d["glb"] = nb::bytes(reinterpret_cast<const char*>(made.glb.data()), made.glb.size());
  nb::list maps;
  for (JobMap& map : made.maps) {
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
  d["mesh"] = nb::cast(PyMesh{shared(std::move(made.low))});
  return d;
}

}  // namespace

void add_job(nb::module_& module) {
  module.def("run_job", &run_job, "json"_a, "high"_a.none(), "low"_a.none(), "in_memory"_a,
             "progress"_a.none());
  module.def("job_schema", &job_schema);
}

}  // namespace kiln::python
