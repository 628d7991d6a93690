// What a job warns of where a format stores the values of a map too coarsely, or not at all.
#include <filesystem>
#include <string>

#include "job/job_scene.h"

namespace kiln::test {
namespace {

/// The map "position" of a square, in so many units of width.
Job position_job(float width) {
  Job job;
  for (const float height : {0.02F, 0.0F}) {
    Mesh square = square_at(0, height, "m");
    for (Vec3& p : square.positions) p = {width * p.x, width * p.y, width * p.z};
    if (height == 0) {
      job.low = JobLow(square);
    } else {
      job.high = {JobInput(square, "high")};
    }
  }
  job.out = (scratch_folder() / "maps").string();
  job.bake.width = job.bake.height = 32;
  job.bake.maps = {MapKind{"position"}};
  job.bake.match.max_distance = Length::absolute(0.1 * width);
  return job;
}

/// The messages of a run's warnings with this code.
std::string warning_of(const Job& job, const std::string& code) {
  check(job);
  std::string text;
  for (const Warning& warning : run_job([] { return *device(); }, job, {}, {}).warnings) {
    if (warning.code == code) text += warning.message.text() + "\n";
  }
  return text;
}

/// A range of 16 units in 255 steps is coarser than texels of 1/32 unit, in 65,535 steps it is not.
TEST(StoredValues, StepsBeyondATexelAreTold) {
  KILN_REQUIRE_DEVICE();
  Job job = position_job(1);
  job.bake.encoding.ranges = {{MapKind{"position"}, {-8, 8}}};
  job.image.format = ImageFormat::png8;
  EXPECT_NE(warning_of(job, "map-steps")
                .find("is stored in steps of 0.0627, but its texels are 0.0312 apart"),
            std::string::npos)
      << warning_of(job, "map-steps");
  job.image.format = ImageFormat::png16;
  EXPECT_EQ(warning_of(job, "map-steps"), "");
  // 2 units in 255 steps, a quarter of a texel
  job.bake.encoding.ranges = {{MapKind{"position"}, {-1, 1}}};
  job.image.format = ImageFormat::png8;
  EXPECT_EQ(warning_of(job, "map-steps"), "");
}

/// Half precision becomes infinite from 65520 on, and has fewer bits below 2^-14.
TEST(StoredValues, EndsOfHalfPrecisionAreTold) {
  KILN_REQUIRE_DEVICE();
  Job job = position_job(1);
  job.image.format = ImageFormat::exr_half;
  for (const double far : {65518.0, 65521.0}) {
    job.bake.encoding.origin = std::array<double, 3>{-far, 0, 0};
    EXPECT_EQ(warning_of(job, "map-overflow").empty(), far < 65519.5) << far;
  }
  for (const float width : {1.0e-4F, 1.5e-4F}) {
    job = position_job(width);
    job.image.format = ImageFormat::exr_half;
    const std::string steps = warning_of(job, "map-steps");
    EXPECT_EQ(steps.empty(), width > 1.3e-4F) << steps;
  }
}

}  // namespace
}  // namespace kiln::test
