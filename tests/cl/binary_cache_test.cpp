// Binaries of programs that later runs load: found again, whole or not at all, and never in the way.
#include "cl/binary_cache.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "cl/context.h"
#include "kiln/bake.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using cl::BinaryCache;
using Bytes = std::vector<unsigned char>;

std::vector<fs::path> files_of(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  return files;
}

TEST(BinaryCache, FindsWhatWasKept) {
  const fs::path folder = test::scratch_folder();
  const BinaryCache cache(folder / "a" / "b", "driver 1");
  EXPECT_FALSE(cache.find("source", "-D A=1"));
  cache.store("source", "-D A=1", Bytes{1, 2, 0, 255});
  EXPECT_EQ(cache.find("source", "-D A=1"), (Bytes{1, 2, 0, 255}));
  EXPECT_EQ(BinaryCache(folder / "a" / "b", "driver 1").find("source", "-D A=1"),
            (Bytes{1, 2, 0, 255}));
  EXPECT_FALSE(cache.find("source", "-D A=2"));
  EXPECT_FALSE(cache.find("sourcf", "-D A=1"));
  EXPECT_FALSE(BinaryCache(folder / "a" / "b", "driver 2").find("source", "-D A=1"));
  cache.store("source", "-D A=1", Bytes{7});
  EXPECT_EQ(cache.find("source", "-D A=1"), Bytes{7});
  EXPECT_EQ(files_of(folder / "a" / "b").size(), 1U);
  cache.remove("source", "-D A=1");
  EXPECT_FALSE(cache.find("source", "-D A=1"));
}

/// Every byte changed, and every length: as if there were no file.
TEST(BinaryCache, TakesNothingThatIsNotWhole) {
  const fs::path folder = test::scratch_folder();
  const BinaryCache cache(folder, "driver");
  cache.store("source", "options", Bytes(40, 9));
  const fs::path file = files_of(folder).at(0);
  std::string text(fs::file_size(file), '\0');
  std::ifstream(file, std::ios::binary)
      .read(text.data(), static_cast<std::streamsize>(text.size()));
  const auto found_with = [&](const std::string& changed) {
    std::ofstream(file, std::ios::binary) << changed;
    return cache.find("source", "options").has_value();
  };
  EXPECT_TRUE(found_with(text));
  for (std::size_t i = 0; i < text.size(); ++i) {
    std::string changed = text;
    changed[i] = static_cast<char>(changed[i] ^ 1);
    EXPECT_FALSE(found_with(changed)) << "byte " << i;
    EXPECT_FALSE(found_with(text.substr(0, i))) << "length " << i;
  }
  EXPECT_FALSE(found_with(text + "x"));
  fs::remove(file);
  fs::create_directory(file);
  EXPECT_FALSE(cache.find("source", "options"));
}

TEST(BinaryCache, TakesNothingThatOthersMayWriteTo) {
  const fs::path folder = test::scratch_folder() / "new";
  const BinaryCache cache(folder, "driver");
  const mode_t before = umask(0);
  cache.store("source", "options", Bytes(40, 9));
  umask(before);
  const fs::path file = files_of(folder).at(0);
  EXPECT_EQ(fs::status(folder).permissions(), fs::perms::owner_all);
  EXPECT_EQ(fs::status(file).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_TRUE(cache.find("source", "options"));
  fs::permissions(file, fs::perms::others_write, fs::perm_options::add);
  EXPECT_FALSE(cache.find("source", "options"));
  cache.store("source", "options", Bytes(40, 9));
  EXPECT_TRUE(cache.find("source", "options"));
}

TEST(BinaryCache, KeepsNothingWhereItCannot) {
  const fs::path folder = test::scratch_folder();
  const fs::path file = folder / "file";
  std::ofstream(file) << "x";
  for (const fs::path& place : {file / "under", fs::path()}) {
    const BinaryCache cache(place, "driver");
    cache.store("source", "options", Bytes{1});
    EXPECT_FALSE(cache.find("source", "options"));
    cache.remove("source", "options");
  }
  EXPECT_EQ(files_of(folder).size(), 1U);
}

TEST(BinaryCache, DropsTheOldest) {
  const fs::path folder = test::scratch_folder();
  const BinaryCache cache(folder, "driver");
  const std::size_t count = BinaryCache::kMaxBinaries + 20;
  for (std::size_t i = 0; i < count; ++i) {
    cache.store(std::to_string(i), "", Bytes{1});
    for (const fs::path& file : files_of(folder)) {
      if (i == 0)
        fs::last_write_time(file, fs::file_time_type::clock::now() - std::chrono::hours(9));
    }
  }
  EXPECT_EQ(files_of(folder).size(), BinaryCache::kMaxBinaries);
  EXPECT_FALSE(cache.find("0", ""));
  EXPECT_TRUE(cache.find(std::to_string(count - 1), ""));
}

TEST(BinaryCache, IsSharedByThreads) {
  const fs::path folder = test::scratch_folder();
  const BinaryCache cache(folder, "driver");
  std::vector<std::jthread> threads;
  for (unsigned char t = 0; t < 4; ++t) {
    threads.emplace_back([&cache, t] {
      for (int i = 0; i < 50; ++i) {
        cache.store("source", "", Bytes(10000, t));
        const auto found = cache.find("source", "");
        if (!found) continue;
        EXPECT_EQ(*found, Bytes(10000, found->front()));
      }
    });
  }
  threads.clear();
  EXPECT_TRUE(cache.find("source", ""));
  EXPECT_EQ(files_of(folder).size(), 1U);
}

/// A variable of the environment while this lives.
class Environment {
 public:
  Environment(const char* name, const std::string& value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    setenv(name, value.c_str(), 1);
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;
  ~Environment() { before_.empty() ? unsetenv(name_) : setenv(name_, before_.c_str(), 1); }

 private:
  const char* name_;
  std::string before_;
};

std::vector<float> baked() {
  const Device device = Device::open("");
  const Source source(device, test::BumpySphere::dense(2000, true));
  BakeOptions options;
  options.width = options.height = 64;
  return bake(source, test::BumpySphere::light(), options).maps[0].image.pixels;
}

/// From sources, from binaries, and where each binary is no program although its file is whole.
TEST(BinaryCache, ChangesNoByteOfAMap) {
  KILN_REQUIRE_DEVICE();
  if (test::device()->info().platform != "Portable Computing Language") {
    GTEST_SKIP() << "only PoCL's binaries are kept";
  }
  const fs::path folder = test::scratch_folder();
  // PoCL has read the variable already: its own cache stays where it is.
  const Environment cache("POCL_CACHE_DIR", folder.string());
  {
    // Programs are stored on request alone: to make their binaries, PoCL compiles each kernel twice.
    const Environment unset("KILN_KEEP_BINARIES", "");
    baked();
    // Marks of compiled programs alone; this process knows that its device is sound.
    EXPECT_FALSE(files_of(folder / "kiln").empty());
    for (const fs::path& file : files_of(folder / "kiln")) EXPECT_LT(fs::file_size(file), 4096U);
  }
  const Environment keep("KILN_KEEP_BINARIES", "1");
  const std::vector<float> first = baked();
  const std::size_t programs = files_of(folder / "kiln").size();
  EXPECT_GE(programs, 4U);
  EXPECT_EQ(baked(), first);
  for (const fs::path& file : files_of(folder / "kiln")) {
    if (fs::file_size(file) < 1000) continue;  // The device passed its self-test.
    std::string text(fs::file_size(file), '\0');
    std::ifstream(file, std::ios::binary)
        .read(text.data(), static_cast<std::streamsize>(text.size()));
    const std::size_t at = text.find("poclbin");
    ASSERT_NE(at, std::string::npos) << "not a binary of PoCL's";
    // Its words are kept whole, with a hash that fits.
    const std::string garbage = "no program at all";
    std::uint64_t hash = 0xCBF29CE484222325U;
    for (const char c : garbage) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3U;
    char hex[17];
    std::snprintf(hex, sizeof hex, "%016llx", static_cast<unsigned long long>(hash));
    std::ofstream(file, std::ios::binary) << text.substr(0, at - 17) << hex << '\n' << garbage;
  }
  EXPECT_EQ(baked(), first);
  EXPECT_EQ(files_of(folder / "kiln").size(), programs);
  for (const char* name : {"POCL_KERNEL_CACHE", "KILN_KEEP_BINARIES"}) {
    const Environment off(name, "0");
    fs::remove_all(folder / "kiln");
    EXPECT_EQ(baked(), first) << name;
    EXPECT_FALSE(fs::exists(folder / "kiln")) << name;
  }
}

}  // namespace
}  // namespace kiln
