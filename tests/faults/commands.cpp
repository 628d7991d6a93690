#include "faults/commands.h"

#include <fstream>

#include "kiln/bake.h"
#include "kiln/image.h"
#include "kiln/render.h"
#include "kiln/simplify.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln::test {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

Words bake(const fs::path& in, const fs::path& out) {
  return {"bake",   in / "high.obj", in / "low.obj", "--size", "4",      "--recall",         "0",
          "--maps", "normal,mask",   "--out",        out,      "--json", out / "report.json"};
}

/// Other outputs of a bake: a low poly, a match, layers, channels of maps as one file.
Words bake_all(const fs::path& in, const fs::path& out) {
  return {"bake",
          in / "high.obj",
          "--faces",
          "60",
          "--size",
          "32",
          "--recall",
          "0",
          "--maps",
          "normal,height,id",
          "--out",
          out,
          "--format",
          "exr",
          "--layers",
          "--pack",
          "mix=height,0.5,id",
          "--save-match",
          out / "match.exr"};
}

/// A plan, of levels of detail.
Words levels(const fs::path& in, const fs::path& out) {
  return {"bake", in / "high.obj", "--max-error", "normal=5", "--screen", "64px", "--lod",
          "2",    "--size",        "64",          "--out",    out};
}

Words simplify(const fs::path& in, const fs::path& out) {
  return {"simplify", in / "high.obj", "--faces", "60", "--size", "64", "--out", out / "light.obj"};
}

Words render(const fs::path& in, const fs::path& out) {
  return {"render", in / "high.obj", "--size", "32", "--out", out / "picture.png"};
}

Words diff(const fs::path& in, const fs::path& out) {
  return {"diff", in / "a.png", in / "b.png", "--out", out / "picture.png"};
}

Words volume(const fs::path& in, const fs::path& out) {
  return {"volume", in / "ramp.mhd", "--iso", "60", "--size", "64", "--out", out};
}

Words devices(const fs::path&, const fs::path&) { return {"devices"}; }

/// Pictures, maps and a report.
Words gallery(const fs::path& in, const fs::path& out) {
  return {"gallery",
          in / "high.obj",
          in / "low.obj",
          "--size",
          "16",
          "--match",
          "ray",
          "--picture-size",
          "64",
          "--pixels",
          "16",
          "--out",
          out,
          "--json",
          out / "report.json"};
}

/// Textures, a mesh, data and a script to draw them.
Words measure(const fs::path& in, const fs::path& out) {
  return {"measure",
          in / "high.obj",
          in / "low.obj",
          "--match",
          "ray",
          "--size",
          "16",
          "--directions",
          "12",
          "--picture-size",
          "64",
          "--pixels",
          "16",
          "--out",
          out,
          "--json",
          out / "report.json"};
}

Words study(const fs::path& in, const fs::path& out) {
  return {"measure", in / "high.obj", "--study", "faces", "--size",
          "16",      "--pixels",      "16",      "--out", out};
}

Words chart(const fs::path& in, const fs::path& out) {
  return {"chart", in / "high.obj", in / "low.obj", "--settings", "ray", "--size", "16", "--repeat",
          "1",     "--directions",  "12",           "--pixels",   "16",  "--out",  out};
}

}  // namespace

const std::vector<FaultCommand>& fault_commands() {
  static const std::vector<FaultCommand> all = {
      {"bake", bake},
      {"simplify", simplify},
      {"render", render},
      {"diff", diff},
      {"volume", volume},
      {"devices", devices},
      {"gallery", gallery, Often::once},
      {"bake_kernels", bake, Often::never, true},
      {"bake_all", bake_all, Often::never},
      {"levels", levels, Often::never},
      {"measure", measure, Often::never},
      {"chart", chart, Often::never},
      {"study", study, Often::never},
  };
  return all;
}

fs::path fault_inputs() {
  const fs::path folder = scratch_folder();
  save_obj(BumpySphere::dense(500), folder / "high.obj");
  save_obj(BumpySphere::light(12, 6), folder / "low.obj");
  std::string voxels(4096, '\0');
  for (std::size_t i = 0; i < voxels.size(); ++i) voxels[i] = static_cast<char>(8 * (i % 16));
  std::ofstream(folder / "ramp.raw", std::ios::binary) << voxels;
  std::ofstream(folder / "ramp.mhd")
      << "ObjectType = Image\nNDims = 3\nDimSize = 16 16 16\nElementType = MET_UCHAR\n"
         "ElementDataFile = ramp.raw\n";
  Image image{16, 16, 3, std::vector<float>(768, 0.5F)};
  save_image(image, folder / "a.png", {.format = ImageFormat::png8});
  image.pixels[7] = 0.75F;
  save_image(image, folder / "b.png", {.format = ImageFormat::png8});
  return folder;
}

}  // namespace kiln::test
