#include "match.h"

#include <nanobind/stl/filesystem.h>

#include <cmath>
#include <limits>

#include "arrays.h"

namespace kiln::python {
namespace {

using nb::literals::operator""_a;

constexpr std::uint32_t kNone = 0xFFFFFFFF;

/// Interpolates values of corners of the matched triangle by barycentric coordinates, for each sample.
/// \param corner  function of (triangle, corner, component)
template <typename T, typename Corner>
nb::object interpolate(const PyMatch& self, const Corner& corner) {
  const Match& match = *self.match;
  std::vector<T> values(3 * match.triangle.size(), std::numeric_limits<T>::quiet_NaN());
  const Call call;
  call.run([&] {
    for (std::size_t i = 0; i < match.triangle.size(); ++i) {
      const std::uint32_t t = match.triangle[i];
      if (t == kNone) continue;
      const double u = match.u[i], v = match.v[i], w = 1 - u - v;
      for (std::size_t k = 0; k < 3; ++k) {
        values[3 * i + k] =
            static_cast<T>(w * corner(t, 0, k) + u * corner(t, 1, k) + v * corner(t, 2, k));
      }
    }
  });
  return array(std::move(values), {match.height, match.width, 3});
}

/// Declares a property's type for the stub file.
auto getter(const char* signature) { return nb::for_getter(nb::sig(signature)); }

double component(const Vec3& v, std::size_t k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; }

nb::object position(const PyMatch& self) {
  const Mesh& high = *self.high.mesh;
  return interpolate<double>(self, [&](std::uint32_t t, std::size_t c, std::size_t k) {
    return high.origin[k] + component(high.positions[high.triangles[t][c]], k);
  });
}

nb::object barycentrics(const PyMatch& self) {
  return interpolate<float>(
      self, [](std::uint32_t, std::size_t c, std::size_t k) { return c == k ? 1.0 : 0.0; });
}

}  // namespace

void add_match(nb::module_& module) {
  nb::class_<PyMatch>(module, "Match", R"(Which point of the high poly each texel stands for.

Arrays are (H, W, ...), row 0 at the top, where v is 1; with samples=N they are N times as high and wide.)")
      .def_prop_ro(
          "face",
          [](const PyMatch& self) {
            const Match& m = *self.match;
            return view(reinterpret_cast<const std::int32_t*>(m.triangle.data()),
                        {m.height, m.width}, nb::find(self));
          },
          getter("def face(self, /) -> numpy.typing.NDArray[numpy.int32]"),
          "(H, W) int32: rows of the high poly's faces; -1 if no point was found")
      .def_prop_ro("barycentrics", &barycentrics,
                   getter("def barycentrics(self, /) -> numpy.typing.NDArray[numpy.float32]"),
                   "(H, W, 3) float32: weights of the face's corners; NaN where none was found")
      .def_prop_ro("position", &position,
                   getter("def position(self, /) -> numpy.typing.NDArray[numpy.float64]"),
                   "(H, W, 3) float64: on the high poly, world units; NaN where none was found")
      .def_prop_ro(
          "distance",
          [](const PyMatch& self) {
            const Match& m = *self.match;
            return view(m.distance.data(), {m.height, m.width}, nb::find(self));
          },
          getter("def distance(self, /) -> numpy.typing.NDArray[numpy.float32]"),
          "(H, W) float32: from the low poly, world units, outward positive")
      .def_prop_ro(
          "status",
          [](const PyMatch& self) {
            const Match& m = *self.match;
            return view(m.status.data(), {m.height, m.width}, nb::find(self));
          },
          getter("def status(self, /) -> numpy.typing.NDArray[numpy.uint8]"),
          "(H, W) uint8: how each sample was matched, a value of kiln.SampleStatus")
      .def_prop_ro(
          "samples", [](const PyMatch& self) { return self.match->samples; },
          "N of N x N samples a texel")
      .def_prop_ro(
          "high", [](const PyMatch& self) { return self.high; },
          "The high poly as given, except for faces that were flipped with a warning")
      .def_ro("report", &PyMatch::report, getter("def report(self, /) -> dict[str, typing.Any]"),
              "Statistics of the match")
      .def(
          "save",
          [](const PyMatch& self, nb::handle given) {
            const Call call;
            const std::filesystem::path path = path_of(given);
            call.run([&] { save_match(*self.match, path); });
          },
          nb::sig("def save(self, path: str | os.PathLike[str]) -> None"), "path"_a,
          "Writes an EXR that the command's --load-match reads.");
}

}  // namespace kiln::python
