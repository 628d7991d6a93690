// Limits of the system and of --memory-limit: a documented exit code, one message, nothing left.
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include "base/memory.h"
#include "cl/context.h"
#include "kiln/bake.h"
#include "kiln/image.h"
#include "kiln/limits.h"
#include "kiln/unwrap.h"
#include "support/environment.h"
#include "support/process.h"
#include "support/read_file.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::ProcessResult;
using Words = std::vector<std::string>;

class Limits : public ::testing::Test {
 protected:
  void SetUp() override {
    KILN_REQUIRE_DEVICE();
    folder_ = test::scratch_folder();
    save_obj(test::BumpySphere::dense(2000), folder_ / "high.obj");
    save_obj(test::BumpySphere::light(12, 6), folder_ / "low.obj");
  }

  Words bake(const std::string& size, const fs::path& out) const {
    return {"bake", folder_ / "high.obj", folder_ / "low.obj", "--size", size, "--quiet", "--out",
            out};
  }

  /// A command under a limit of the shell's (`ulimit -v`, in KiB, and the like).
  static ProcessResult under(const std::string& limit, const Words& words) {
    Words all = {"/bin/sh", "-c", "ulimit " + limit + "; exec \"$0\" \"$@\"", test::kiln_command()};
    all.insert(all.end(), words.begin(), words.end());
    test::ProcessOptions options;
    options.timeout_seconds = 60;
    return test::run_process(all, options);
  }

  void expect_in_order(const ProcessResult& result, const fs::path& out, const std::string& what) {
    SCOPED_TRACE(what + ": " + result.errors);
    EXPECT_TRUE(std::set({0, 1, 3, 4, 5}).contains(result.exit_code)) << result.exit_code;
    EXPECT_EQ(result.exit_code == 0, fs::exists(out / "low_normal.png"));
    if (result.exit_code != 0) {
      EXPECT_NE(result.errors.find("kiln: "), std::string::npos);
      EXPECT_TRUE(!fs::exists(out) || fs::is_empty(out)) << "something was left";
    }
  }

  fs::path folder_;
};

TEST_F(Limits, OfMemoryAreObeyedByReadersAndStages) {
  const auto refused = [&](const Words& words, int code, const std::string& text) {
    Words all = words;
    all.insert(all.end(), {"--memory-limit", "150M"});
    const ProcessResult result = test::run_kiln(all);
    EXPECT_EQ(result.exit_code, code) << result.errors;
    EXPECT_NE(result.errors.find(text), std::string::npos) << result.errors;
    EXPECT_NE(result.errors.find("--memory-limit"), std::string::npos) << result.errors;
  };
  const ProcessResult small = test::run_kiln(bake("64", folder_ / "small"));
  EXPECT_EQ(small.exit_code, 0) << small.errors;
  refused(bake("8192", folder_ / "large"), 1, "The maps would take");
  EXPECT_FALSE(fs::exists(folder_ / "large"));
  // Readers say which file: one of 6 million faces in a few bytes each.
  {
    std::ofstream file(folder_ / "many.obj");
    file << "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (int i = 0; i < 6'000'000; ++i) file << "f 1 2 3\n";
  }
  Words words = bake("16", folder_ / "out");
  words[1] = folder_ / "many.obj";
  refused(words, 3, "many.obj");
  {
    std::ofstream file(folder_ / "large.raw", std::ios::binary);
    file.seekp((std::streamoff{400} << 20) - 1);
    file.put('\0');
  }
  std::ofstream(folder_ / "large.mhd")
      << "ObjectType = Image\nNDims = 3\nDimSize = 1024 1024 400\nElementType = MET_UCHAR\n"
         "ElementDataFile = large.raw\n";
  refused({"volume", folder_ / "large.mhd", "--iso", "1", "--out", folder_ / "out"}, 3,
          "large.mhd");
}

// Pictures are asked for before the first is drawn, all of them.
TEST_F(Limits, OfMemoryAreObeyedByPictures) {
  const std::string low = folder_ / "low.obj", high = folder_ / "high.obj";
  const auto render = [&](const Words& words, const std::string& limit) {
    Words all = {"render", low, "--out", folder_ / "picture.png", "--memory-limit", limit};
    all.insert(all.end(), words.begin(), words.end());
    return test::run_kiln(all);
  };
  for (const Words& words : std::vector<Words>{{"--size", "8192", "--samples", "3"},
                                               {"--size", "2048", "--views", "12"},
                                               {"--size", "4096", "--reference", high}}) {
    const ProcessResult result = render(words, "300M");
    EXPECT_EQ(result.exit_code, 1) << result.errors;
    EXPECT_NE(result.errors.find("icture"), std::string::npos) << result.errors;
    EXPECT_NE(result.errors.find("--memory-limit"), std::string::npos) << result.errors;
    EXPECT_FALSE(fs::exists(folder_ / "picture.png"));
  }
  EXPECT_EQ(render({"--size", "128", "--views", "12"}, "300M").exit_code, 0);
}

// A picture of a few KB may hold millions of triangles: it is refused before its mesh is built, as an input.
TEST_F(Limits, OfMemoryAreObeyedByHeightFields) {
  Image heights{1024, 1024, 1, {}};
  heights.pixels.assign(std::size_t{1024} * 1024, 0.5F);
  save_image(heights, folder_ / "field.png", {.format = ImageFormat::png16});
  const auto bake = [&](const std::string& limit) {
    return test::run_kiln({"bake", folder_ / "field.png", "--height", "1", "--extent", "4",
                           "--size", "64", "--quiet", "--memory-limit", limit, "--out",
                           folder_ / "out"});
  };
  const ProcessResult refused = bake("300M");
  EXPECT_EQ(refused.exit_code, 3) << refused.errors;
  for (const char* const word :
       {"field.png", "1024 x 1024", "would take 350 MiB", "Scale the height field down"}) {
    EXPECT_NE(refused.errors.find(word), std::string::npos) << refused.errors;
  }
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  const ProcessResult enough = bake("1000M");
  EXPECT_EQ(enough.exit_code, 0) << enough.errors;
}

// The most that a run holds is its limit and a twentieth, whatever takes the memory: maps, bands, rays, files, meshes.
// tools/bench/memory_limit.py looks at 40 commands.
TEST_F(Limits, OfMemoryAreKept) {
  save_obj(test::BumpySphere::dense(25'000), folder_ / "high.obj");
  constexpr std::uint64_t kLeast = std::uint64_t{140} << 20;  // of which the driver has most
  const std::string high = folder_ / "high.obj", low = folder_ / "low.obj";
  int refused = 0, done = 0;
  for (const Words& words : std::vector<Words>{
           {"bake", high, low, "--size", "512", "--maps", "normal,ao,id", "--ao-rays", "4",
            "--samples", "2", "--format", "exr", "--mips", "--cage", "auto"},
           {"bake", high, "--faces", "500", "--size", "512", "--match", "closest"},
           {"simplify", high, "--max-error", "1%"}}) {
    const auto run = [&](std::uint64_t limit) {
      const fs::path out = folder_ / "limited";
      fs::remove_all(out);
      Words all = words;
      all.insert(all.end(), {"--quiet", "--out", out / (words[0] == "bake" ? "" : "low.obj"),
                             "--memory-limit", std::to_string(limit)});
      ProcessResult result = test::run_kiln(all);
      if (result.exit_code != 0) {
        EXPECT_EQ(result.exit_code, 1) << result.errors;
        EXPECT_NE(result.errors.find("--memory-limit"), std::string::npos) << result.errors;
        EXPECT_FALSE(fs::exists(out));
      }
      return result;
    };
    constexpr std::uint64_t kEnough = std::uint64_t{4} << 30;
    run(kEnough);  // Kernels go to the cache.
    const ProcessResult alone = run(kEnough);
    EXPECT_EQ(alone.exit_code, 0) << alone.errors;
    for (const double share : {0.6, 0.9}) {
      const auto limit = std::max(
          kLeast, static_cast<std::uint64_t>(share * static_cast<double>(alone.peak_bytes)));
      const ProcessResult result = run(limit);
      EXPECT_LE(result.peak_bytes, limit + limit / 20)
          << words[1] << " " << words[4] << " " << share;
      ++(result.exit_code == 0 ? done : refused);
    }
  }
  EXPECT_GE(refused, 1);
  EXPECT_GE(done, 1);
}

// PoCL's compiler takes 150 MiB, once.
TEST_F(Limits, OfMemoryHoldACompiler) {
  Words words = bake("16", folder_ / "out");
  words.insert(words.end(), {"--memory-limit", "190M"});
  test::ProcessOptions options;
  options.environment["POCL_CACHE_DIR"] = folder_ / "cache";
  const ProcessResult result = test::run_kiln(words, options);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.errors.find("Compiling kernels"), std::string::npos) << result.errors;
  EXPECT_LE(result.peak_bytes, std::uint64_t{200} << 20);
}

// The system does not count memory that was taken but not yet written to.
TEST_F(Limits, OfMemoryCountBuffersThatAreStillEmpty) {
  constexpr std::size_t kBytes = std::size_t{64} << 20;
  ocl::Context& context = context_of(*test::device());
  if (context.info().is_gpu) GTEST_SKIP() << "its memory is not the host's";
  set_memory_limit(free_memory() / 2);
  const auto left = [] { return static_cast<double>(memory_left()); };
  const double before = left();
  {
    const ocl::Array<std::uint8_t> empty(context, kBytes);
    EXPECT_LT(left(), before - 0.9 * kBytes);
    context.fill(empty, std::uint8_t{1});
    context.finish();
    EXPECT_LT(left(), before - 0.9 * kBytes);
    EXPECT_GT(left(), before - 1.5 * kBytes);  // Not counted twice.
  }
  set_memory_limit(0);
}

// So is it with what later work is known to take.
TEST_F(Limits, OfMemoryCountWhatIsReserved) {
  set_memory_limit(free_memory() / 2);
  require_memory("A block", kMaxUncheckedBytes + 1);
  {
    const ReservedMemory later(memory_left());
    EXPECT_THROW(require_memory("A block", kMaxUncheckedBytes + 1), Error);
  }
  require_memory("A block", kMaxUncheckedBytes + 1);
  set_memory_limit(0);
}

// Files of a few MiB may take much more in what is made of them.
TEST_F(Limits, OfMemoryAreObeyedByVolumesAndCharts) {
  {
    std::ofstream file(folder_ / "noise.raw", std::ios::binary);
    std::uint32_t state = 1;
    for (int i = 0; i < 128 * 128 * 128; ++i) {
      state = state * 1664525 + 1013904223;
      file.put(static_cast<char>(state >> 24));
    }
    std::ofstream(folder_ / "noise.mhd")
        << "ObjectType = Image\nNDims = 3\nDimSize = 128 128 128\nElementType = MET_UCHAR\n"
           "ElementDataFile = noise.raw\n";
    std::ofstream(folder_ / "ramp.raw", std::ios::binary) << [] {
      std::string voxels(4096, '\0');
      for (std::size_t i = 0; i < voxels.size(); ++i) voxels[i] = static_cast<char>(8 * (i % 16));
      return voxels;
    }();
    std::ofstream(folder_ / "ramp.mhd")
        << "ObjectType = Image\nNDims = 3\nDimSize = 16 16 16\nElementType = MET_UCHAR\n"
           "ElementDataFile = ramp.raw\n";
  }
  const auto refused = [&](const Words& words, const std::string& text) {
    Words all = {"volume"};
    all.insert(all.end(), words.begin(), words.end());
    all.insert(all.end(), {"--out", folder_ / "out", "--memory-limit", "200M"});
    const ProcessResult result = test::run_kiln(all);
    EXPECT_EQ(result.exit_code, 1) << result.errors;
    EXPECT_NE(result.errors.find(text), std::string::npos) << result.errors;
    EXPECT_NE(result.errors.find("--memory-limit"), std::string::npos) << result.errors;
    EXPECT_FALSE(fs::exists(folder_ / "out"));
  };
  const std::string noise = folder_ / "noise.mhd", ramp = folder_ / "ramp.mhd";
  refused({noise, "--iso", "128"}, "The full contour of volume 'noise' would take");
  refused({ramp, "--iso", "60", "--size", "8192"}, "The low poly of volume 'ramp' and its map");
  refused({ramp, "--iso", "60", "--size", "2048", "--unwrap", "charts"},
          "The low poly of volume 'ramp' and its map");
  Words small = {"volume", ramp, "--iso", "60", "--size", "64", "--out", folder_ / "small"};
  EXPECT_EQ(test::run_kiln(small).exit_code, 0);  // Kernels go to the cache.
  small.insert(small.end(), {"--memory-limit", "200M"});
  EXPECT_EQ(test::run_kiln(small).exit_code, 0);
  const Mesh mesh = test::BumpySphere::dense(200'000);
  for (const UnwrapMethod method : {UnwrapMethod::pairs, UnwrapMethod::charts}) {
    set_memory_limit(1);
    try {
      unwrap(mesh, {.method = method});
      ADD_FAILURE() << "not refused";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::internal);
      EXPECT_EQ(std::string(error.what()).find("Unwrapping would take"), 0u) << error.what();
    }
    set_memory_limit(0);
  }
}

// 2^-100 is about 1e-30: exact in single precision, so the map keeps every byte.
TEST_F(Limits, OfSizeAreNotFelt) {
  ASSERT_EQ(test::run_kiln(bake("32", folder_ / "plain")).exit_code, 0);
  for (const float scale : {0x1p-100F, 0x1p90F}) {
    fs::create_directory(folder_ / "scaled");
    for (const char* name : {"high.obj", "low.obj"}) {
      Mesh mesh = load_mesh(folder_ / name);
      for (Vec3& p : mesh.positions) p = {p.x * scale, p.y * scale, p.z * scale};
      save_obj(mesh, folder_ / "scaled" / name);
    }
    const ProcessResult result =
        test::run_kiln({"bake", folder_ / "scaled" / "high.obj", folder_ / "scaled" / "low.obj",
                        "--size", "32", "--quiet", "--out", folder_ / "out"});
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_EQ(test::read_file(folder_ / "out" / "low_normal.png"),
              test::read_file(folder_ / "plain" / "low_normal.png"));
  }
}

TEST_F(Limits, OfMemoryAreSizes) {
  for (const char* wrong : {"3", "63M", "4Gb", "-1G", "", "nan", "inf", "1e30"}) {
    Words words = bake("16", folder_ / "out");
    words.insert(words.end(), {"--memory-limit", wrong});
    EXPECT_EQ(test::run_kiln(words).exit_code, 2) << wrong;
  }
}

TEST_F(Limits, OfTheSystemEndInOrder) {
  ASSERT_EQ(test::run_kiln(bake("256", folder_ / "first")).exit_code, 0);  // kernels to the cache
  const std::vector<std::string> limits = {"-v 100000",  "-v 300000", "-v 600000", "-v 1000000",
                                           "-v 2000000", "-n 6",      "-n 8",      "-n 12",
                                           "-n 20",      "-f 0",      "-f 8",      "-f 64"};
  for (const std::string& limit : limits) {
    const fs::path out = folder_ / "out";
    fs::remove_all(out);
    expect_in_order(under(limit, bake("256", out)), out, "ulimit " + limit);
  }
}

TEST_F(Limits, OfADiskEndInOrder) {
  const fs::path disk = folder_ / "disk";
  fs::create_directory(disk);
  for (const char* size : {"size=4k", "size=16k", "size=64k", "size=8m"}) {
    if (mount("none", disk.c_str(), "tmpfs", 0, size) != 0) {
      GTEST_SKIP() << "file systems cannot be mounted here";
    }
    const ProcessResult result = test::run_kiln(bake("256", disk / "out"));
    expect_in_order(result, disk / "out", size);
    EXPECT_TRUE(result.exit_code == 5 || std::string(size) == "size=8m" || result.exit_code == 0)
        << result.exit_code;
    EXPECT_EQ(umount(disk.c_str()), 0);
  }
}

}  // namespace
}  // namespace kiln
