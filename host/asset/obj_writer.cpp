// Writes Wavefront OBJ.
#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "asset/mesh_reader.h"
#include "io/file/atomic_file.h"
#include "kiln/mesh.h"
#include "mesh/uv_grid.h"

namespace kiln {
namespace {

/// Collects text, and writes it to the file in large pieces.
class Writer {
 public:
  explicit Writer(AtomicFile& file) : file_(file) { buffer_.reserve(kCapacity); }

  void text(std::string_view value) {
    if (buffer_.size() + value.size() > kCapacity) flush();
    buffer_ += value;
  }
  void write_float(float value) { number(value, std::chars_format::general, 9); }
  void number_exactly(double value) { number(value, std::chars_format::general, 17); }
  void index(std::uint32_t zero_based) {
    char digits[16];
    const auto end =
        std::to_chars(digits, digits + sizeof digits, std::uint64_t{zero_based} + 1).ptr;
    text({digits, static_cast<std::size_t>(end - digits)});
  }
  void finish() { flush(); }

 private:
  static constexpr std::size_t kCapacity = std::size_t{1} << 18;

  template <typename T>
  void number(T value, std::chars_format format, int digits) {
    char characters[40];
    characters[0] = ' ';
    const auto end =
        std::to_chars(characters + 1, characters + sizeof characters, value, format, digits).ptr;
    text({characters, static_cast<std::size_t>(end - characters)});
  }
  void flush() {
    file_.write(buffer_);
    buffer_.clear();
  }

  AtomicFile& file_;
  std::string buffer_;
};

/// Replaces characters that OBJ does not allow in names: control characters would end the line, and
/// a final backslash would join it with the next one. '#' is kept, since within a name it does not
/// begin a comment.
std::string replace_forbidden_characters(const std::string& name) {
  std::string safe_text = name.empty() ? "default" : name;
  for (char& c : safe_text) {
    if (static_cast<unsigned char>(c) < 32 || c == 127 || c == '\\') c = '_';
  }
  return safe_text;
}

/// Replaces line ends in a path; all other characters are kept.
std::string safe_path(std::string name) {
  std::replace(name.begin(), name.end(), '\\', '/');
  std::erase_if(name, [](char c) { return c == '\n' || c == '\r' || c == '\0'; });
  return name;
}

void check(const Mesh& mesh) {
  const auto fail_validation = [&mesh](const char* what) {
    throw Error(ErrorCode::usage, "save_obj: mesh \"" + mesh.name + "\" has " + what +
                                      "; build it so that every attribute is empty or complete.");
  };
  const auto check_indices = [&](const std::vector<Triangle>& list, std::size_t pool,
                                 const char* what) {
    for (const Triangle& triangle : list) {
      for (const std::uint32_t index : triangle) {
        if (index >= pool) fail_validation(what);
      }
    }
  };
  const std::size_t n = mesh.triangles.size();
  if (!mesh.uv_triangles.empty() && mesh.uv_triangles.size() != n)
    fail_validation("a number of uv_triangles that differs from that of its triangles");
  if (!mesh.normal_triangles.empty() && mesh.normal_triangles.size() != n)
    fail_validation("a number of normal_triangles that differs from that of its triangles");
  if (!mesh.groups.empty() && mesh.groups.size() != n)
    fail_validation("a number of groups that differs from that of its triangles");
  if (!mesh.objects.empty() && mesh.objects.size() != n)
    fail_validation("a number of objects that differs from that of its triangles");
  if (!mesh.materials.empty() && mesh.materials.size() != n)
    fail_validation("a number of materials that differs from that of its triangles");
  if (!mesh.colors.empty() && mesh.colors.size() != mesh.positions.size())
    fail_validation("a number of colors that differs from that of its positions");
  check_indices(mesh.triangles, mesh.positions.size(), "a vertex index out of range");
  check_indices(mesh.uv_triangles, mesh.uvs.size(), "a UV index out of range");
  check_indices(mesh.normal_triangles, mesh.normals.size(), "a normal index out of range");
  for (const std::uint32_t group : mesh.groups) {
    if (group >= mesh.group_names.size()) fail_validation("a group index out of range");
  }
  for (const std::uint32_t object : mesh.objects) {
    if (object >= mesh.object_names.size()) fail_validation("an object index out of range");
  }
  for (const std::uint32_t material : mesh.materials) {
    if (material >= mesh.material_names.size()) fail_validation("a material index out of range");
  }
}

/// Writes names: each before the first of consecutive triangles that have it.
class Names {
 public:
  Names(const char* keyword, const std::vector<std::uint32_t>& of,
        const std::vector<std::string>& names)
      : keyword_(keyword), name_of_triangle_(of), names_(names) {}

  /// Writes all names at the start, so that readers number them in this order.
  void write_all_names(Writer& out) const {
    for (const std::string& name :
         name_of_triangle_.empty() ? std::vector<std::string>() : names_) {
      out.text(keyword_ + replace_forbidden_characters(name) + "\n");
    }
  }
  /// True if readers would number the names in this order anyway, since all are used, in this
  /// order.
  bool is_in_order() const {
    std::uint32_t next = 0;
    for (const std::uint32_t name : name_of_triangle_) {
      if (name > next) return false;
      if (name == next) ++next;
    }
    return next == names_.size();
  }
  /// Writes the name of a triangle if it differs from the last name.
  /// \returns true if it was written
  bool write_if_changed(std::size_t triangle, Writer& out) {
    if (name_of_triangle_.empty() || name_of_triangle_[triangle] == last_written_name_)
      return false;
    last_written_name_ = name_of_triangle_[triangle];
    out.text(keyword_ + replace_forbidden_characters(names_[last_written_name_]) + "\n");
    return true;
  }
  /// Some readers use the name of an object as that of the group, too. This records that name as
  /// the last one.
  void copy_names(const Names& object) {
    last_written_name_ = kNone;
    const auto same_name =
        std::find(names_.begin(), names_.end(), object.names_[object.last_written_name_]);
    if (same_name != names_.end())
      last_written_name_ = static_cast<std::uint32_t>(same_name - names_.begin());
  }

 private:
  std::string keyword_;
  const std::vector<std::uint32_t>& name_of_triangle_;  // For each triangle, the index of its name
  const std::vector<std::string>& names_;
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  std::uint32_t last_written_name_ = kNone;
};

/// True if all three corners have a finite UV. In OBJ, either all corners of a face have a UV, or
/// none.
bool has_uvs(const Mesh& mesh, std::size_t triangle) {
  if (mesh.uv_triangles.empty()) return false;
  const Triangle& t = mesh.uv_triangles[triangle];
  return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return is_finite(mesh.uvs[v]); });
}

}  // namespace

std::vector<std::filesystem::path> material_file_paths(const Mesh& mesh,
                                                       const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> paths;
  for (std::string name : mesh.material_files) {
    std::replace(name.begin(), name.end(), '\\', '/');
    paths.push_back(folder / name);
  }
  return paths;
}

void save_obj(const Mesh& mesh, const std::filesystem::path& path) {
  check(mesh);
  AtomicFile file(path);
  Writer out(file);
  out.text("# Kiln\n");
  for (const std::string& name : mesh.material_files) {
    if (has_own_materials(name)) continue;  // This is the mesh's own file, not an MTL
    if (!name.empty()) out.text("mtllib " + safe_path(name) + "\n");
  }
  const bool placed = mesh.origin != std::array<double, 3>{};
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vec3& p = mesh.positions[i];
    out.text("v");
    if (placed) {
      out.number_exactly(mesh.origin[0] + double{p.x});
      out.number_exactly(mesh.origin[1] + double{p.y});
      out.number_exactly(mesh.origin[2] + double{p.z});
    } else {
      out.write_float(p.x);
      out.write_float(p.y);
      out.write_float(p.z);
    }
    if (!mesh.colors.empty()) {
      for (int k = 0; k < 3; ++k) out.write_float(static_cast<float>(mesh.colors[i][k]) / 255.0f);
    }
    out.text("\n");
  }
  const bool normals = !mesh.normal_triangles.empty();
  std::vector<std::uint32_t> uv_number(mesh.uv_triangles.empty() ? 0 : mesh.uvs.size());
  if (!mesh.uv_triangles.empty()) {
    std::uint32_t next = 0;
    for (std::size_t i = 0; i < mesh.uvs.size(); ++i) {
      const Vec2& uv = mesh.uvs[i];
      if (!is_finite(uv)) continue;
      uv_number[i] = next++;
      out.text("vt");
      out.write_float(uv.x);
      out.write_float(uv.y);
      out.text("\n");
    }
  }
  if (normals) {
    for (const Vec3& n : mesh.normals) {
      out.text("vn");
      out.write_float(n.x);
      out.write_float(n.y);
      out.write_float(n.z);
      out.text("\n");
    }
  }
  Names groups("g ", mesh.groups, mesh.group_names);
  Names materials("usemtl ", mesh.materials, mesh.material_names);
  Names objects("o ", mesh.objects, mesh.object_names);
  // Other programs start a new object at each `g` line. So all groups are named at the start only where that is needed.
  if (mesh.objects.empty() || !groups.is_in_order()) groups.write_all_names(out);
  if (!objects.is_in_order()) objects.write_all_names(out);
  materials.write_all_names(out);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (objects.write_if_changed(t, out)) groups.copy_names(objects);
    groups.write_if_changed(t, out);
    materials.write_if_changed(t, out);
    const bool uvs = has_uvs(mesh, t);
    out.text("f");
    for (int k = 0; k < 3; ++k) {
      out.text(" ");
      out.index(mesh.triangles[t][k]);
      if (uvs) {
        out.text("/");
        out.index(uv_number[mesh.uv_triangles[t][k]]);
      }
      if (normals) {
        out.text(uvs ? "/" : "//");
        out.index(mesh.normal_triangles[t][k]);
      }
    }
    out.text("\n");
  }
  out.finish();
  file.commit();
}

}  // namespace kiln
