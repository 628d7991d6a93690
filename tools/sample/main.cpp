// kiln_sample: writes a dense mesh made by formula, to try Kiln and to measure it on.
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/error.h"
#include "kiln/mesh.h"
#include "scenes.h"

namespace {

constexpr std::string_view usage =
    "Usage: kiln_sample --out FILE [--shape urn|rock] [--faces N]\n"
    "\n"
    "Writes a dense closed mesh with detail worth baking. The same options give the same file.\n"
    "\n"
    "  --out FILE     binary .ply\n"
    "  --shape NAME   urn (default): carved stone; rock: a weathered boulder\n"
    "  --faces N      about how many triangles, 1000 to 20000000 (default 500000)\n"
    "  --help         this text\n";

struct Options {
  std::filesystem::path out;
  std::string shape = "urn";
  std::uint64_t faces = 500000;
};

[[noreturn]] void fail_usage(const std::string& message) {
  throw kiln::Error(kiln::ErrorCode::usage, message + "; see kiln_sample --help");
}

Options parse(const std::vector<std::string>& arguments) {
  Options options;
  for (std::size_t i = 0; i < arguments.size(); i += 2) {
    const std::string& name = arguments[i];
    if (name != "--out" && name != "--shape" && name != "--faces") {
      fail_usage("unknown option '" + name + "'");
    }
    if (i + 1 == arguments.size()) fail_usage(name + " needs a value");
    const std::string& value = arguments[i + 1];
    if (name == "--out") {
      options.out = value;
    } else if (name == "--shape") {
      if (value != "urn" && value != "rock")
        fail_usage("--shape is '" + value + "', not urn or rock");
      options.shape = value;
    } else {
      const char* end = value.data() + value.size();
      const auto [stop, error] = std::from_chars(value.data(), end, options.faces);
      if (error != std::errc{} || stop != end || options.faces < 1000 || options.faces > 20000000) {
        fail_usage("--faces is '" + value + "', not a number from 1000 to 20000000");
      }
    }
  }
  if (options.out.extension() != ".ply") fail_usage("--out must name a file that ends in .ply");
  return options;
}

void write_ply(const kiln::Mesh& mesh, const std::filesystem::path& path) {
  static_assert(std::endian::native == std::endian::little && sizeof(kiln::Vec3) == 12);
  std::ofstream file(path, std::ios::binary);
  file << "ply\nformat binary_little_endian 1.0\nelement vertex " << mesh.positions.size()
       << "\nproperty float x\nproperty float y\nproperty float z\nelement face "
       << mesh.triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  file.write(reinterpret_cast<const char*>(mesh.positions.data()),
             static_cast<std::streamsize>(mesh.positions.size() * sizeof(kiln::Vec3)));
  constexpr std::size_t face_bytes = 13;
  std::vector<char> faces(mesh.triangles.size() * face_bytes);
  char* at = faces.data();
  for (const kiln::Triangle& triangle : mesh.triangles) {
    *at = 3;
    std::memcpy(at + 1, triangle.data(), face_bytes - 1);
    at += face_bytes;
  }
  file.write(faces.data(), static_cast<std::streamsize>(faces.size()));
  file.close();
  if (!file) {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
    throw kiln::Error(kiln::ErrorCode::output, "cannot write '" + path.string() +
                                                   "'; does the folder exist, and is there room?");
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    for (const std::string& argument : arguments) {
      if (argument == "--help" || argument == "-h") {
        std::fwrite(usage.data(), 1, usage.size(), stdout);
        return 0;
      }
    }
    const Options options = parse(arguments);
    const kiln::Mesh mesh = options.shape == "urn" ? kiln::sample::urn(options.faces)
                                                   : kiln::sample::rock(options.faces);
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
