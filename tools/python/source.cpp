#include "source.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <cmath>

#include "arrays.h"
#include "base/option.h"
#include "job/high_poly_input.h"

namespace kiln::python {

using nb::literals::operator""_a;

PySource::PySource(const PyMesh& mesh, nb::handle given_bounds, const std::string& device_name,
                   nb::object progress)
    : high(mesh), device(device_name) {
  const Call call(std::move(progress));
  const std::optional<Bounds> bounds = bounds_of(given_bounds, *mesh.mesh);
  std::vector<Warning> warnings;
  source = call.run([&] {
    high.mesh = with_corrected_normals(high.mesh, "HIGH", Trusted::faces, warnings);
    faces_inwards = inward_parts(*high.mesh).count != 0;
    return Source::build(device_of(device), *high.mesh, call.progress(), RayTraversal::automatic,
                         bounds);
  });
  check_cancelled(!source);
  warnings.insert(warnings.end(), source->warnings().begin(), source->warnings().end());
  warn(warnings);
}

PySource::~PySource() { close(); }

Source PySource::get() const {
  if (!source)
    throw Error(ErrorCode::usage, "The source is closed: create a new kiln.Source.", "closed");
  return *source;
}

void PySource::close() {
  // The GIL is released, since destruction waits for the driver, which may wait for a callback that needs the GIL.
  std::optional<Source> last;
  last.swap(source);
  const nb::gil_scoped_release unlocked;
  last.reset();
}

std::optional<Bounds> bounds_of(nb::handle given, const Mesh& mesh) {
  if (given.is_none()) return std::nullopt;
  const auto corners = doubles(given, "bounds", {2, 3});
  Bounds bounds;
  bool finite = true;
  for (std::size_t k = 0; k < 3; ++k) {
    bounds.low[k] = corners.data()[k] - mesh.origin[k];
    bounds.high[k] = corners.data()[3 + k] - mesh.origin[k];
    finite = finite && std::isfinite(bounds.low[k]) && std::isfinite(bounds.high[k]) &&
             bounds.low[k] <= bounds.high[k];
  }
  if (!finite || bounds.low == bounds.high) {
    throw Error(
        ErrorCode::usage,
        option("bounds") +
            ": expected two finite corners, minimum and maximum, of a box that is not a point.",
        "array-range");
  }
  return bounds;
}

std::shared_ptr<const Mesh> with_corrected_normals(const std::shared_ptr<const Mesh>& mesh,
                                                   const char* which, Trusted trust,
                                                   std::vector<Warning>& warnings) {
  if (mesh->normals.empty()) return mesh;
  Mesh corrected = *mesh;
  const std::size_t former_count = warnings.size();
  correct_normals(which, trust, corrected, warnings);
  return warnings.size() == former_count ? mesh : make_shared_mesh(std::move(corrected));
}

void add_source(nb::module_& module) {
  nb::class_<PySource>(module, "SourceCore")
      .def(
          "__init__",
          [](PySource* self, const PyMesh& high, nb::handle bounds, const std::string& device,
             nb::object progress) {
            new (self) PySource(high, bounds, device, std::move(progress));
          },
          "high"_a, "bounds"_a.none(), "device"_a, "progress"_a.none())
      .def("close", &PySource::close)
      .def_prop_ro("closed", [](const PySource& self) { return !self.source.has_value(); })
      .def_prop_ro("high", [](const PySource& self) { return self.high; })
      .def_prop_ro("diagonal", [](const PySource& self) { return self.get().stats().diagonal; })
      .def_prop_ro("device_bytes",
                   [](const PySource& self) { return self.get().stats().device_bytes; });
  module.def("devices", [] {
    const Call call;
    const std::vector<DeviceInfo> infos = call.run([] { return list_devices(); });
    nb::list list;
    for (const DeviceInfo& info : infos) {
      nb::dict entry;
      entry["index"] = info.index;
      entry["name"] = info.name;
      entry["platform"] = info.platform;
      entry["driver"] = info.driver;
      entry["is_gpu"] = info.is_gpu;
      entry["compute_units"] = info.compute_units;
      entry["memory_bytes"] = info.memory_bytes;
      list.append(entry);
    }
    return list;
  });
}

}  // namespace kiln::python
