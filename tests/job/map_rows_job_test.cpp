// Maps that a job writes while it bakes them: the files are those of maps that are baked and then written.
#include <filesystem>
#include <iterator>
#include <map>
#include <string>

#include "job/job_scene.h"
#include "kiln/options.h"
#include "support/read_file.h"

namespace kiln::test {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

/// A leaning, coloured square over another one.
Job job_of(const fs::path& folder) {
  Mesh high = square_at(0, 0.02F, "h", 0.8F);
  for (Vec3& p : high.positions)
    p.z += 0.06F + 0.1F * p.x * p.x - 0.1F * p.y;  // highest in late rows
  high.normals.clear();
  high.normal_triangles.clear();
  for (std::size_t i = 0; i < high.positions.size(); ++i) {
    high.colors.push_back({static_cast<std::uint8_t>(100 * (i % 3)), 64, 255, 255});
  }
  Job job;
  job.high = {JobInput(high, "high")};
  job.low = JobLow(square_at(0, 0, "l"));
  job.out = folder.string();
  job.bake.width = 96;
  job.bake.height = 80;
  job.bake.samples = 16;  // Two bands
  job.bake.maps = {MapKind::normal, MapKind{"position"}, MapKind{"height"}, MapKind{"vertex_color"},
                   MapKind::mask};
  job.bake.match.max_distance = Length::absolute(0.5);
  // A range that some heights exceed
  job.bake.encoding.ranges = {{MapKind{"height"}, {0, 0.04F}}};
  job.bake.encoding.origin = std::array<double, 3>{1, 2.5, -3};
  return job;
}

/// What a run wrote and said: files by name, warnings, and the parts of the report about maps.
struct Written {
  std::map<std::string, std::string> files;
  std::string warnings, report;
};

/// \param at_once  true: a hook that takes part in the bake's result, so that no map is written during the bake
Written run_to(Job job, bool at_once) {
  const fs::path folder = job.out;
  fs::remove_all(folder);
  RunHooks hooks;
  if (at_once) hooks.on_baked = [](BakedJob&) {};
  check(job);
  const JobResult result = run_job([] { return *device(); }, job, {}, hooks);
  Written written;
  for (const std::string& file : result.files) {
    written.files[fs::path(file).filename().string()] = read_file(file);
  }
  for (const Warning& warning : result.warnings) {
    written.warnings += warning.code + ": " + warning.message.text() + "\n";
  }
  const json report = json::parse(result.report);
  for (const char* key : {"files", "ranges", "stored_errors", "origin", "texels"}) {
    if (report.contains(key)) written.report += report[key].dump() + "\n";
  }
  return written;
}

TEST(JobMapRows, FilesWarningsAndReportAreTheSame) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = scratch_folder() / "maps";
  for (const ImageFormat format : {ImageFormat::png16, ImageFormat::png8, ImageFormat::exr_half,
                                   ImageFormat::exr_float, ImageFormat::tga}) {
    Job job = job_of(folder);
    job.image.format = format;
    if (format == ImageFormat::png8) set_option(job, "dither", "on");
    const Written rows = run_to(job, false), whole = run_to(job, true);
    EXPECT_EQ(rows.files.size(), 5U);
    for (const auto& [name, bytes] : whole.files) {
      ASSERT_TRUE(rows.files.contains(name)) << name;
      EXPECT_TRUE(rows.files.at(name) == bytes) << name;
    }
    EXPECT_EQ(rows.warnings, whole.warnings);
    EXPECT_EQ(rows.report, whole.report);
    const bool is_exr = format == ImageFormat::exr_half || format == ImageFormat::exr_float;
    EXPECT_EQ(rows.warnings.find("beyond-range") == std::string::npos, is_exr) << rows.warnings;
    EXPECT_EQ(rows.report.find("\"mean\"") != std::string::npos,
              format == ImageFormat::png8 || format == ImageFormat::tga);
  }
}

/// Mip chains and layers need whole images: they are as with any other job.
TEST(JobMapRows, WhatNeedsWholeImagesIsTheSame) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = scratch_folder() / "maps";
  for (const bool mips : {true, false}) {
    Job job = job_of(folder);
    job.bake.samples = 1;
    job.image.format = ImageFormat::exr_half;
    job.bake.encoding.mips = mips;
    job.layers = !mips;
    const Written rows = run_to(job, false), whole = run_to(job, true);
    EXPECT_GT(whole.files.size(), 0U);
    EXPECT_TRUE(rows.files == whole.files) << mips;
    EXPECT_EQ(rows.report, whole.report);
    job.bake.encoding.mips = job.layers = false;
    EXPECT_FALSE(run_to(job, false).files == whole.files) << mips;
  }
}

/// Maps that are baked for others alone are not written.
TEST(JobMapRows, MapsThatAreNotWrittenAreNoFiles) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = scratch_folder() / "maps";
  Job job = job_of(folder);
  job.bake.samples = 1;
  RunHooks hooks;
  hooks.not_written = {"position", "mask"};
  check(job);
  run_job([] { return *device(); }, job, {}, hooks);
  for (const char* map : {"normal", "height", "vertex_color", "position", "mask"}) {
    bool found = false;
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string stem = entry.path().stem().string();
      found = found || stem.ends_with(std::string("_") + map);
    }
    EXPECT_EQ(found, !hooks.not_written.contains(map)) << map;
  }
}

/// Values that half precision cannot hold are found row by row, too.
TEST(JobMapRows, WarnsOfOverflow) {
  KILN_REQUIRE_DEVICE();
  Job job = job_of(scratch_folder() / "maps");
  job.image.format = ImageFormat::exr_half;
  for (const bool at_once : {false, true}) {
    job.bake.encoding.ranges.clear();
    job.bake.encoding.origin = std::array<double, 3>{1e6, 0, 0};
    const Written written = run_to(job, at_once);
    EXPECT_NE(written.warnings.find("map-overflow"), std::string::npos) << written.warnings;
  }
}

/// A bake that fails or is cancelled after its first rows leaves no file.
TEST(JobMapRows, FailuresLeaveNoFile) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = scratch_folder() / "maps";
  Job job = job_of(folder);
  job.bake.width = job.bake.height = 512;
  job.bake.samples = 4;  // Four bands
  int bakes = 0;
  const Progress cancel_late = [&](double, std::string_view stage) {
    return stage != "baking" || ++bakes < 3;
  };
  EXPECT_TRUE(run_job([] { return *device(); }, job, cancel_late, {}).cancelled);
  EXPECT_GE(bakes, 3);
  EXPECT_TRUE(!fs::exists(folder) || fs::is_empty(folder));
  // No sample of this bake finds a point
  job.bake.match.max_distance = Length::absolute(1e-6);
  EXPECT_THROW(run_job([] { return *device(); }, job, {}, {}), Error);
  EXPECT_TRUE(!fs::exists(folder) || fs::is_empty(folder));
}

}  // namespace
}  // namespace kiln::test
