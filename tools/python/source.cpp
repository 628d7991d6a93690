#include "source.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

namespace kiln::python {

using nb::literals::operator""_a;

PySource::PySource(std::shared_ptr<const Mesh> mesh, const std::string& device_name,
                   nb::object progress)
    : high(std::move(mesh)), device(device_name) {
  const Call call(std::move(progress));
  source = call.run([&] { return Source::build(device_of(device), *high, call.progress()); });
  check_cancelled(!source);
  warn(source->warnings());
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

void add_source(nb::module_& module) {
  nb::class_<PySource>(module, "SourceCore")
      .def(
          "__init__",
          [](PySource* self, const PyMesh& high, const std::string& device, nb::object progress) {
            new (self) PySource(high.mesh, device, std::move(progress));
          },
          "high"_a, "device"_a, "progress"_a.none())
      .def("close", &PySource::close)
      .def_prop_ro("closed", [](const PySource& self) { return !self.source.has_value(); })
      .def_prop_ro("high", [](const PySource& self) { return PyMesh{self.high}; })
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
