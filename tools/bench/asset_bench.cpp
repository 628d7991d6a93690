// Times reading a GLB with a million faces and four pictures, compared with reading the same mesh as PLY and the four
// picture files. Also measures processor seconds and bytes of output formats.
//
// asset_bench [FACES [SIZE]]   default: 1000000 4096
//
// A GLB's pictures are decoded on demand: the line "GLB" is the time of load_asset() and of decoding all four pictures.
// Processor seconds are those of all threads, medians.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "kiln/asset.h"
#include "kiln/files.h"
#include "kiln/image.h"
#include "support.h"

namespace kiln::bench {
namespace {

namespace fs = std::filesystem;

/// Makes a picture of waves with some noise, which compresses moderately well.
Image picture(std::uint32_t size, std::uint32_t channels, double phase) {
  Image image{size, size, channels, {}};
  image.pixels.reserve(std::size_t{size} * size * channels);
  std::uint32_t noise = 1;
  for (std::uint32_t y = 0; y < size; ++y) {
    for (std::uint32_t x = 0; x < size; ++x) {
      for (std::uint32_t c = 0; c < channels; ++c) {
        noise = noise * 1664525U + 1013904223U;
        const double wave = std::sin(0.01 * x + phase + c) * std::cos(0.013 * y);
        image.pixels.push_back(
            static_cast<float>(0.5 + 0.4 * wave + 0.03 * static_cast<double>(noise >> 24U) / 255));
      }
    }
  }
  return image;
}

/// Writes a binary PLY with a face list, the form that scanners write.
void save_ply(const Mesh& mesh, const fs::path& path) {
  std::string text = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                     std::to_string(mesh.positions.size()) +
                     "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                     std::to_string(mesh.triangles.size()) +
                     "\nproperty list uchar uint vertex_indices\nend_header\n";
  text.append(reinterpret_cast<const char*>(mesh.positions.data()), mesh.positions.size() * 12);
  for (const Triangle& t : mesh.triangles) {
    text += '\3';
    text.append(reinterpret_cast<const char*>(&t), 12);
  }
  save_text(path, text);
}

double cpu_of(const Mode& mode) { return Mode::median_of(mode.cpu_seconds); }

void print(const std::string& what, const Mode& mode, std::uintmax_t bytes) {
  JsonLine line;
  line.add("bench", "asset").add("what", what).add("name", mode.name);
  line.add("cpu_s", cpu_of(mode)).add("s", mode.median());
  line.add("bytes", static_cast<double>(bytes)).print();
}

void check(bool is, const char* what) {
  if (is) return;
  std::fprintf(stderr, "asset_bench: %s\n", what);
  std::exit(1);
}

void run(std::size_t faces, std::uint32_t size) {
  const fs::path folder = fs::temp_directory_path() / ("asset_bench." + std::to_string(faces));
  fs::create_directories(folder);
  const Mesh mesh = procedural_sphere(faces, 0.02F, true);
  const Image color = picture(size, 3, 0), normal = picture(size, 3, 1), grey = picture(size, 1, 2);
  AssetMaps maps;
  maps.color = maps.emission = &color;
  maps.normal = &normal;
  maps.occlusion = maps.roughness = maps.metallic = &grey;
  AssetMaterial material;
  material.pictures = std::make_shared<const AssetPictures>(encode_maps(maps));
  const auto file = [&](const char* name) { return folder / name; };
  const std::vector<fs::path> text = save_asset(mesh, std::span(&material, 1), file("a.gltf"));
  save_asset(mesh, std::span(&material, 1), file("a.glb"));
  save_ply(mesh, file("a.ply"));
  save_obj(mesh, file("a.obj"));

  const auto decode_all = [](const Asset& asset) {
    for (const auto& map : {&Material::color_map, &Material::roughness_map, &Material::normal_map,
                            &Material::emission_map}) {
      const MaterialPicture& at = asset.materials.at(0).*map;
      check((at.bytes ? load_image(*at.bytes) : load_image(at.file)).width != 0, "no picture");
    }
  };
  const Asset known = load_asset(file("a.glb"));
  check(known.mesh.triangles.size() == mesh.triangles.size(), "faces were lost");
  std::vector<Mode> modes;
  modes.push_back({"PLY", false, [&] { load_mesh(file("a.ply")); }});
  modes.push_back({"4 pictures", false, [&] { decode_all(known); }});
  modes.push_back({"GLB", false, [&] { decode_all(load_asset(file("a.glb"))); }});
  modes.push_back({"glTF", false, [&] { decode_all(load_asset(file("a.gltf"))); }});
  modes.push_back({"OBJ", false, [&] { load_mesh(file("a.obj")); }});
  run_rounds(modes, 5);
  std::uintmax_t text_bytes = 0;
  for (const fs::path& path : text) text_bytes += fs::file_size(path);
  const std::uintmax_t bytes[] = {
      fs::file_size(file("a.ply")),
      material.pictures->color.size() + material.pictures->surface.size() +
          material.pictures->normal.size() + material.pictures->emission.size(),
      fs::file_size(file("a.glb")), text_bytes, fs::file_size(file("a.obj"))};
  for (std::size_t i = 0; i < modes.size(); ++i) print("read", modes[i], bytes[i]);
  JsonLine()
      .add("bench", "asset")
      .add("what", "GLB over PLY and pictures, processor seconds")
      .add("ratio", cpu_of(modes[2]) / (cpu_of(modes[0]) + cpu_of(modes[1])))
      .print();

  std::vector<Mode> written;
  std::vector<std::uintmax_t> sizes;
  for (const auto& [name, format] :
       {std::pair("PNG, 8 bits", ImageFormat::png8), std::pair("PNG, 16 bits", ImageFormat::png16),
        std::pair("WebP", ImageFormat::webp), std::pair("TGA", ImageFormat::tga),
        std::pair("KTX 2, BC5", ImageFormat::ktx2), std::pair("DDS, BC5", ImageFormat::dds)}) {
    SaveImageOptions options = {format};
    options.use = TextureUse::tangent_normal;
    sizes.push_back(encode(normal, options).size());
    written.push_back({name, false, [&normal, options] { encode(normal, options); }});
  }
  run_rounds(written, 3);
  for (std::size_t i = 0; i < written.size(); ++i) print("written", written[i], sizes[i]);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) {
  const auto number = [&](int at, int plain) { return argc > at ? std::atoi(argv[at]) : plain; };
  kiln::bench::run(static_cast<std::size_t>(number(1, 1000000)),
                   static_cast<std::uint32_t>(number(2, 4096)));
}
