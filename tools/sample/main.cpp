// kiln_sample: writes a generated high poly, volume or height field, for trying Kiln and for measurements.
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fields.h"
#include "hard_scenes.h"
#include "kiln/error.h"
#include "kiln/image.h"
#include "kiln/mesh.h"
#include "kiln/volume.h"
#include "scenes.h"

namespace {

constexpr std::string_view kUsage =
    "Usage: kiln_sample --out FILE [--shape urn|rock] [--faces N] [--colors stone]\n"
    "       kiln_sample --out FILE --volume sphere|torus|gyroid|boxes [--size N] [--type "
    "f32|u8|u16]\n"
    "       kiln_sample --out FILE --terrain N\n"
    "       kiln_sample --out HIGH.obj --low LOW.obj --scene NAME\n"
    "\n"
    "Writes a high poly that is worth baking, a volume, or a height field. The same\n"
    "options give the same file.\n"
    "\n"
    "  --out FILE     binary .ply; .nrrd for a volume; .png (16 bits) or .exr for a height field\n"
    "  --shape NAME   urn (default): carved stone; rock: a weathered boulder\n"
    "  --faces N      about how many triangles, 1000 to 200000000 (default 500000), or as 100M; "
    "with\n"
    "                 colours up to 20000000\n"
    "  --colors NAME  of the vertices: none (default), or stone\n"
    "  --volume NAME  a solid, with greater values inside than at its surface: a sphere, a torus,\n"
    "                 a gyroid sheet, or boxes with sharp edges\n"
    "  --size N       voxels along each axis, 8 to 2048 (default 128)\n"
    "  --type NAME    f32 (default): signed distance, the surface at 0; u8, u16: the distance "
    "clamped to\n"
    "                 4 voxels, the surface at 127.5 or 32767.5\n"
    "  --scene NAME   a hard surface and a low poly for it: cube, cylinder, bracket, bolt, pipe,\n"
    "                 assembly or leaf\n"
    "  --low FILE     where the scene's low poly goes, .obj with UVs and hard edges\n"
    "  --terrain N    heights of mountains and valleys, N x N pixels, 2 to 16384\n"
    "  --help         this text\n";

struct Options {
  std::filesystem::path out;
  std::string shape = "urn";
  std::uint64_t faces = 500000;
  bool painted = false;
  std::string volume;  ///< Name of the volume's field; empty: a mesh is written
  std::uint64_t size = 128;
  kiln::VoxelType type = kiln::VoxelType::f32;
  std::uint64_t terrain = 0;  ///< Pixels per side of the height field; 0: none is written
  std::string scene;          ///< Name of the hard-surface scene; empty: none
  std::filesystem::path low;
};

[[noreturn]] void fail_usage(const std::string& message) {
  throw kiln::Error(kiln::ErrorCode::usage, message + "; see kiln_sample --help");
}

std::uint64_t parse_number(const std::string& name, const std::string& value, std::uint64_t least,
                           std::uint64_t most) {
  std::uint64_t number = 0;
  const char* end = value.data() + value.size();
  const auto [stop, error] = std::from_chars(value.data(), end, number);
  if (error != std::errc{} || stop != end || number < least || number > most) {
    fail_usage(name + " is '" + value + "', not a number from " + std::to_string(least) + " to " +
               std::to_string(most));
  }
  return number;
}

void check_scene(const Options& options, bool others) {
  const auto names = kiln::sample::hard_scene_names();
  if (std::find(names.begin(), names.end(), options.scene) == names.end()) {
    fail_usage("--scene is '" + options.scene +
               "', not cube, cylinder, bracket, bolt, pipe, assembly or leaf");
  }
  if (others) fail_usage("--scene can only be combined with --out and --low");
  if (options.out.extension() != ".obj" || options.low.extension() != ".obj") {
    fail_usage("--scene needs --out and --low, two files that end in .obj");
  }
}

Options parse(const std::vector<std::string>& arguments) {
  Options options;
  // a given option that applies only to meshes, or only to volumes
  std::string for_mesh, for_volume;
  for (std::size_t i = 0; i < arguments.size(); i += 2) {
    const std::string& name = arguments[i];
    const bool mesh = name == "--shape" || name == "--faces" || name == "--colors";
    if (name == "--scene" || name == "--low") {
      if (i + 1 == arguments.size()) fail_usage(name + " needs a value");
      if (name == "--low") {
        options.low = arguments[i + 1];
      } else {
        options.scene = arguments[i + 1];
      }
      continue;
    }
    const bool volume = name == "--volume" || name == "--size" || name == "--type";
    if (!mesh && !volume && name != "--terrain" && name != "--out")
      fail_usage("unknown option '" + name + "'");
    if (mesh) for_mesh = name;
    if (volume) for_volume = name;
    if (i + 1 == arguments.size()) fail_usage(name + " needs a value");
    const std::string& value = arguments[i + 1];
    if (name == "--out") {
      options.out = value;
    } else if (name == "--shape") {
      if (value != "urn" && value != "rock")
        fail_usage("--shape is '" + value + "', not urn or rock");
      options.shape = value;
    } else if (name == "--colors") {
      if (value != "none" && value != "stone")
        fail_usage("--colors is '" + value + "', not none or stone");
      options.painted = value == "stone";
    } else if (name == "--faces") {
      const bool millions = value.ends_with('M');
      options.faces = millions
                          ? parse_number(name, value.substr(0, value.size() - 1), 1, 200) * 1000000
                          : parse_number(name, value, 1000, 200000000);
    } else if (name == "--volume") {
      if (!kiln::sample::field_of(value)) {
        fail_usage("--volume is '" + value + "', not sphere, torus, gyroid or boxes");
      }
      options.volume = value;
    } else if (name == "--terrain") {
      options.terrain = parse_number(name, value, 2, 16384);
    } else if (name == "--size") {
      options.size = parse_number(name, value, 8, 2048);
    } else {
      const auto type = kiln::voxel_type_of(value);
      if (value != "f32" && value != "u8" && value != "u16") {
        fail_usage("--type is '" + value + "', not f32, u8 or u16");
      }
      options.type = *type;
    }
  }
  if (!options.scene.empty() || !options.low.empty()) {
    check_scene(options, !for_mesh.empty() || !for_volume.empty() || options.terrain != 0);
    return options;
  }
  if (options.volume.empty() && !for_volume.empty()) fail_usage(for_volume + " needs --volume");
  if (!options.volume.empty() && !for_mesh.empty()) {
    fail_usage("--volume and " + for_mesh + " exclude each other");
  }
  if (options.terrain != 0) {
    const std::string& other = for_mesh.empty() ? for_volume : for_mesh;
    if (!other.empty()) fail_usage("--terrain and " + other + " exclude each other");
    if (options.out.extension() != ".png" && options.out.extension() != ".exr") {
      fail_usage("--out must name a file that ends in .png or .exr");
    }
    return options;
  }
  const std::string extension = options.volume.empty() ? ".ply" : ".nrrd";
  if (options.out.extension() != extension) {
    fail_usage("--out must name a file that ends in " + extension);
  }
  return options;
}

/// Writes a mesh to a PLY file while its pieces are being made.
class PlySink : public kiln::sample::MeshPieceSink {
 public:
  /// \param colors  true: the vertices get colours
  explicit PlySink(const std::filesystem::path& path, bool colors = false)
      : path_(path), file_(path, std::ios::binary), colors_(colors) {}

  void begin(std::uint64_t vertices, std::uint64_t triangles) override {
    static_assert(std::endian::native == std::endian::little && sizeof(kiln::Vec3) == 12);
    vertices_ = vertices;
    triangles_ = triangles;
    file_ << "ply\nformat binary_little_endian 1.0\nelement vertex " << vertices
          << "\nproperty float x\nproperty float y\nproperty float z\n"
          << (colors_ ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "")
          << "element face " << triangles
          << "\nproperty list uchar int vertex_indices\nend_header\n";
  }
  void add(std::span<const kiln::Vec3> positions) override {
    file_.write(reinterpret_cast<const char*>(positions.data()),
                static_cast<std::streamsize>(positions.size_bytes()));
  }
  void add(std::span<const kiln::Vec3> positions,
           std::span<const std::array<std::uint8_t, 4>> colors) {
    constexpr std::size_t kVertexBytes = 15;
    std::vector<char> vertices(positions.size() * kVertexBytes);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      std::memcpy(&vertices[i * kVertexBytes], &positions[i], sizeof(kiln::Vec3));
      std::memcpy(&vertices[i * kVertexBytes + sizeof(kiln::Vec3)], colors[i].data(), 3);
    }
    file_.write(vertices.data(), static_cast<std::streamsize>(vertices.size()));
  }
  void add(std::span<const kiln::Triangle> triangles) override {
    constexpr std::size_t kFaceBytes = 13;
    std::vector<char> faces(triangles.size() * kFaceBytes);
    char* at = faces.data();
    for (const kiln::Triangle& triangle : triangles) {
      *at = 3;
      std::memcpy(at + 1, triangle.data(), kFaceBytes - 1);
      at += kFaceBytes;
    }
    file_.write(faces.data(), static_cast<std::streamsize>(faces.size()));
  }
  void finish() {
    file_.close();
    if (file_) return;
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
    throw kiln::Error(kiln::ErrorCode::output, "cannot write '" + path_.string() +
                                                   "'; does the folder exist, and is there room?");
  }
  std::uint64_t vertices() const { return vertices_; }
  std::uint64_t triangles() const { return triangles_; }

 private:
  std::filesystem::path path_;
  std::ofstream file_;
  bool colors_;
  std::uint64_t vertices_ = 0, triangles_ = 0;
};

/// Writes a mesh with colours.
void write_ply(const kiln::Mesh& mesh, const std::filesystem::path& path) {
  PlySink sink(path, true);
  sink.begin(mesh.positions.size(), mesh.triangles.size());
  sink.add(mesh.positions, mesh.colors);
  sink.add(std::span<const kiln::Triangle>(mesh.triangles));
  sink.finish();
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    for (const std::string& argument : arguments) {
      if (argument == "--help" || argument == "-h") {
        std::fwrite(kUsage.data(), 1, kUsage.size(), stdout);
        return 0;
      }
    }
    const Options options = parse(arguments);
    if (!options.volume.empty()) {
      kiln::Volume volume =
          kiln::sample::sample_volume(*kiln::sample::field_of(options.volume),
                                      static_cast<std::uint32_t>(options.size), options.type);
      volume.name = options.volume;
      kiln::save_nrrd(volume, options.out);
      std::printf("%s: %u x %u x %u voxels, %s; the surface lies at %g\n",
                  options.out.string().c_str(), volume.size[0], volume.size[1], volume.size[2],
                  kiln::name_of(volume.type), kiln::sample::surface_value(volume.type));
      return 0;
    }
    if (!options.scene.empty()) {
      const kiln::sample::HardScene scene = kiln::sample::hard_scene(options.scene);
      kiln::save_obj(scene.high, options.out);
      kiln::save_obj(scene.low, options.low);
      std::printf("%s: %zu faces; %s: %zu faces\n", options.out.string().c_str(),
                  scene.high.triangles.size(), options.low.string().c_str(),
                  scene.low.triangles.size());
      return 0;
    }
    if (options.terrain != 0) {
      const auto size = static_cast<std::uint32_t>(options.terrain);
      kiln::SaveImageOptions save;
      save.format = options.out.extension() == ".png" ? kiln::ImageFormat::png16
                                                      : kiln::ImageFormat::exr_float;
      kiln::save_image(kiln::sample::terrain(size), options.out, save);
      std::printf("%s: %u x %u heights\n", options.out.string().c_str(), size, size);
      return 0;
    }
    if (!options.painted) {
      PlySink sink(options.out);
      if (options.shape == "urn") {
        kiln::sample::urn(options.faces, sink);
      } else {
        kiln::sample::rock(options.faces, sink);
      }
      sink.finish();
      std::printf("%s: %zu vertices, %zu faces\n", options.out.string().c_str(),
                  static_cast<std::size_t>(sink.vertices()),
                  static_cast<std::size_t>(sink.triangles()));
      return 0;
    }
    if (options.faces > 20000000) fail_usage("--colors supports at most 20000000 faces");
    kiln::Mesh mesh = options.shape == "urn" ? kiln::sample::urn(options.faces)
                                             : kiln::sample::rock(options.faces);
    kiln::sample::paint_stone(mesh);
    write_ply(mesh, options.out);
    std::printf("%s: %zu vertices, %zu faces\n", options.out.string().c_str(),
                mesh.positions.size(), mesh.triangles.size());
    return 0;
  } catch (const kiln::Error& error) {
    std::fprintf(stderr, "kiln_sample: %s\n", error.what());
    return static_cast<int>(error.code());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "kiln_sample: %s\n", error.what());
    return 1;
  }
}
