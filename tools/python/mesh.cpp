#include "mesh.h"

#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <type_traits>

#include "arrays.h"
#include "asset/axes.h"
#include "base/option.h"
#include "job/mesh_files.h"
#include "kiln/validate.h"
#include "kiln/version.h"
#include "options/words.h"

namespace kiln::python {
namespace {

using nb::literals::operator""_a;

/// Chooses an origin near the positions if single precision would lose detail, as the file readers do.
std::array<double, 3> origin_for(const double* xyz, std::size_t count) {
  std::array<double, 3> low{}, high{}, origin{};
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < count; ++i, xyz += 3) {
    if (!std::isfinite(xyz[0]) || !std::isfinite(xyz[1]) || !std::isfinite(xyz[2])) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], xyz[k]);
      high[k] = std::max(high[k], xyz[k]);
    }
  }
  const double diagonal = std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
  double distance = 0;
  for (std::size_t k = 0; k < 3; ++k)
    distance = std::max(distance, std::abs((low[k] + high[k]) / 2));
  if (!(diagonal > 0) || !std::isfinite(diagonal) || !(distance > 16 * diagonal)) return origin;
  const double step = std::exp2(std::ceil(std::log2(diagonal)));
  for (std::size_t k = 0; k < 3; ++k)
    origin[k] = std::round((low[k] + high[k]) / 2 / step) * step + 0.0;
  return origin;
}

template <typename T>
std::vector<T> copy_elements(const void* data, std::size_t count) {
  std::vector<T> values(count);
  if (count != 0) std::memcpy(static_cast<void*>(values.data()), data, count * sizeof(T));
  return values;
}

/// Sets one index per triangle, and the names for these indices.
void name_triangles(nb::handle given, nb::handle given_names, const char* parameter,
                    std::size_t triangles, std::vector<std::uint32_t>& numbers,
                    std::vector<std::string>& names) {
  if (given.is_none()) return;
  const auto rows = indices(given, parameter, {static_cast<int>(triangles)}, std::size_t{1} << 31);
  numbers = copy_elements<std::uint32_t>(rows.data(), rows.size());
  std::size_t count = 0;
  for (const std::uint32_t number : numbers)
    count = std::max<std::size_t>(count, number + std::size_t{1});
  if (!given_names.is_none() && !nb::try_cast(given_names, names)) {
    throw Error(ErrorCode::usage,
                std::string(parameter) + ": expected their names as a list of str.", "option-type");
  }
  if (given_names.is_none() && count <= std::size_t{1} << 20) {
    for (std::size_t i = 0; i < count; ++i) names.push_back(std::to_string(i));
  }
}

/// Converts values per vertex (V, n), values per corner (F, 3, n), or a pool of values with triangles of its own.
template <typename T>
void read_attribute_pool(nb::handle values, nb::handle faces, const char* parameter,
                         const char* faces_parameter, int channels, const Mesh& mesh,
                         std::vector<T>& pool, std::vector<Triangle>& triangles) {
  if (values.is_none()) return;
  const nb::object shaped_values =
      nb::module_::import_("kiln._arrays")
          .attr("corner_values")(values, faces, parameter, channels, mesh.positions.size(),
                                 mesh.triangles.size());
  const auto numbers = nb::cast<Input<float>>(shaped_values[0]);
  pool = copy_elements<T>(numbers.data(), numbers.size() / static_cast<std::size_t>(channels));
  const std::string layout = nb::cast<std::string>(shaped_values[1]);
  if (layout == "vertex") {
    triangles = mesh.triangles;
  } else if (layout == "corner") {
    triangles.resize(mesh.triangles.size());
    for (std::uint32_t t = 0; t < triangles.size(); ++t)
      triangles[t] = {3 * t, 3 * t + 1, 3 * t + 2};
  } else {
    const auto corners =
        indices(faces, faces_parameter, {static_cast<int>(mesh.triangles.size()), 3}, pool.size());
    triangles = copy_elements<Triangle>(corners.data(), mesh.triangles.size());
  }
}

PyMesh from_arrays(nb::handle vertices, nb::handle faces, nb::handle uvs, nb::handle uv_faces,
                   nb::handle normals, nb::handle normal_faces, nb::handle colors,
                   nb::handle materials, nb::handle material_names, nb::handle groups,
                   nb::handle group_names, nb::handle objects, nb::handle object_names,
                   nb::handle tangents, nb::handle smooth_angle, const std::string& name,
                   const std::string& up) {
  Mesh mesh;
  mesh.name = name;
  const auto given_xyz = doubles(vertices, "vertices", {-1, 3});
  const std::size_t count = given_xyz.shape(0);
  const AffineMap rotation = rotation_to_y_up(parse_up(up));
  const bool needs_rotation = rotation != kIdentityMap;
  std::vector<double> rotated_xyz(needs_rotation ? 3 * count : 0);
  for (std::size_t i = 0; i < rotated_xyz.size(); ++i) {
    const double* const from = given_xyz.data() + i / 3 * 3;
    const std::size_t k = i % 3;
    rotated_xyz[i] =
        rotation[k] * from[0] + rotation[4 + k] * from[1] + rotation[8 + k] * from[2] + 0.0;
  }
  const double* const xyz = needs_rotation ? rotated_xyz.data() : given_xyz.data();
  const auto rotate = [&](Vec3& v) {
    const Vec3 from = v;
    float* const to[] = {&v.x, &v.y, &v.z};
    for (std::size_t k = 0; k < 3; ++k) {
      *to[k] = static_cast<float>(rotation[k] * from.x + rotation[4 + k] * from.y +
                                  rotation[8 + k] * from.z);
    }
  };
  mesh.origin = origin_for(xyz, count);
  mesh.positions.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double* const p = xyz + 3 * i;
    mesh.positions[i] = {static_cast<float>(p[0] - mesh.origin[0]),
                         static_cast<float>(p[1] - mesh.origin[1]),
                         static_cast<float>(p[2] - mesh.origin[2])};
    const Vec3& q = mesh.positions[i];
    const bool is_in_float_range = std::isfinite(q.x) && std::isfinite(q.y) && std::isfinite(q.z);
    if (!is_in_float_range && std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2])) {
      throw Error(ErrorCode::input,
                  option("vertices") + ": row " + std::to_string(i) +
                      " exceeds the range of floats: scale the mesh down.",
                  "mesh-range");
    }
  }
  const auto corners = indices(faces, "faces", {-1, 3}, count);
  mesh.triangles = copy_elements<Triangle>(corners.data(), corners.shape(0));
  read_attribute_pool(uvs, uv_faces, "uvs", "uv_faces", 2, mesh, mesh.uvs, mesh.uv_triangles);
  read_attribute_pool(normals, normal_faces, "normals", "normal_faces", 3, mesh, mesh.normals,
                      mesh.normal_triangles);
  if (needs_rotation) {
    for (Vec3& normal : mesh.normals) rotate(normal);
  }
  if (!colors.is_none()) {
    const nb::object rgba =
        nb::module_::import_("kiln._arrays").attr("vertex_colors")(colors, count);
    const auto values = nb::cast<Input<std::uint8_t>>(rgba);
    mesh.colors = copy_elements<std::array<std::uint8_t, 4>>(values.data(), count);
  }
  name_triangles(materials, material_names, "materials", mesh.triangles.size(), mesh.materials,
                 mesh.material_names);
  name_triangles(groups, group_names, "groups", mesh.triangles.size(), mesh.groups,
                 mesh.group_names);
  name_triangles(objects, object_names, "objects", mesh.triangles.size(), mesh.objects,
                 mesh.object_names);
  if (!tangents.is_none()) {
    const auto values =
        floats(tangents, "tangents", {static_cast<int>(3 * mesh.triangles.size()), 4});
    mesh.tangents = copy_elements<Tangent>(values.data(), 3 * mesh.triangles.size());
    if (needs_rotation) {
      for (Tangent& tangent : mesh.tangents) rotate(tangent.direction);
    }
  }
  const Call call;
  if (smooth_angle.is_none()) {
    call.run([&] { validate(mesh); });
    return {make_shared_mesh(std::move(mesh))};
  }
  ShadingOptions shading = {.rule = ShadingRule::angle};
  const bool is_number = nb::try_cast(smooth_angle, shading.angle_degrees);
  if (!is_number || !(shading.angle_degrees > 0) || shading.angle_degrees > 180) {
    throw Error(ErrorCode::usage,
                option("smooth_angle") + ": expected a number above 0 and up to 180 degrees.",
                "option-range");
  }
  if (!mesh.normals.empty()) {
    throw Error(ErrorCode::usage,
                "smooth_angle: it requests computed normals, but normals were given: leave one of "
                "them out.",
                "option-contradiction");
  }
  call.run([&] { shade_high(mesh, shading); });
  return {make_shared_mesh(std::move(mesh))};
}

/// Converts rows to an array; None if there are no rows.
template <typename Row, typename T>
nb::object rows(const PyMesh& self, const std::vector<Row>& values, const T*, std::size_t columns) {
  if (values.empty()) return nb::none();
  return view(reinterpret_cast<const T*>(values.data()), {values.size(), columns}, nb::find(self));
}

nb::object world_vertices(const PyMesh& self) {
  const Mesh& mesh = *self.mesh;
  const std::size_t count = mesh.positions.size();
  if (mesh.origin == std::array<double, 3>{}) {
    return view(reinterpret_cast<const float*>(mesh.positions.data()), {count, 3}, nb::find(self));
  }
  std::vector<double> world;
  world.reserve(3 * count);
  for (const Vec3& p : mesh.positions) {
    world.insert(world.end(), {mesh.origin[0] + p.x, mesh.origin[1] + p.y, mesh.origin[2] + p.z});
  }
  return array(std::move(world), {count, 3});
}

nb::object numbers(const PyMesh& self, const std::vector<std::uint32_t>& values) {
  if (values.empty()) return nb::none();
  return view(values.data(), {values.size()}, nb::find(self));
}

/// Declares a property's type for the stub file.
auto getter(const char* signature) { return nb::for_getter(nb::sig(signature)); }

nb::str describe(const PyMesh& self) {
  const Mesh& mesh = *self.mesh;
  std::string text = "<kiln.Mesh '" + mesh.name + "': " + std::to_string(mesh.positions.size()) +
                     " vertices, " + std::to_string(mesh.triangles.size()) + " faces";
  if (!mesh.uvs.empty()) text += ", uvs";
  if (!mesh.normals.empty()) text += ", normals";
  if (!mesh.colors.empty()) text += ", colors";
  return text_of(text + ">");
}

/// Visits all members of a mesh in the order in which pickles store them. If a member is added to Mesh, this fails to
/// compile until it is visited, too.
template <typename AnyMesh, typename Function>
void for_each_array(AnyMesh& mesh, Function&& part) {
  auto& [name, origin, positions, triangles, uvs, uv_triangles, normals, normal_triangles, tangents,
         colors, groups, group_names, objects, object_names, materials, material_names,
         material_files, polygons, metres, uv_set, other_uvs] = mesh;
  const auto each = [&](auto&... parts) { (part(parts), ...); };
  each(name, origin, positions, triangles, uvs, uv_triangles, normals, normal_triangles, tangents,
       colors, groups, group_names, objects, object_names, materials, material_names,
       material_files, polygons, metres, uv_set, other_uvs);
}

/// Visits the numbers of a report. Warnings are omitted, since they were issued already.
template <typename Report, typename Function>
void for_each_report_value(Report& report, Function&& figure) {
  auto& [input_faces, faces, error, mean_error, back_error, mended, folded, without_area, holes,
         dropped_parts, charts, coverage, uv_strays, seconds, warnings] = report;
  const auto each = [&](auto&... figures) { (figure(figures), ...); };
  each(input_faces, faces, error, mean_error, back_error, mended, folded, without_area, holes,
       dropped_parts, charts, coverage, uv_strays, seconds);
}

/// Pickles store arrays and names as bytes, other members as Python objects.
template <typename T>
constexpr bool kIsArray = false;
template <typename T>
constexpr bool kIsArray<std::vector<T>> = std::is_trivially_copyable_v<T>;

/// Name in messages of a file that was given as bytes.
constexpr const char* kNameOfBytes = "mesh.glb";

std::span<const std::byte> bytes_view(const nb::bytes& data) {
  return {static_cast<const std::byte*>(data.data()), data.size()};
}

nb::bytes as_bytes(const std::string& text) { return nb::bytes(text.data(), text.size()); }
std::string string_from_bytes(nb::handle given) {
  const auto bytes = nb::cast<nb::bytes>(given);
  return {bytes.c_str(), bytes.size()};
}

nb::tuple pickle_mesh(const PyMesh& self) {
  nb::list parts;
  for_each_array(*self.mesh, [&](const auto& part) {
    using Part = std::remove_cvref_t<decltype(part)>;
    if constexpr (kIsArray<Part>) {
      parts.append(nb::bytes(part.data(), part.size() * sizeof(typename Part::value_type)));
    } else if constexpr (std::is_same_v<Part, std::vector<UvSet>>) {
      nb::list sets;
      for (const UvSet& of : part) {
        sets.append(nb::make_tuple(of.set, nb::bytes(of.uvs.data(), of.uvs.size() * sizeof(Vec2))));
      }
      parts.append(sets);
    } else if constexpr (std::is_same_v<Part, std::string>) {
      parts.append(as_bytes(part));
    } else if constexpr (std::is_same_v<Part, std::vector<std::string>>) {
      nb::list names;
      for (const std::string& name : part) names.append(as_bytes(name));
      parts.append(names);
    } else {
      parts.append(part);
    }
  });
  // Bytes are embedded in the pickle; files are stored by path.
  const std::string file =
      self.file.empty() ? "" : std::filesystem::absolute(self.file).lexically_normal().string();
  nb::list made;
  if (self.made)
    for_each_report_value(*self.made, [&](const auto& figure) { made.append(figure); });
  return nb::make_tuple(std::string(version()), parts, as_bytes(file), self.content, self.report,
                        made, self.height_field);
}

/// number of parts of a pickle
constexpr std::size_t kPickledParts = 7;

PyMesh unpickle_parts(const nb::tuple& state, const Call& call) {
  const std::string pickled_version = nb::cast<std::string>(state[0]);
  if (pickled_version != version()) {
    throw Error(ErrorCode::input,
                "The mesh was pickled by Kiln " + pickled_version + ", and this is " +
                    std::string(version()) + ": pass a file instead.",
                "pickle");
  }
  Mesh mesh;
  std::size_t i = 0;
  const nb::list parts = nb::cast<nb::list>(state[1]);
  for_each_array(mesh, [&](auto& part) {
    using Part = std::remove_cvref_t<decltype(part)>;
    if (i >= parts.size()) throw nb::index_error();
    const nb::object given = parts[i++];
    if constexpr (kIsArray<Part>) {
      using Row = typename Part::value_type;
      const nb::bytes bytes = nb::cast<nb::bytes>(given);
      part = copy_elements<Row>(bytes.data(), bytes.size() / sizeof(Row));
    } else if constexpr (std::is_same_v<Part, std::vector<UvSet>>) {
      for (const nb::handle set : given) {
        const nb::bytes bytes = nb::cast<nb::bytes>(set[1]);
        part.push_back({nb::cast<std::uint32_t>(set[0]),
                        copy_elements<Vec2>(bytes.data(), bytes.size() / sizeof(Vec2))});
      }
    } else if constexpr (std::is_same_v<Part, std::string>) {
      part = string_from_bytes(given);
    } else if constexpr (std::is_same_v<Part, std::vector<std::string>>) {
      for (const nb::handle name : nb::cast<nb::list>(given))
        part.push_back(string_from_bytes(name));
    } else {
      part = nb::cast<Part>(given);
    }
  });
  call.run([&] { validate(mesh); });
  PyMesh result{make_shared_mesh(std::move(mesh)), string_from_bytes(state[2])};
  if (const nb::object content = state[3]; !content.is_none()) {
    const nb::bytes data = nb::cast<nb::bytes>(content);
    result.content = data;
    result.materials = call.run([&] {
      return std::make_shared<const std::vector<Material>>(
          load_asset(bytes_view(data), kNameOfBytes).materials);
    });
  }
  result.report = state[4];
  if (const nb::list made = nb::cast<nb::list>(state[5]); made.size() != 0) {
    SimplifyReport report;
    i = 0;
    for_each_report_value(report, [&](auto& figure) {
      if (i >= made.size()) throw nb::index_error();
      figure = nb::cast<std::remove_cvref_t<decltype(figure)>>(made[i++]);
    });
    result.made = std::make_shared<const SimplifyReport>(std::move(report));
  }
  result.height_field = nb::cast<bool>(state[6]);
  return result;
}

PyMesh unpickle_mesh(const nb::tuple& state) {
  const Call call;
  if (state.size() == kPickledParts) {
    try {
      return unpickle_parts(state, call);
    } catch (const Error&) {
      throw;
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception&) {
      // the pickle has parts of other types, or too few of them
    }
  }
  throw Error(ErrorCode::input, "This is not a pickle of a kiln.Mesh: pass a file instead.",
              "pickle");
}

PyMesh load_file(const std::filesystem::path& path, const std::string& triangulate,
                 std::uint32_t uv_set, const std::string& up) {
  const Call call;
  std::vector<Warning> warnings;
  LoadMeshOptions options;
  const Triangulation* const triangulation = Words(kTriangulationWords).find(triangulate);
  if (triangulation == nullptr) {
    throw Error(
        ErrorCode::usage,
        option("triangulate") + " is '" + triangulate + "': give auto, blender, fan or shortest.",
        "option-enum");
  }
  options.triangulation = *triangulation;
  options.uv_set = uv_set;
  if (!up.empty()) options.up = parse_up(up);
  PyMesh mesh{call.run([&] { return make_shared_mesh(load_mesh(path, options, &warnings)); })};
  mesh.file = path.string();
  warn(warnings);
  return mesh;
}

/// Copies a mesh, with the single material of another mesh.
PyMesh with_material(const PyMesh& mesh, const PyMesh& of) {
  PyMesh result = mesh;
  Mesh copy = *mesh.mesh;
  copy.materials.assign(copy.triangles.size(), 0);
  copy.material_names = of.mesh->material_names;
  copy.material_files = of.mesh->material_files;
  result.mesh = make_shared_mesh(std::move(copy));
  result.file = of.file;
  result.content = of.content;
  result.materials = of.materials;
  return result;
}

/// Copies a mesh with the normals that bakes use. \param rule  a value of --high-normals
PyMesh copy_with_bake_normals(const PyMesh& mesh, const std::string& rule) {
  const Call call;
  PyMesh result = mesh;
  if (mesh.height_field) return result;
  std::vector<Warning> warnings;
  call.run([&] {
    const ShadingOptions options = parse_shading(rule);
    Mesh copy = *mesh.mesh;
    warnings = shade_high(copy, options).warnings;
    const bool is_unchanged =
        copy.normal_triangles == mesh.mesh->normal_triangles && copy.normals == mesh.mesh->normals;
    if (!is_unchanged) result.mesh = make_shared_mesh(std::move(copy));
  });
  warn(warnings);
  return result;
}

/// A mesh from a file's bytes, with the materials in them.
/// \param with_nodes  true: jobs get the file's nodes, too
PyMesh load_bytes(nb::bytes data, const std::string& name, const std::string& up, bool with_nodes) {
  const Call call;
  std::vector<Warning> warnings;
  LoadMeshOptions options;
  if (!up.empty()) options.up = parse_up(up);
  const auto asset = call.run([&] {
    return std::make_shared<const Asset>(load_asset(bytes_view(data), name, options, &warnings));
  });
  PyMesh mesh{std::shared_ptr<const Mesh>(asset, &asset->mesh)};
  if (!asset->materials.empty()) {
    mesh.content = data;
    mesh.materials = {asset, &asset->materials};
  }
  if (with_nodes) mesh.asset = asset;
  warn(warnings);
  return mesh;
}

}  // namespace

std::vector<Material> materials_of(const PyMesh& mesh) {
  if (mesh.materials) return *mesh.materials;
  if (mesh.file.empty() || mesh.mesh->material_files.empty()) return {};
  return load_materials(*mesh.mesh, mesh.file);
}

void add_mesh(nb::module_& module) {
  nb::class_<PyMesh>(module, "Mesh", R"(A triangle mesh that does not change.

Arrays that it was made of are copied; arrays that it gives are read-only views.

vertices      (V, 3) float, world units; float64 keeps its precision far from the origin
faces         (F, 3) whole numbers below V, counter-clockwise seen from outside
uvs           (V, 2), one a vertex; (F, 3, 2), one a corner; or (N, 2) with uv_faces (F, 3). Origin at the lower left
normals       (V, 3), (F, 3, 3), or (N, 3) with normal_faces; without: computed where they are needed
colors        (V, 3) or (V, 4), sRGB-encoded: uint8, or float in [0, 1]
materials     (F,) whole numbers that material_names counts from 0; groups and objects alike
tangents      (3 F, 4), one a corner: direction along u, and the bitangent's sign; without: MikkTSpace's
smooth_angle  in place of normals: edges whose faces turn by so many degrees or more are hard, all others smooth
name          in messages and names of files
up            the axis of the arrays that points up: x, y, z, -x, -y or -z. It is turned to Y, as in glTF

Raises kiln.Error, with the parameter's name, for arrays of other shapes or types.

>>> import kiln
>>> mesh = kiln.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], uvs=[[0, 0], [1, 0], [0, 1]])
>>> mesh.faces.shape, mesh.uvs.dtype.name
((1, 3), 'float32'))")
      .def(
          "__init__",
          [](PyMesh* self, nb::object vertices, nb::object faces, nb::object uvs,
             nb::object uv_faces, nb::object normals, nb::object normal_faces, nb::object colors,
             nb::object materials, nb::object material_names, nb::object groups,
             nb::object group_names, nb::object objects, nb::object object_names,
             nb::object tangents, nb::object smooth_angle, const std::string& name,
             const std::string& up) {
            new (self) PyMesh(from_arrays(vertices, faces, uvs, uv_faces, normals, normal_faces,
                                          colors, materials, material_names, groups, group_names,
                                          objects, object_names, tangents, smooth_angle, name, up));
          },
          "vertices"_a.none(), "faces"_a.none(), "uvs"_a.none() = nb::none(), nb::kw_only(),
          "uv_faces"_a.none() = nb::none(), "normals"_a.none() = nb::none(),
          "normal_faces"_a.none() = nb::none(), "colors"_a.none() = nb::none(),
          "materials"_a.none() = nb::none(), "material_names"_a.none() = nb::none(),
          "groups"_a.none() = nb::none(), "group_names"_a.none() = nb::none(),
          "objects"_a.none() = nb::none(), "object_names"_a.none() = nb::none(),
          "tangents"_a.none() = nb::none(), "smooth_angle"_a.none() = nb::none(), "name"_a = "mesh",
          "up"_a = "y")
      .def_prop_ro(
          "name", [](const PyMesh& self) { return text_of(self.mesh->name); },
          getter("def name(self, /) -> str"), "Name of the mesh in messages and file names")
      .def_prop_ro(
          "vertices", &world_vertices,
          getter("def vertices(self, /) -> numpy.typing.NDArray[numpy.float32 | numpy.float64]"),
          "(V, 3) float32, world units; float64 if the mesh is far from the origin")
      .def_prop_ro(
          "faces",
          [](const PyMesh& self) {
            return view(reinterpret_cast<const std::uint32_t*>(self.mesh->triangles.data()),
                        {self.mesh->triangles.size(), 3}, nb::find(self));
          },
          getter("def faces(self, /) -> numpy.typing.NDArray[numpy.uint32]"),
          "(F, 3) uint32: rows of vertices")
      .def_prop_ro(
          "uvs",
          [](const PyMesh& self) {
            return rows(self, self.mesh->uvs, static_cast<float*>(nullptr), 2);
          },
          getter("def uvs(self, /) -> numpy.typing.NDArray[numpy.float32] | None"),
          "(N, 2) float32, origin at the lower left, or None; uv_faces refers to its rows")
      .def_prop_ro(
          "uv_faces",
          [](const PyMesh& self) {
            return rows(self, self.mesh->uv_triangles, static_cast<std::uint32_t*>(nullptr), 3);
          },
          getter("def uv_faces(self, /) -> numpy.typing.NDArray[numpy.uint32] | None"),
          "(F, 3) uint32: rows of uvs, or None")
      .def_prop_ro(
          "normals",
          [](const PyMesh& self) {
            return rows(self, self.mesh->normals, static_cast<float*>(nullptr), 3);
          },
          getter("def normals(self, /) -> numpy.typing.NDArray[numpy.float32] | None"),
          "(N, 3) float32, or None; normal_faces refers to its rows")
      .def_prop_ro(
          "normal_faces",
          [](const PyMesh& self) {
            return rows(self, self.mesh->normal_triangles, static_cast<std::uint32_t*>(nullptr), 3);
          },
          getter("def normal_faces(self, /) -> numpy.typing.NDArray[numpy.uint32] | None"),
          "(F, 3) uint32: rows of normals, or None")
      .def_prop_ro(
          "tangents",
          [](const PyMesh& self) {
            return rows(self, self.mesh->tangents, static_cast<float*>(nullptr), 4);
          },
          getter("def tangents(self, /) -> numpy.typing.NDArray[numpy.float32] | None"),
          "(3 F, 4) float32, one per corner, or None")
      .def_prop_ro(
          "colors",
          [](const PyMesh& self) {
            return rows(self, self.mesh->colors, static_cast<std::uint8_t*>(nullptr), 4);
          },
          getter("def colors(self, /) -> numpy.typing.NDArray[numpy.uint8] | None"),
          "(V, 4) uint8, sRGB-encoded RGBA, or None")
      .def_prop_ro(
          "materials", [](const PyMesh& self) { return numbers(self, self.mesh->materials); },
          getter("def materials(self, /) -> numpy.typing.NDArray[numpy.uint32] | None"),
          "(F,) uint32, indices into material_names, or None")
      .def_prop_ro(
          "material_names", [](const PyMesh& self) { return texts_of(self.mesh->material_names); },
          getter("def material_names(self, /) -> list[str]"), "Names of the materials")
      .def_prop_ro(
          "groups", [](const PyMesh& self) { return numbers(self, self.mesh->groups); },
          getter("def groups(self, /) -> numpy.typing.NDArray[numpy.uint32] | None"),
          "(F,) uint32, indices into group_names, or None")
      .def_prop_ro(
          "group_names", [](const PyMesh& self) { return texts_of(self.mesh->group_names); },
          getter("def group_names(self, /) -> list[str]"), "Names of the groups")
      .def_prop_ro(
          "objects", [](const PyMesh& self) { return numbers(self, self.mesh->objects); },
          getter("def objects(self, /) -> numpy.typing.NDArray[numpy.uint32] | None"),
          "(F,) uint32, indices into object_names, or None")
      .def_prop_ro(
          "object_names", [](const PyMesh& self) { return texts_of(self.mesh->object_names); },
          getter("def object_names(self, /) -> list[str]"), "Names of the objects")
      .def_ro("report", &PyMesh::report, getter("def report(self, /) -> typing.Any"),
              "Report of simplify() or unwrap() if it made the mesh, else None")
      .def(
          "save",
          [](const PyMesh& self, nb::handle given) {
            const Call call;
            const std::filesystem::path path = path_of(given);
            std::error_code ignored_error;
            if (!self.file.empty() && std::filesystem::equivalent(path, self.file, ignored_error)) {
              throw Error(ErrorCode::usage,
                          "path: '" + path.string() +
                              "' is the file from which the mesh was read: choose another name.",
                          "output-input");
            }
            call.run([&] { save_obj(*self.mesh, path); });
          },
          nb::sig("def save(self, path: str | os.PathLike[str]) -> None"), "path"_a,
          "Writes a Wavefront OBJ, completely or not at all, but never over the file from which "
          "the mesh was read.")
      .def("__getstate__", &pickle_mesh)
      .def("__setstate__",
           [](PyMesh& self, const nb::tuple& state) { new (&self) PyMesh(unpickle_mesh(state)); })
      .def("__repr__", &describe);
  module.def("load_file", &load_file, "path"_a, "triangulate"_a = "auto", "uv_set"_a = 0,
             "up"_a = "");
  module.def("with_material", &with_material, "mesh"_a, "of"_a);
  module.def("shaded", &copy_with_bake_normals, "mesh"_a, "rule"_a);
  module.def("load_bytes", &load_bytes, "data"_a, "name"_a, "up"_a = "", "with_nodes"_a = false);
}

}  // namespace kiln::python
