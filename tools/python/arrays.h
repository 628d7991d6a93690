// Converts between NumPy arrays and the library's types.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstddef>
#include <initializer_list>
#include <memory>
#include <vector>

#include "kiln/image_data.h"

namespace kiln::python {

namespace nb = nanobind;

/// An array of the caller, contiguous and of type T. kiln._arrays checks and converts it.
/// \throws kiln.Error that names the parameter
template <typename T>
using Input = nb::ndarray<const T, nb::c_contig, nb::device::cpu>;

Input<float> floats(nb::handle array, const char* parameter, std::initializer_list<int> shape);
Input<double> doubles(nb::handle array, const char* parameter, std::initializer_list<int> shape);
Input<std::uint8_t> bytes(nb::handle array, const char* parameter,
                          std::initializer_list<int> shape);
/// Checks an array of integers, each of which must be at least 0 and less than `below`.
Input<std::uint32_t> indices(nb::handle array, const char* parameter,
                             std::initializer_list<int> shape, std::size_t below);

/// Makes an array over memory that `owner` keeps alive. \tparam T  const for read-only arrays
template <typename T>
nb::any view(T* data, std::initializer_list<std::size_t> shape, nb::handle owner) {
  return nb::steal<nb::any>(nb::cast(nb::ndarray<nb::numpy, T>(data, shape, owner)).release());
}

/// Makes an array that owns its values.
template <typename T>
nb::any array(std::vector<T> values, std::initializer_list<std::size_t> shape) {
  auto kept = std::make_unique<std::vector<T>>(std::move(values));
  T* const data = kept->data();
  const nb::capsule owner(kept.release(),
                          [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return nb::steal<nb::any>(nb::cast(nb::ndarray<nb::numpy, T>(data, shape, owner)).release());
}

/// Converts an array (H, W) or (H, W, C) to a float32 image. \throws kiln.Error that names the parameter
Image image_of(nb::handle array, const char* parameter);

}  // namespace kiln::python
