// Nothing that is read is ever written over: every input of a command against every output of it.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "cli/call.h"
#include "kiln/mesh.h"
#include "support/environment.h"
#include "support/process.h"
#include "support/read_file.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::call_kiln;
using test::ProcessResult;
using Words = std::vector<std::string>;

std::map<std::string, std::string> all_files(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files[entry.path()] = test::read_file(entry.path());
  }
  return files;
}

/// A run that is refused, and leaves every file of the folder as it was.
void expect_nothing_lost(const fs::path& folder, const Words& words, const std::string& what) {
  const auto before = all_files(folder);
  const ProcessResult result = call_kiln(words);
  EXPECT_EQ(result.exit_code, 2) << what << ": " << result.errors;
  EXPECT_NE(result.errors.find("overwritten"), std::string::npos) << what << ": " << result.errors;
  EXPECT_TRUE(all_files(folder) == before) << what;
}

/// An OBJ, its low poly with a cage, a saved match and view weights.
fs::path make_scene() {
  const fs::path folder = test::scratch_folder();
  save_obj(test::BumpySphere::dense(2000), folder / "high.obj");
  save_obj(test::BumpySphere::light(), folder / "low.obj");
  std::ofstream(folder / "weights.txt") << "0 1 0 2\n0 -1 0 1\n";
  const ProcessResult saved =
      call_kiln({"bake", folder / "high.obj", folder / "low.obj", "--size", "16", "--out",
                 folder / "first", "--save-match", folder / "match.exr"});
  EXPECT_EQ(saved.exit_code, 0) << saved.errors;
  fs::remove_all(folder / "first");
  return folder;
}

TEST(Overwrite, EveryInputOfABakeAgainstEveryOutput) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = make_scene();
  const std::map<std::string, Words> inputs = {
      {"high.obj", {}},
      {"low.obj", {}},
      {"cage.obj", {"--cage-mesh", folder / "cage.obj"}},
      {"match.exr", {"--load-match", folder / "match.exr"}},
      {"weights.txt", {"--match", "visibility", "--view-weight", folder / "weights.txt"}}};
  fs::copy_file(folder / "low.obj", folder / "cage.obj");
  const fs::path out = folder / "out";
  const std::map<std::string, Words> outputs = {{"report", {"--json", out / "report"}},
                                                {"saved.exr", {"--save-match", out / "saved.exr"}},
                                                {"low_normal.png", {}},
                                                {"low_mask.png", {"--maps", "normal,mask"}},
                                                {"low_normal.mip02.png", {"--mips"}},
                                                {"low_normal.exr", {"--mips", "--format", "exr"}}};
  for (const auto& [input, reading] : inputs) {
    for (const auto& [output, writing] : outputs) {
      if (input == "match.exr" && output == "saved.exr") continue;  // one excludes the other
      // Another name of the same file: a path alone does not tell.
      fs::remove_all(out);
      fs::create_directory(out);
      fs::create_hard_link(folder / input, out / output);
      Words words = {"bake", folder / "high.obj", folder / "low.obj", "--size", "16", "--out", out};
      words.insert(words.end(), reading.begin(), reading.end());
      words.insert(words.end(), writing.begin(), writing.end());
      expect_nothing_lost(folder, words, input + " as " + output);
    }
  }
}

TEST(Overwrite, OtherCommands) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = make_scene();
  const fs::path high = folder / "high.obj", low = folder / "low.obj", same = folder / "same.json";
  fs::create_hard_link(high, same);
  expect_nothing_lost(folder, {"simplify", high, "--faces", "50", "--out", low, "--json", same},
                      "simplify");
  fs::create_hard_link(high, folder / "same.obj");
  expect_nothing_lost(folder, {"simplify", high, "--faces", "50", "--out", folder / "same.obj"},
                      "simplify");
  fs::create_hard_link(high, folder / "same.png");
  expect_nothing_lost(folder, {"render", high, "--out", folder / "same.png"}, "render");
  expect_nothing_lost(folder, {"measure", high, low, "--size", "16", "--json", same}, "measure");
}

// The voxels stand in a file that the header names.
TEST(Overwrite, AVolumesVoxels) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  std::string voxels(4096, '\0');
  for (std::size_t i = 0; i < voxels.size(); ++i) voxels[i] = static_cast<char>(8 * (i % 16));
  std::ofstream(folder / "ramp.raw", std::ios::binary) << voxels;
  std::ofstream(folder / "ramp.mhd")
      << "ObjectType = Image\nNDims = 3\nDimSize = 16 16 16\nElementType = MET_UCHAR\n"
         "ElementDataFile = ramp.raw\n";
  std::ofstream(folder / "ramp.nhdr") << "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 16 16 16\n"
                                         "encoding: raw\ndata file: ramp.raw\n";
  for (const char* header : {"ramp.mhd", "ramp.nhdr"}) {
    for (const char* report : {"ramp.raw", header}) {
      expect_nothing_lost(folder,
                          {"volume", folder / header, "--iso", "60", "--size", "64", "--out",
                           folder / "out", "--json", folder / report},
                          std::string(header) + " with " + report);
    }
  }
}

}  // namespace
}  // namespace kiln
