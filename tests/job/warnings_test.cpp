// Counts of a job's warnings: each is the number of what was planted, and the number that its message states.
#include <cctype>
#include <functional>
#include <limits>
#include <optional>

#include "job/job_scene.h"

namespace kiln::test {
namespace {

/// Expects that counts are those that messages state: a count above one stands in the message, unless that states a
/// share, and a number at the start of the message is the count.
void expect_counts_stated(const std::vector<Warning>& warnings) {
  for (const Warning& warning : warnings) {
    const std::string text = warning.message.text();
    const auto is_digit = [&](std::size_t i) {
      return i < text.size() && std::isdigit(static_cast<unsigned char>(text[i])) != 0;
    };
    std::string message;  // without the commas of large numbers
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (text[i] == ',' && i > 0 && is_digit(i - 1) && is_digit(i + 1)) continue;
      message += text[i];
    }
    if (warning.count > 1 && message.find("% of") == std::string::npos) {  // else a share is stated
      EXPECT_NE(message.find(std::to_string(warning.count)), std::string::npos)
          << warning.code << ": " << warning.count << " is not in: " << message;
    }
    const std::size_t digits = message.find_first_not_of("0123456789");
    if (digits != 0 && digits != std::string::npos && message[digits] == ' ') {
      EXPECT_EQ(message.substr(0, digits), std::to_string(warning.count))
          << warning.code << ": " << message;
    }
  }
}

struct Scene {
  Asset high;
  Mesh low;
  Job job;
};

/// A square of 32 triangles over another, without any flaw.
Scene plain_scene() {
  Scene scene;
  scene.high.mesh = square_at(0, 0.01F, "h");
  scene.low = square_at(0, 0, "l");
  scene.job.out = "maps";
  scene.job.bake.width = scene.job.bake.height = 32;
  scene.job.bake.maps = {MapKind::normal};
  scene.job.bake.match.max_distance = Length::absolute(0.1);
  return scene;
}

struct Flaw {
  const char* code;
  std::function<void(Scene&, std::size_t)> plant;  ///< Plants so many of the flaw
};

const std::vector<Flaw>& flaws() {
  static const std::vector<Flaw> kFlaws = {
      {"set-without-uvs",
       [](Scene& scene, std::size_t count) {
         // Materials of one triangle each, without area in UV space; and a material of no triangle, which is none.
         scene.job.sets = SetsBy::material;
         scene.low.material_names = {"l", "unused"};
         scene.low.uvs.push_back({0.5F, 0.5F});
         const auto point = static_cast<std::uint32_t>(scene.low.uvs.size() - 1);
         for (std::size_t i = 0; i < count; ++i) {
           scene.low.material_names.push_back("bare " + std::to_string(i));
           scene.low.materials[i] = static_cast<std::uint32_t>(i + 2);
           scene.low.uv_triangles[i] = {point, point, point};
         }
       }},
      {"uv-degenerate",
       [](Scene& scene, std::size_t count) {
         for (std::size_t i = 0; i < count; ++i) {
           Triangle& t = scene.low.uv_triangles[2 * i];
           t = {t[0], t[0], t[0]};
         }
       }},
      {"uv-outside",
       [](Scene& scene, std::size_t count) {
         scene.job.sets = SetsBy::none;
         const auto first = static_cast<std::uint32_t>(scene.low.uvs.size());
         scene.low.uvs.insert(scene.low.uvs.end(), {{1.5F, 0.1F}, {1.75F, 0.1F}, {1.5F, 0.4F}});
         for (std::size_t i = 0; i < count; ++i) {
           for (Vec2 uv : {Vec2{1.5F, 0.1F}, Vec2{1.75F, 0.1F}, Vec2{1.5F, 0.4F}}) {
             uv.y += 0.15F * static_cast<float>(i);
             scene.low.uvs.push_back(uv);
           }
           const auto at = static_cast<std::uint32_t>(first + 3 * (i + 1));
           scene.low.uv_triangles[2 * i] = {at, at + 1, at + 2};
         }
       }},
      {"low-degenerate",
       [](Scene& scene, std::size_t count) {
         for (std::size_t i = 0; i < count; ++i) {
           Triangle& t = scene.low.triangles[2 * i];
           t = {t[0], t[0], t[1]};
         }
       }},
      {"source-skipped",
       [](Scene& scene, std::size_t count) {
         for (std::size_t i = 0; i < count; ++i) {
           Triangle& t = scene.high.mesh.triangles[2 * i];
           t = {t[0], t[0], t[1]};
         }
       }},
      {"duplicate-triangles",
       [](Scene& scene, std::size_t count) {
         Mesh& high = scene.high.mesh;
         for (std::size_t i = 0; i < count; ++i) {
           high.triangles.push_back(high.triangles[i]);
           if (!high.uv_triangles.empty()) high.uv_triangles.push_back(high.uv_triangles[i]);
           if (!high.normal_triangles.empty()) {
             high.normal_triangles.push_back(high.normal_triangles[i]);
           }
           high.materials.push_back(0);
         }
       }},
  };
  return kFlaws;
}

TEST(JobWarnings, CountWhatIsThere) {
  KILN_REQUIRE_DEVICE();
  for (const Flaw& flaw : flaws()) {
    for (const std::size_t count : {0U, 1U, 2U, 3U}) {
      SCOPED_TRACE(std::string(flaw.code) + " " + std::to_string(count));
      Scene scene = plain_scene();
      if (count != 0) flaw.plant(scene, count);
      Job job = scene.job;
      job.high = {JobInput(scene.high, "high")};
      job.low = JobLow(scene.low);
      const JobResult result = run_in_memory(job);
      expect_counts_stated(result.warnings);
      std::uint64_t found = 0, times = 0;
      for (const Warning& warning : result.warnings) {
        if (warning.code != flaw.code) continue;
        found = warning.count;
        ++times;
      }
      EXPECT_EQ(found, count);
      EXPECT_EQ(times, count == 0 ? 0U : 1U);
    }
  }
}

/// A scene without a flaw has no warning, whatever its sets are.
TEST(JobWarnings, OfSoundScenesAreNone) {
  KILN_REQUIRE_DEVICE();
  for (const std::optional<SetsBy> sets :
       {std::optional<SetsBy>(), std::optional(SetsBy::none), std::optional(SetsBy::material)}) {
    for (const bool is_asset : {false, true}) {
      Scene scene = plain_scene();
      scene.low = join_meshes(std::vector<Mesh>{scene.low, square_at(4, 0, "other")});
      if (sets != SetsBy::material) {
        for (std::size_t i = 0; i < scene.low.uvs.size(); ++i) {
          Vec2& uv = scene.low.uvs[i];
          uv.x = (uv.x + (i < scene.low.uvs.size() / 2 ? 0.0F : 1.0F)) / 2;
        }
      }
      scene.high.mesh = join_meshes(std::vector<Mesh>{scene.high.mesh, square_at(4, 0.01F, "h")});
      Job job = scene.job;
      job.sets = sets;
      job.high = {JobInput(scene.high.mesh, "high")};
      job.low = JobLow(scene.low);
      if (is_asset) job.out = "a.glb";
      for (const Warning& warning : run_in_memory(job).warnings) {
        if (is_asset && warning.code == "double-sided") continue;  // an open sheet in a GLB
        ADD_FAILURE() << warning.code << ": " << warning.message.text();
      }
    }
  }
}

/// Texels beyond a given range are counted, of each map by itself.
TEST(JobWarnings, CountTexelsBeyondTheRange) {
  KILN_REQUIRE_DEVICE();
  for (const std::size_t columns : {0U, 1U, 4U}) {
    // HIGH is 0.01 above LOW, and 0.05 over the first of 4 columns of its cells, 8 texels wide each.
    Scene scene = plain_scene();
    Mesh& high = scene.high.mesh;
    std::vector<Mesh> strips;
    for (std::size_t i = 0; i < 4; ++i) {
      strips.push_back(square_at(0.25F * static_cast<float>(i) - 0.375F,
                                 i < columns ? 0.05F : 0.01F, "h", 0.25F));
    }
    high = join_meshes(strips);
    Job job = scene.job;
    job.high = {JobInput(scene.high, "high")};
    job.low = JobLow(scene.low);
    job.bake.maps = {MapKind{"height"}, MapKind{"distance"}};
    job.ranges = {"height=-0.02,0.02", "distance=0,1"};
    const JobResult result = run_in_memory(job);
    expect_counts_stated(result.warnings);
    std::vector<std::uint64_t> counts;
    for (const Warning& warning : result.warnings) {
      if (warning.code == "beyond-range") counts.push_back(warning.count);
    }
    EXPECT_EQ(counts, columns == 0 ? std::vector<std::uint64_t>()
                                   : std::vector<std::uint64_t>{8 * 32 * columns});
  }
}

/// The vertices of HIGH whose alpha nothing uses are counted, and no others.
TEST(JobWarnings, CountVerticesOfUnusedAlpha) {
  KILN_REQUIRE_DEVICE();
  for (const std::size_t count : {0U, 1U, 4U}) {
    Scene scene = plain_scene();
    scene.high.mesh.colors.assign(scene.high.mesh.positions.size(), {9, 8, 7, 255});
    for (std::size_t i = 0; i < count; ++i) scene.high.mesh.colors[3 * i][3] = 254;
    Job job;
    job.bake.width = job.bake.height = 16;
    job.out = "a.glb";
    job.high = {JobInput(scene.high, "high")};
    job.low = JobLow(scene.low);
    std::uint64_t found = 0;
    for (const Warning& warning : run_in_memory(job).warnings) {
      if (warning.code == "opacity-left-out") found = warning.count;
    }
    EXPECT_EQ(found, count);
  }
}

}  // namespace
}  // namespace kiln::test
