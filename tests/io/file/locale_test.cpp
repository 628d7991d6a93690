// Files are the same in programs that take their user's locale, as those with windows do: decimal commas, dots between
// thousands, other capitals.
#include <gtest/gtest.h>

#include <algorithm>
#include <clocale>
#include <cstdlib>
#include <filesystem>
#include <locale>
#include <string>
#include <vector>

#include "base/formatted.h"
#include "base/percent.h"
#include "kiln/asset.h"
#include "kiln/image.h"
#include "kiln/mesh.h"
#include "kiln/simplify.h"
#include "kiln/volume.h"
#include "support/environment.h"
#include "support/process.h"
#include "support/read_file.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

/// The program's locale; the classic one comes back.
class Locale {
 public:
  explicit Locale(const std::string& name) {
    if (std::setlocale(LC_ALL, name.c_str()) != nullptr) std::locale::global(std::locale(name));
  }
  ~Locale() {
    std::locale::global(std::locale::classic());
    std::setlocale(LC_ALL, "C");
  }
  Locale(const Locale&) = delete;
  Locale& operator=(const Locale&) = delete;
};

/// All that is read of files, all bytes that are written, and a message, in a list. Nothing here goes by the locale.
std::vector<std::string> all_files(const fs::path& out) {
  std::vector<std::string> found;
  const auto keep = [&found](const auto& values) {
    using Value = typename std::decay_t<decltype(values)>::value_type;
    found.emplace_back(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value));
  };
  const auto keep_mesh = [&](const fs::path& file) {
    const Mesh mesh = load_mesh(file);
    keep(mesh.positions);
    keep(mesh.triangles);
    keep(mesh.normals);
    keep(mesh.uvs);
    keep(mesh.colors);
  };
  std::vector<fs::path> meshes;
  for (const auto& entry : fs::directory_iterator(test::test_data("mesh")))
    meshes.push_back(entry.path());
  for (const char* name : {"FBX/box.fbx", "FBX/embedded_ascii/box.FBX"}) {
    if (const auto path = test::shared_data(std::string("assets/") + name)) meshes.push_back(*path);
  }
  std::sort(meshes.begin(), meshes.end());
  for (const fs::path& file : meshes) keep_mesh(file);
  std::vector<fs::path> volumes;
  for (const auto& entry : fs::directory_iterator(test::test_data("volume"))) {
    if (is_volume_name(entry.path())) volumes.push_back(entry.path());
  }
  std::sort(volumes.begin(), volumes.end());
  for (const fs::path& file : volumes) {
    const Volume volume = load_volume(file);
    keep(volume.origin);
    save_nrrd(volume, out / "a.nrrd");
    found.push_back(test::read_file(out / "a.nrrd"));
  }
  Mesh low = test::plane(3, 3);
  low.name = "TITLE I";
  low.origin = {1234567.25, -0.1, 1e-7};
  save_obj(low, out / "a.obj");
  found.push_back(test::read_file(out / "a.obj"));
  keep_mesh(out / "a.obj");
  const Image image = {4, 4, 3, std::vector<float>(48, 0.25F)};
  save_glb(low, {.color = &image}, out / "a.glb");
  found.push_back(test::read_file(out / "a.glb"));
  keep_mesh(out / "a.glb");
  for (const auto format : {ImageFormat::png16, ImageFormat::exr_half, ImageFormat::dds}) {
    SaveImageOptions options;
    options.format = format;
    options.origin = {1234567.25, -0.1, 1e-7};
    const fs::path file = out / ("I" + std::string(extension_of(format)));
    save_image(image, file, options);
    found.push_back(test::read_file(file));
    if (format != ImageFormat::dds) keep(load_image(file).pixels);
  }
  try {
    simplify(low, {.max_error = -0.5});
  } catch (const Error& error) {
    found.emplace_back(error.what());
  }
  found.push_back(percent(0.125) + formatted("%.1f%s", 2.5, ""));
  EXPECT_EQ(found.back(), "12.5%2.5");
  EXPECT_NE(found[found.size() - 2].find("-0.5"), std::string::npos);
  return found;
}

TEST(Locale, FilesAreTheSameInAll) {
  if (test::found_program("localedef").empty()) GTEST_SKIP() << "There is no localedef.";
  const fs::path folder = test::scratch_folder();
  const std::vector<std::string> plain = all_files(folder);
  ASSERT_EQ(setenv("LOCPATH", folder.c_str(), 1), 0);
  for (const std::string name : {"de_DE", "tr_TR"}) {
    SCOPED_TRACE(name);
    const std::string utf8 = name + ".utf8";
    // It wants a standard input.
    const auto made =
        test::run_process({"/bin/sh", "-c", "localedef -i $0 -f UTF-8 \"$1\" </dev/null", name,
                           (folder / utf8).string()});
    if (made.exit_code != 0) GTEST_SKIP() << "No package 'locales'? " << made.errors;
    const Locale locale(utf8);
    ASSERT_EQ(std::setlocale(LC_ALL, nullptr), utf8);
    EXPECT_EQ(all_files(folder), plain);
  }
}

}  // namespace
}  // namespace kiln
