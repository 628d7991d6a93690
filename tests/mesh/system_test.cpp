// What the operating system does for Kiln (base/file.h, base/process.h): the same on Linux and Windows.
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/control_group.h"
#include "base/file.h"
#include "base/page_array.h"
#include "base/process.h"
#include "base/system_memory.h"
#ifdef _WIN32
#include "base/windows/api.h"
#endif

namespace kiln {
namespace {

namespace fs = std::filesystem;

class System : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = os::create_temporary_folder("kiln-system-test-");
    ASSERT_FALSE(folder_.empty());
  }
  void TearDown() override { fs::remove_all(folder_); }

  static void write(const fs::path& path, const std::string& text) {
    const int file = os::create_file(path, 0666);
    ASSERT_GE(file, 0) << path << ": " << errno;
    EXPECT_EQ(os::write_some(file, text.data(), text.size()),
              static_cast<std::ptrdiff_t>(text.size()));
    EXPECT_TRUE(os::sync(file));
    os::close(file);
  }

  static std::string read(int file) {
    std::string text(64, '\0');
    const std::ptrdiff_t count = os::read_at(file, 0, text.data(), text.size());
    text.resize(count < 0 ? 0 : static_cast<std::size_t>(count));
    return count < 0 ? "error" : text;
  }
  static std::string read(const fs::path& path) {
    const int file = os::open_to_read(path);
    if (file < 0) return "none";
    const std::string text = read(file);
    os::close(file);
    return text;
  }

  std::vector<std::string> names() const {
    std::vector<std::string> found;
    for (const auto& entry : fs::directory_iterator(folder_))
      found.push_back(entry.path().filename().string());
    std::sort(found.begin(), found.end());
    return found;
  }

  fs::path folder_;
};

TEST_F(System, NamesMayHaveAnyLetters) {
  for (const std::string name : {"Größe äöü ß", "雕像", "скульптура", "🗿", "a b'c"}) {
    write(folder_ / name, name);
    EXPECT_EQ(read(folder_ / name), name);
    EXPECT_EQ(names(), std::vector<std::string>{name});
    EXPECT_TRUE(os::remove_file((folder_ / name).c_str()));
  }
}

TEST_F(System, PathsMayBeLong) {
  constexpr std::size_t kLevels = 8, kLetters = 50;  // 400 letters, where Windows' own limit is 260
  std::vector<fs::path> levels = {folder_};
  for (std::size_t i = 0; i < kLevels; ++i) {
    levels.push_back(levels.back() / std::string(kLetters, static_cast<char>('a' + i)));
    os::create_private_folders(levels.back());
  }
  const fs::path file = levels.back() / "file", other = levels.back() / "other";
  ASSERT_GT(file.native().size(), kLevels * kLetters);
  write(file, "first");
  write(other, "second");
  EXPECT_TRUE(os::may_write(file));
  EXPECT_TRUE(os::may_write_in(levels.back()));
  EXPECT_EQ(os::query_file(file)->bytes, 5U);
  EXPECT_TRUE(os::replace(other, file));
  EXPECT_EQ(read(file), "second");
  EXPECT_TRUE(os::add_hard_link(file, other));
  const int lock = os::lock_folder(levels.back(), 1);
  EXPECT_GE(lock, 0);
  os::close(lock);
  EXPECT_TRUE(os::remove_file(file.c_str()));
  EXPECT_TRUE(os::remove_file(other.c_str()));
  for (std::size_t i = kLevels; i > 0; --i) EXPECT_TRUE(os::remove_folder(levels[i].c_str())) << i;
}

#ifdef _WIN32
// Wine has no such limit, so that PathsMayBeLong passes there without.
TEST(ApiPath, LongPathsHaveAPrefix) {
  const std::wstring name(200, L'a');
  EXPECT_EQ(os::api_path(L"short"), L"short");
  EXPECT_EQ(os::api_path(L"C:/" + name), L"C:/" + name);
  EXPECT_EQ(os::api_path(L"C:/" + name + L"/./x/../" + name), LR"(\\?\C:\)" + name + L'\\' + name);
  EXPECT_EQ(os::api_path(LR"(\\host\share\)" + name + L"/" + name),
            LR"(\\?\UNC\host\share\)" + name + L'\\' + name);
  EXPECT_EQ(os::api_path(LR"(\\?\C:\)" + name + L'\\' + name), LR"(\\?\C:\)" + name + L'\\' + name);
  // Relative ones count with the current folder.
  const std::wstring relative = name + L"/" + name;
  EXPECT_TRUE(os::api_path(relative).starts_with(LR"(\\?\)"));
  EXPECT_TRUE(os::api_path(relative).ends_with(name + L'\\' + name));
}
#endif

TEST_F(System, KeysOfNamesAreEqualForOneFile) {
  const auto same = [](const fs::path& a, const fs::path& b) {
    return os::name_key(a) == os::name_key(b);
  };
  EXPECT_TRUE(same("a/b.png", "a/b.png"));
  EXPECT_FALSE(same("a/b.png", "a/c.png"));
#ifdef _WIN32
  for (const char* const other :
       {"A/B.png", "a\\b.PNG", "./a/x/../b.png", "a/b.png.", "a/b.png "}) {
    EXPECT_TRUE(same("a/b.png", other)) << other;
  }
  EXPECT_TRUE(same("Größe", "GRÖßE"));
  write(folder_ / "Größe", "text");
  EXPECT_EQ(read(folder_ / "GRÖßE"), "text");
#else
  EXPECT_FALSE(same("a/b.png", "A/B.png"));
#endif
}

TEST_F(System, PathsOfSharesKeepTheirServer) {
  std::error_code error;
  EXPECT_EQ(os::absolute("a/b", error), fs::current_path() / "a/b");
  EXPECT_EQ(os::absolute_normal("a/./x/../b"), fs::current_path() / "a/b");
  EXPECT_EQ(os::normal("a/./x/../b"), fs::path("a/b").make_preferred());
  EXPECT_EQ(os::join("a", "b"), fs::path("a") / "b");
  EXPECT_FALSE(os::is_absolute("a/b"));
  EXPECT_TRUE(os::is_absolute(fs::current_path()));
#ifdef _WIN32
  for (const std::string share : {R"(\\host\share)", "//host/share"}) {
    EXPECT_TRUE(os::is_absolute(share + "/a"));
    EXPECT_EQ(os::join("C:/x", share + "/a").native(), fs::path(share + "/a").native());
    const std::wstring file = LR"(\\host\share\a)";
    EXPECT_EQ(os::absolute(share + "/a", error).native(), file);
    EXPECT_EQ(os::absolute_normal(share + "/x/../a").native(), file);
    EXPECT_EQ(os::normal(share + "/x/../a").native(), file);
    EXPECT_EQ(os::canonical(share + "/x/../a", error).native(), file);
  }
#endif
}

TEST_F(System, NamesOfDevicesAreKnown) {
#ifdef _WIN32
  for (const char* const name :
       {"con", "CON.png", "a/aux.tar.gz", "prn ", "nul.exr", "Com1", "lpt9.glb"}) {
    EXPECT_TRUE(os::is_device_name(name)) << name;
  }
  const auto sink = os::query_file("NUL");
  ASSERT_TRUE(sink);
  EXPECT_FALSE(sink->is_regular || sink->is_folder);
  const int file = os::open_to_write("NUL");
  ASSERT_GE(file, 0);
  EXPECT_EQ(os::write_some(file, "text", 4), 4);
  os::close(file);
#else
  EXPECT_FALSE(os::is_device_name("con"));
#endif
  for (const char* const name :
       {"NUL", "nul", "console.png", "com.png", "com10", "con_normal.png", "a/b", "con/b"}) {
    EXPECT_FALSE(os::is_device_name(name)) << name;
  }
}

// On Windows a file that is open is not replaced: old or new, but never neither.
TEST_F(System, OpenFilesAreReplacedOrStay) {
  write(folder_ / "target", "old");
  write(folder_ / "new", "new");
  const int open = os::open_to_read(folder_ / "target");
#ifdef _WIN32
  EXPECT_FALSE(os::replace(folder_ / "new", folder_ / "target"));
  EXPECT_EQ(errno, EACCES);
  EXPECT_EQ(read(folder_ / "target"), "old");
  EXPECT_EQ(read(folder_ / "new"), "new");
  os::close(open);
  EXPECT_TRUE(os::replace(folder_ / "new", folder_ / "target"));
#else
  EXPECT_TRUE(os::replace(folder_ / "new", folder_ / "target"));
  EXPECT_EQ(read(open), "old");
  os::close(open);
#endif
  EXPECT_EQ(read(folder_ / "target"), "new");
  EXPECT_EQ(names(), std::vector<std::string>{"target"});
}

// As a handler of Ctrl-C removes what is being written.
TEST_F(System, OpenFilesAreRemoved) {
  write(folder_ / "file", "text");
  const int open = os::open_to_read(folder_ / "file");
  EXPECT_TRUE(os::remove_file((folder_ / "file").c_str()));
  EXPECT_EQ(read(open), "text");
  os::close(open);
  EXPECT_TRUE(names().empty());
}

TEST_F(System, FoldersAreLockedUntilTheyAreClosed) {
  const int lock = os::lock_folder(folder_, 1);
  ASSERT_GE(lock, 0);
  EXPECT_LT(os::lock_folder(folder_, 0.1), 0);
  EXPECT_EQ(errno, EWOULDBLOCK);
  os::close(lock);
  const int again = os::lock_folder(folder_, 1);
  EXPECT_GE(again, 0);
  os::close(again);
  EXPECT_TRUE(names().empty());
  EXPECT_LT(os::lock_folder(folder_ / "none", 1), 0);
  EXPECT_EQ(errno, ENOENT);
}

TEST_F(System, FailuresHaveTheirReason) {
  write(folder_ / "file", "text");
  EXPECT_LT(os::create_file(folder_ / "file", 0666), 0);
  EXPECT_EQ(errno, EEXIST);
  EXPECT_LT(os::create_file(folder_ / "none" / "file", 0666), 0);
  EXPECT_EQ(errno, ENOENT);
  EXPECT_LT(os::open_to_read(folder_ / "none"), 0);
  EXPECT_EQ(errno, ENOENT);
  EXPECT_FALSE(os::replace(folder_ / "none", folder_ / "file"));
  EXPECT_EQ(errno, ENOENT);
  EXPECT_FALSE(os::add_hard_link(folder_ / "none", folder_ / "link"));
  EXPECT_EQ(errno, ENOENT);
  EXPECT_FALSE(os::remove_folder(folder_.c_str()));
  EXPECT_EQ(errno, ENOTEMPTY);
  EXPECT_EQ(read(folder_ / "file"), "text");
}

TEST_F(System, FactsAreOfTheFile) {
  write(folder_ / "file", "text");
  write(folder_ / "other", "text");
  EXPECT_TRUE(os::add_hard_link(folder_ / "file", folder_ / "link"));
  const auto file = os::query_file(folder_ / "file"), link = os::query_file(folder_ / "link");
  const auto other = os::query_file(folder_ / "other"), folder = os::query_file(folder_);
  ASSERT_TRUE(file && link && other && folder);
  EXPECT_EQ(file->id, link->id);
  EXPECT_NE(file->id, other->id);
  EXPECT_TRUE(file->is_regular && file->is_owned_by_user && !file->is_folder);
  EXPECT_TRUE(folder->is_folder && !folder->is_regular);
  EXPECT_EQ(file->bytes, 4U);
  EXPECT_GT(file->modified_ns, std::int64_t{1700000000} * 1000000000);
  EXPECT_EQ(file->modified, file->modified_ns / 1000000000);
  const int open = os::open_to_read(folder_ / "file");
  EXPECT_EQ(os::query_file(open)->id, file->id);
  os::close(open);
  EXPECT_FALSE(os::query_file(folder_ / "none"));
}

TEST_F(System, ProcessesAreKnown) {
  EXPECT_FALSE(os::has_process_ended(os::process_id()));
  EXPECT_TRUE(os::has_process_ended(999999999));
  EXPECT_EQ(os::process_namespace_id().size(), 16U);
  EXPECT_EQ(os::process_namespace_id().find_first_not_of("0123456789abcdef"), std::string::npos);
  EXPECT_FALSE(os::own_arguments().empty());
  EXPECT_NE(read(os::own_program()), "none");
}

TEST_F(System, MemoryIsKnown) {
  const std::uint64_t before = os::resident_memory();
  EXPECT_GT(before, 0U);
  EXPECT_GE(os::peak_resident_memory(), before / 2);
  EXPECT_GT(os::free_memory_of_machine(), std::uint64_t{1} << 20);
  EXPECT_NE(os::free_memory_of_machine(), kNoNumber);
  const std::vector<char> block(std::size_t{64} << 20, 'x');
  const volatile char* const last = &block.back();  // else a compiler may leave the block out
  EXPECT_EQ(*last, 'x');
  EXPECT_GE(os::resident_memory(), before + block.size() / 2);
}

constexpr std::size_t kMebibyte = std::size_t{1} << 20;

TEST(PageArray, TakesMemoryAsItIsWrittenAndFreesItAtOnce) {
  const std::uint64_t before = os::resident_memory();
  {
    std::vector<char, PageAllocator<char>> reserved;
    reserved.reserve(64 * kMebibyte);
    EXPECT_LT(os::resident_memory(), before + 16 * kMebibyte);
    PageArray<char> array(64 * kMebibyte);
    std::fill_n(array.data(), array.size(), 'x');
    EXPECT_GT(os::resident_memory(), before + 48 * kMebibyte);
  }
  EXPECT_LT(os::resident_memory(), before + 16 * kMebibyte);
}

TEST(PageArray, GivesBackWhatIsNotReadAnyMore) {
  PageArray<char> array(64 * kMebibyte);
  std::fill_n(array.data(), array.size(), 'x');
  const std::uint64_t before = os::resident_memory();
  constexpr std::size_t kMargin = 1001;  // the ends lie within pages
  array.discard(kMargin, array.size() - kMargin);
  EXPECT_LT(os::resident_memory(), before - 48 * kMebibyte);
  EXPECT_TRUE(std::all_of(array.data(), array.data() + kMargin, [](char c) { return c == 'x'; }));
  EXPECT_TRUE(std::all_of(array.data() + array.size() - kMargin, array.data() + array.size(),
                          [](char c) { return c == 'x'; }));
  array[array.size() / 2] = 'y';  // addresses stay valid
  EXPECT_EQ(array[array.size() / 2], 'y');
}

TEST(PageArray, SmallOnesKeepAllElements) {
  PageArray<char> array(kMinPagedBytes - 1);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(array.data()) % 128, 0U);
  std::fill_n(array.data(), array.size(), 'x');
  array.discard(0, array.size());
  EXPECT_TRUE(
      std::all_of(array.data(), array.data() + array.size(), [](char c) { return c == 'x'; }));
}

}  // namespace
}  // namespace kiln
