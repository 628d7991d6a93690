#include "source.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "arguments/high_poly_input.h"

namespace kiln::python {

using nb::literals::operator""_a;

PySource::PySource(const PyMesh& mesh, const std::string& device_name, nb::object progress)
    : high(mesh), device(device_name) {
  const Call call(std::move(progress));
  std::vector<Warning> warnings;
  source = call.run([&] {
    high.mesh = agreed(high.mesh, "HIGH", Trusted::faces, warnings);
    faces_inwards = inward_parts(*high.mesh).count != 0;
    return Source::build(device_of(device), *high.mesh, call.progress());
  });
  check_cancelled(!source);
  warnings.insert(warnings.end(), source->warnings().begin(), source->warnings().end());
  warn(warnings);
}

PySource::~PySource() { close(); }

Source PySource::get() const {
  if (!source)
    throw Error(ErrorCode::usage, "The source is closed: make another kiln.Source.", "closed");
  return *source;
}

void PySource::close() {
  // Freeing waits for the driver, which may wait for a callback that wants the interpreter's lock.
  std::optional<Source> last;
  last.swap(source);
  const nb::gil_scoped_release unlocked;
  last.reset();
}

std::shared_ptr<const Mesh> agreed(const std::shared_ptr<const Mesh>& mesh, const char* which,
                                   Trusted trust, std::vector<Warning>& warnings) {
  if (mesh->normals.empty()) return mesh;
  Mesh turned = *mesh;
  const std::size_t before = warnings.size();
  cli::turn_normals(which, trust, turned, warnings);
  return warnings.size() == before ? mesh : shared(std::move(turned));
}

void add_source(nb::module_& module) {
  nb::class_<PySource>(module, "SourceCore")
      .def(
          "__init__",
          [](PySource* self, const PyMesh& high, const std::string& device, nb::object progress) {
            new (self) PySource(high, device, std::move(progress));
          },
          "high"_a, "device"_a, "progress"_a.none())
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
