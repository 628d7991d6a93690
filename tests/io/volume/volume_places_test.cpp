// Axes, units and voxel centres of volume files; a scanned head.
#include <gtest/gtest.h>

#include <cmath>

#include "io/volume/volume_samples.h"
#include "kiln/volume.h"
#include "support/environment.h"
#include "support/volume_files.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::volume_samples::load;
using test::volume_samples::Loaded;
using test::volume_samples::voxel;
using test::volume_samples::write_file;

TEST(VolumeIo, ReadsNrrdSpacingsMinimaAndHandedness) {
  const std::string start = "NRRD0003\r\ntype: uchar\r\ndimension: 3\r\nsizes: 2 1 1\r\n";
  const std::string end = "encoding: raw\r\n\r\nab";
  Loaded got = load(write_file("s.nrrd", start + "spacings: 0.5 2 NaN\r\n" + end));
  const std::array<std::array<double, 3>, 3> axes{{{0.5, 0, 0}, {0, 2, 0}, {0, 0, 1}}};
  EXPECT_EQ(got.volume.axes, axes);
  EXPECT_EQ(got.count("missing-spacing"), 1u);
  EXPECT_EQ(voxel<char>(got.volume, 1), 'b');
  got = load(write_file("s.nrrd", start + "spacings: 0.5 2 4\r\naxis mins: 10 20 nan\r\n" +
                                      "centers: cell node cell\r\n" + end));
  EXPECT_EQ(got.volume.origin, (std::array<double, 3>{10.25, 20, 0}));
  EXPECT_TRUE(got.warnings.empty());
  got = load(write_file("s.nrrd", start + end));
  EXPECT_EQ(got.count("missing-spacing"), 3u);
  for (const char* space : {"left-anterior-superior", "LAS", "3D-left-handed"}) {
    got = load(write_file("s.nrrd", start + "space: " + space +
                                        "\r\nspace directions: (2,0,1) (0,2,0) (0,0,2)\r\n"
                                        "space origin: (3,4,5)\r\n" +
                                        end));
    EXPECT_EQ(got.volume.origin, (std::array<double, 3>{-3, 4, 5}));
    EXPECT_EQ(got.volume.axes[0], (std::array<double, 3>{-2, 0, 1}));
  }
}

TEST(VolumeIo, TakesNrrdSpacingFromTheEndsOfAxes) {
  const auto read = [](const std::string& lines) {
    return load(write_file("m.nrrd", "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 2 1\n" + lines +
                                         "encoding: raw\n\nabcdefgh"));
  };
  // Cells: 4 of them from -1 to 1, the first voxel in the middle of the first. Nodes: 3 steps.
  Loaded got = read("axis mins: -1 0 5\naxis maxs: 1 6 7\ncenters: cell node cell\n");
  const std::array<std::array<double, 3>, 3> axes{{{0.5, 0, 0}, {0, 6, 0}, {0, 0, 2}}};
  EXPECT_EQ(got.volume.axes, axes);
  EXPECT_EQ(got.volume.origin, (std::array<double, 3>{-0.75, 0, 6}));
  EXPECT_TRUE(got.warnings.empty());
  // Teem takes cells where nothing is said.
  got = read("axis mins: -1 0 5\naxis maxs: 1 4 7\n");
  EXPECT_EQ(got.volume.axes[1][1], 2);
  EXPECT_EQ(got.count("assumed-cells"), 3u);
  // `spacings` come first; a node alone, or an axis without length, has no spacing.
  EXPECT_EQ(read("spacings: 3 3 3\naxis mins: 0 0 0\naxis maxs: 1 1 1\n").volume.axes[0][0], 3);
  got = read("axis mins: 0 0 0\naxis maxs: 3 0 1\ncenters: node node node\n");
  EXPECT_EQ(got.count("missing-spacing"), 2u);
  EXPECT_EQ(got.volume.axes[0][0], 1);
}

TEST(VolumeIo, JoinsNrrdDataOfSeveralFiles) {
  write_file("slice 7.raw", "xxabcd");
  write_file("slice 8.raw", "xxefgh");
  write_file("slice 9.raw", "xxijklz");
  const std::string start =
      "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 3\nspacings: 1 1 1\nencoding: raw\n";
  const auto text = [](const Volume& volume) {
    return std::string(reinterpret_cast<const char*>(volume.voxels.data()), volume.voxels.size());
  };
  for (const std::string files : {"LIST\nslice 7.raw\nslice 8.raw\r\nslice 9.raw\n",
                                  "LIST 2\nslice 7.raw\nslice 8.raw\nslice 9.raw"}) {
    const Loaded got = load(write_file("l.nhdr", start + "byte skip: 2\ndata file: " + files));
    EXPECT_EQ(text(got.volume), "abcdefghijkl");
    EXPECT_EQ(got.count("trailing-bytes"), 1u);
  }
  for (int i = 8; i < 11; ++i) {
    write_file("s" + std::string(i < 10 ? "0" : "") + std::to_string(i) + ".raw",
               std::string(4, static_cast<char>('a' + i)));
  }
  EXPECT_EQ(text(load(write_file("l.nhdr", start + "data file: s%02d.raw 8 10 1\n")).volume),
            "iiiijjjjkkkk");
  EXPECT_EQ(text(load(write_file("l.nhdr", start + "data file: s%02d.raw 10 8 -1 2\n")).volume),
            "kkkkjjjjiiii");
  const std::string packed =
      "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nspacings: 1 1 1\nencoding: gzip\n";
  write_file("a.gz", test::packed("abcde", true));
  write_file("b.gz", test::packed("fgh", true));
  EXPECT_EQ(text(load(write_file("p.nhdr", packed + "data file: LIST\na.gz\nb.gz\n")).volume),
            "abcdefgh");
}

TEST(VolumeIo, LeavesOutDimensionsOfSizeOne) {
  const auto nrrd = [](const std::string& lines) {
    return load(write_file("d.nrrd", "NRRD0004\ntype: uchar\ndimension: 4\nencoding: raw\n" +
                                         lines + "\nabcdef"))
        .volume.size;
  };
  const std::array<std::uint32_t, 3> wanted{3, 2, 1};
  EXPECT_EQ(nrrd("sizes: 3 2 1 1\n"), wanted);
  EXPECT_EQ(nrrd("sizes: 1 3 2 1\nkinds: vector domain domain domain\n"), wanted);
  EXPECT_EQ(nrrd("sizes: 3 2 1 1\nkinds: domain domain domain time\n"), wanted);
  EXPECT_EQ(nrrd("sizes: 1 3 2 1\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n"), wanted);
  const Loaded meta = load(write_file(
      "d.mha",
      "NDims = 4\nDimSize = 3 2 1 1\nElementSpacing = 4 5 6 7\nOffset = 1 2 3 4\nTransformMatrix = "
      "0 1 0 "
      "0 1 0 0 0 0 0 1 0 0 0 0 1\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nabcdef"));
  EXPECT_EQ(meta.volume.size, wanted);
  EXPECT_EQ(meta.volume.origin, (std::array<double, 3>{1, 2, 3}));
  EXPECT_EQ(meta.volume.axes[0], (std::array<double, 3>{0, 4, 0}));
  EXPECT_EQ(meta.volume.axes[1], (std::array<double, 3>{5, 0, 0}));
  test::NiftiFile nifti;
  nifti.dim = {5, 3, 2, 1, 1, 1, 1, 1};
  EXPECT_EQ(load(write_file("d.nii", nifti.text("abcdef"))).volume.size, wanted);
}

TEST(VolumeIo, SkipsLinesAndBytesBeforeNrrdData) {
  const auto read = [](const std::string& lines, const std::string& data) {
    write_file("skip.data", data);
    return voxel<char>(
        load(write_file("skip.nhdr", "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 1 1 1\n" + lines +
                                         "data file: skip.data\n"))
            .volume,
        0);
  };
  EXPECT_EQ(read("encoding: raw\nlineskip: 2\n", "one\ntwo\nX"), 'X');
  EXPECT_EQ(read("encoding: raw\nline skip: 1\nbyte skip: 2\n", "one\n..X"), 'X');
  EXPECT_EQ(read("encoding: raw\nbyte skip: -1\n", "anything\nX"), 'X');
  EXPECT_EQ(read("encoding: gzip\nbyte skip: 3\n", test::packed("...X", true)), 'X');
  EXPECT_EQ(read("encoding: gzip\nline skip: 1\n", "line\n" + test::packed("X", true)), 'X');
  EXPECT_EQ(read("encoding: text\nline skip: 1\n", "title\n88"), 'X');
  // Several members one after the other are one stream.
  const fs::path twice = test::test_data("fuzz") / "nrrd" / "gzip_twice.nrrd";
  EXPECT_EQ(voxel<std::int16_t>(load(twice).volume, 11), 21);
}

TEST(VolumeIo, TakesSformThenQformThenPixelSizes) {
  test::NiftiFile file;
  file.dim = {3, 1, 1, 1, 1, 1, 1, 1};
  file.pixdim = {-1, 2, 3, 4, 0, 0, 0, 0};
  file.qform = 1;
  file.quaternion = {0, 0,
                     std::sqrt(0.5)};  // a quarter turn about z; the factor -1 turns the third axis
  file.quaternion_offset = {7, 8, 9};
  file.rows = {{{1, 0, 0, 10}, {0, 1, 0, 20}, {0, 0, 1, 30}}};
  file.sform = 1;
  EXPECT_EQ(load(write_file("f.nii", file.text("a"))).volume.origin,
            (std::array<double, 3>{10, 20, 30}));
  file.rows[1] = {1, 0, 0, 20};  // flat
  Loaded got = load(write_file("f.nii", file.text("a")));
  EXPECT_EQ(got.count("bad-transform"), 1u);
  EXPECT_EQ(got.volume.origin, (std::array<double, 3>{7, 8, 9}));
  const double wanted[3][3] = {{0, 2, 0}, {-3, 0, 0}, {0, 0, -4}};
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(got.volume.axes[a][c], wanted[a][c], 1e-6);
  }
  file.sform = file.qform = 0;
  got = load(write_file("f.nii", file.text("a")));
  EXPECT_EQ(got.volume.origin, (std::array<double, 3>{}));
  const std::array<std::array<double, 3>, 3> axes{{{2, 0, 0}, {0, 3, 0}, {0, 0, 4}}};
  EXPECT_EQ(got.volume.axes, axes);
}

// ---- real data ----------------------------------------------------------------------------------

TEST(VolumeIo, ReadsAScannedHead) {
  KILN_REQUIRE_DATA("head_t1.nrrd");
  const Loaded head = load(*test::shared_data("head_t1.nrrd"));
  EXPECT_EQ(head.volume.size, (std::array<std::uint32_t, 3>{188, 256, 190}));
  EXPECT_EQ(head.volume.type, VoxelType::u8);
  for (std::size_t a = 0; a < 3; ++a) EXPECT_EQ(head.volume.axes[a][a], 0.88);
  EXPECT_TRUE(head.warnings.empty());
  // Air around a head: the corners are dark, the middle is not.
  std::uint64_t dark = 0;
  for (const std::byte value : head.volume.voxels) dark += value < std::byte{30};
  const double share = static_cast<double>(dark) / static_cast<double>(head.volume.voxels.size());
  EXPECT_GT(share, 0.3);
  EXPECT_LT(share, 0.9);
  const std::size_t middle = (std::size_t{95} * 256 + 128) * 188 + 94;
  EXPECT_GT(head.volume.voxels[middle], std::byte{30});
  EXPECT_LT(head.volume.voxels[0], std::byte{30});
}

}  // namespace
}  // namespace kiln
