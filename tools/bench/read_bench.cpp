// Processor seconds of reading files: PLYs, GLBs with four pictures of their materials, or pictures.
//
// read_bench ROUNDS FILE...   one JSON line a file, the least of the rounds
#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <string>

#include "kiln/kiln.h"

namespace kiln {
namespace {

/// \returns faces, or texels of a picture
std::size_t read(const std::string& file) {
  if (!file.ends_with(".glb") && !file.ends_with(".ply")) return load_image(file).pixels.size();
  const Asset asset = load_asset(file);
  if (!file.ends_with(".glb")) return asset.mesh.triangles.size();
  for (const MaterialSlot slot : {MaterialSlot::color, MaterialSlot::roughness,
                                  MaterialSlot::normal, MaterialSlot::emission}) {
    load_material_texture(asset.materials, slot);
  }
  return asset.mesh.triangles.size();
}

double cpu_seconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}  // of all threads

}  // namespace
}  // namespace kiln

int main(int count, char** arguments) {
  for (int i = 2; i < count; ++i) {
    double least = std::numeric_limits<double>::infinity();
    std::size_t size = 0;
    for (int round = 0; round < std::atoi(arguments[1]); ++round) {
      const double start = kiln::cpu_seconds();
      size = kiln::read(arguments[i]);
      least = std::min(least, kiln::cpu_seconds() - start);
    }
    std::printf("{\"file\":\"%s\",\"size\":%zu,\"cpu_s\":%.4f}\n", arguments[i], size, least);
  }
}
