#include "volume.h"

#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <array>
#include <optional>

#include "arrays.h"
#include "base/option.h"
#include "kiln/contour.h"
#include "kiln/volume.h"
#include "mesh.h"

namespace kiln::python {
namespace {

using nb::literals::operator""_a;

struct PyVolume {
  Volume volume;
};

/// Makes a volume from an array. voxels[i, j, k] is at origin + (i, j, k) * spacing; the last index varies fastest.
PyVolume from_array(nb::handle voxels, const std::array<double, 3>& spacing,
                    const std::array<double, 3>& origin, const std::string& name) {
  const nb::object checked = nb::module_::import_("kiln._arrays").attr("voxels")(voxels);
  const auto values =
      nb::cast<nb::ndarray<nb::ro, nb::ndim<3>, nb::c_contig, nb::device::cpu>>(checked);
  PyVolume result;
  Volume& volume = result.volume;
  volume.name = name;
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(spacing[k] > 0)) {
      throw Error(ErrorCode::usage, option("spacing") + " must be above 0 along each axis.",
                  "option-range");
    }
    volume.size[k] = static_cast<std::uint32_t>(values.shape(2 - k));
    volume.axes[k] = {};
    volume.axes[k][2 - k] = spacing[2 - k];
  }
  volume.origin = origin;
  const nb::dlpack::dtype type = values.dtype();
  const bool is_float = type.code == static_cast<std::uint8_t>(nb::dlpack::dtype_code::Float);
  const bool is_signed = type.code == static_cast<std::uint8_t>(nb::dlpack::dtype_code::Int);
  volume.type = is_float          ? (type.bits == 32 ? VoxelType::f32 : VoxelType::f64)
                : type.bits == 8  ? (is_signed ? VoxelType::i8 : VoxelType::u8)
                : type.bits == 16 ? (is_signed ? VoxelType::i16 : VoxelType::u16)
                                  : (is_signed ? VoxelType::i32 : VoxelType::u32);
  const auto* const first = static_cast<const std::byte*>(values.data());
  volume.voxels.assign(first, first + values.size() * size_of(volume.type));
  return result;
}

ContourOptions contour_options(double iso, const std::string& inside, const std::string& border,
                               bool outer) {
  if (inside != "above" && inside != "below") {
    throw Error(ErrorCode::usage, option("inside") + " is '" + inside + "': give above or below.",
                "option-enum");
  }
  if (border != "closed" && border != "open") {
    throw Error(ErrorCode::usage, option("border") + " is '" + border + "': give closed or open.",
                "option-enum");
  }
  ContourOptions options;
  options.iso = iso;
  options.inside = inside == "above" ? Inside::above : Inside::below;
  options.border = border == "closed" ? VolumeBorder::closed : VolumeBorder::open;
  options.outer_only = outer;
  return options;
}

PyMesh run_contour(const PyVolume& voxels, double iso, const std::string& inside,
                   const std::string& border, bool outer, const std::string& device,
                   nb::object progress) {
  const Call call(std::move(progress));
  const ContourOptions options = contour_options(iso, inside, border, outer);
  ContourReport report;
  PyMesh mesh{call.run([&] {
    return make_shared_mesh(contour(device_of(device), voxels.volume, options, &report));
  })};
  warn(report.warnings);
  return mesh;
}

nb::tuple run_extract(const PyVolume& voxels, double iso, const std::string& inside,
                      const std::string& border, bool outer, std::uint32_t faces,
                      std::optional<double> error, std::optional<std::uint32_t> size,
                      const std::string& unwrap, bool flip_y, const std::string& device,
                      nb::object progress) {
  const Call call(std::move(progress));
  if (unwrap != "charts" && unwrap != "pairs") {
    throw Error(ErrorCode::usage, option("unwrap") + " is '" + unwrap + "': give charts or pairs.",
                "option-enum");
  }
  ExtractOptions options;
  options.contour = contour_options(iso, inside, border, outer);
  options.faces = faces;
  if (error) options.error = *error;
  options.choose = {
      .error = !error && faces == 0, .topology = true, .min_part = true, .size = !size};
  if (size) options.size = *size;
  options.unwrap = unwrap == "charts" ? UnwrapMethod::charts : UnwrapMethod::pairs;
  options.flip_y = flip_y;
  std::shared_ptr<const Mesh> mesh;
  ExtractResult result = call.run([&] {
    ExtractResult result = extract(device_of(device), voxels.volume, options);
    mesh = make_shared_mesh(std::move(result.mesh));
    return result;
  });
  warn(result.report.warnings);
  nb::dict d;
  d["faces"] = result.report.faces;
  d["charts"] = result.report.charts;
  d["error"] = result.report.error;
  d["size"] = result.report.used.size;
  d["keep_topology"] = result.report.used.keep_topology;
  d["seconds"] = result.report.seconds_total;
  Image& map = result.normal_map;
  const std::size_t height = map.height, width = map.width, channels = map.channels;
  PyMesh low{mesh};
  low.report = d;
  return nb::make_tuple(low, array(std::move(map.pixels), {height, width, channels}));
}

}  // namespace

void add_volume(nb::module_& module) {
  nb::class_<PyVolume>(module, "VolumeCore")
      .def_static("of", &from_array, "voxels"_a, "spacing"_a, "origin"_a, "name"_a)
      .def_static(
          "load",
          [](const std::filesystem::path& path) {
            const Call call;
            std::vector<Warning> warnings;
            PyVolume read;
            call.run([&] { read.volume = load_volume(path, &warnings); });
            warn(warnings);
            return read;
          },
          "path"_a);
  module.def("contour", &run_contour, "voxels"_a, "iso"_a, "inside"_a, "border"_a, "outer"_a,
             "device"_a, "progress"_a.none());
  module.def("extract", &run_extract, "voxels"_a, "iso"_a, "inside"_a, "border"_a, "outer"_a,
             "faces"_a, "error"_a.none(), "size"_a.none(), "unwrap"_a, "flip_y"_a, "device"_a,
             "progress"_a.none());
}

}  // namespace kiln::python
