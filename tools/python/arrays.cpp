#include "arrays.h"

#include <nanobind/stl/string.h>

namespace kiln::python {
namespace {

nb::object check_array(nb::handle array, const char* parameter, const char* type,
                       std::initializer_list<int> shape, nb::object below) {
  nb::list shape_list;
  for (const int side : shape) shape_list.append(side);
  return nb::module_::import_("kiln._arrays")
      .attr("check_array")(array, parameter, type, nb::tuple(shape_list), below);
}

}  // namespace

Input<float> floats(nb::handle array, const char* parameter, std::initializer_list<int> shape) {
  return nb::cast<Input<float>>(check_array(array, parameter, "float32", shape, nb::none()));
}

Input<double> doubles(nb::handle array, const char* parameter, std::initializer_list<int> shape) {
  return nb::cast<Input<double>>(check_array(array, parameter, "float64", shape, nb::none()));
}

Input<std::uint8_t> bytes(nb::handle array, const char* parameter,
                          std::initializer_list<int> shape) {
  return nb::cast<Input<std::uint8_t>>(check_array(array, parameter, "uint8", shape, nb::none()));
}

Input<std::uint32_t> indices(nb::handle array, const char* parameter,
                             std::initializer_list<int> shape, std::size_t below) {
  return nb::cast<Input<std::uint32_t>>(
      check_array(array, parameter, "uint32", shape, nb::int_(below)));
}

Image image_of(nb::handle array, const char* parameter) {
  const nb::object pixels = nb::module_::import_("kiln._arrays").attr("image")(array, parameter);
  const auto values = nb::cast<Input<float>>(pixels);
  Image image;
  image.height = static_cast<std::uint32_t>(values.shape(0));
  image.width = static_cast<std::uint32_t>(values.shape(1));
  image.channels = static_cast<std::uint32_t>(values.shape(2));
  image.pixels.assign(values.data(), values.data() + values.size());
  return image;
}

}  // namespace kiln::python
