// Every way a volume file can be bad: an error that names the file, the place and the remedy.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <limits>

#include "io/volume/volume_reader.h"
#include "kiln/volume.h"
#include "support/environment.h"
#include "support/read_file.h"
#include "support/volume_check.h"
#include "support/volume_files.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

fs::path write_file(const std::string& name, const std::string& content) {
  const fs::path path = test::scratch_folder() / name;
  std::ofstream(path, std::ios::binary) << content;
  return path;
}

/// Must fail with an Error of the code whose message holds the path and each of `words`.
template <typename Read>
void expect_error(ErrorCode code, const fs::path& path, const std::vector<std::string>& words,
                  Read read) {
  try {
    read();
    ADD_FAILURE() << path << " was read";
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_EQ(error.code(), code) << message;
    EXPECT_NE(message.find(path.string()), std::string::npos) << message;
    EXPECT_EQ(message.back(), '.') << message;
    for (const std::string& word : words) {
      EXPECT_NE(message.find(word), std::string::npos) << "no \"" << word << "\" in: " << message;
    }
  }
}

void expect_bad(const fs::path& path, const std::vector<std::string>& words) {
  expect_error(ErrorCode::input, path, words, [&path] { load_volume(path); });
}

void expect_bad(const std::string& name, const std::string& content,
                const std::vector<std::string>& words) {
  expect_bad(write_file(name, content), words);
}

/// `text` with `from`, which must be in it, replaced.
std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(BadVolume, FilesThatAreNone) {
  expect_bad(test::scratch_folder() / "absent.nrrd", {"there is no such file", "Check the path"});
  const fs::path folder = test::scratch_folder() / "folder.mha";
  fs::create_directory(folder);
  expect_bad(folder, {"directory"});
  const fs::path pipe = test::scratch_folder() / "pipe.nii";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  expect_bad(pipe, {"not a regular file"});
  for (const char* name : {"empty.nrrd", "empty.mha", "empty.nii", "empty.nii.gz"}) {
    expect_bad(name, "", {"empty", "Export"});
  }
  expect_bad("v.raw", "abc", {"\".raw\" is not a volume format", ".nrrd", ".nii.gz", "dimensions"});
  expect_bad("v.gz", "\x1f\x8b", {"\".gz\" is not", "gzip archive"});
  expect_bad("v", "NRRD0004\n", {"no extension", "looks like NRRD"});
  if (!reads_openvdb()) expect_bad("v.vdb", "\x20\x42\x44\x56", {"does not read OpenVDB", "NRRD"});
}

TEST(BadVolume, FilesOfAnotherFormatThanTheirName) {
  expect_bad("v.mha", "NRRD0004\n", {"named as MetaImage", "looks like NRRD"});
  expect_bad("v.nrrd", "ObjectType = Image\nNDims = 3\nDimSize = 1 1 1\n",
             {"looks like MetaImage"});
  expect_bad("v.nrrd", std::string(128, '\0').append("DICM"), {"looks like DICOM", "export"});
  expect_bad("v.nii", "\x89PNG\r\n", {"named as NIfTI", "PNG"});
  expect_bad("v.nrrd", "whatever\n", {"line 1", "NRRD0001"});
  expect_bad("v.mhd", "whatever\n", {"line 1", "Name = value"});
  expect_bad("v.nii", std::string(400, 'x'), {"348", "not NIfTI"});
  expect_bad("v.nii.gz", "\x1f\x8bxxxxxxxxxxxxxxxxx", {"byte", "damaged"});
}

/// Files of other programs are named by their first bytes, all of which count.
TEST(BadVolume, NamesWhatAFileLooksLike) {
  using std::string_literals::operator""s;
  for (const auto& [bytes, name] :
       {std::pair("II*\0"s, "a TIFF image"), std::pair("MM\0*"s, "a TIFF image"),
        std::pair("\x89PNG\r\n"s, "a PNG image"), std::pair("\x89HDF\r\n"s, "HDF5"),
        std::pair("PK\x03\x04"s, "a ZIP archive"), std::pair("\x20\x42\x44\x56"s, "OpenVDB"),
        std::pair("# vtk DataFile Version 3.0\n"s, "legacy VTK"),
        std::pair("<html>"s, "XML or HTML"), std::pair(std::string(344, '\0') + "n+1", "NIfTI")}) {
    expect_bad("v.nrrd", bytes + std::string(400, ' '), {"looks like " + std::string(name)});
  }
  expect_bad("v.nrrd", "MMM\n", {"line 1", "NRRD0001"});
}

// ---- NRRD ---------------------------------------------------------------------------------------

const std::string good_nrrd =
    "NRRD0004\ntype: short\ndimension: 3\nsizes: 3 2 2\nspace directions: (1,0,0) (0,2,0) (0,0,3)\n"
    "kinds: domain domain domain\nencoding: raw\nendian: little\nspace origin: (5,6,7)\n\n"
    "abcdefghijklmnopqrstuvwx";

void expect_bad_nrrd(const std::string& from, const std::string& to,
                     const std::vector<std::string>& words) {
  expect_bad("bad.nrrd", with(good_nrrd, from, to), words);
}

TEST(BadVolume, NrrdHeaders) {
  EXPECT_EQ(load_volume(write_file("good.nrrd", good_nrrd)).voxels.size(), 24u);
  expect_bad_nrrd("NRRD0004", "NRRD0009", {"line 1", "NRRD0005"});
  expect_bad_nrrd("type: short\n", "", {"no field \"type\"", "Add a line", "type: uint8"});
  expect_bad_nrrd("sizes: 3 2 2\n", "", {"no field \"sizes\""});
  expect_bad_nrrd("encoding: raw\n", "", {"no field \"encoding\""});
  expect_bad_nrrd("endian: little\n", "", {"no field \"endian\"", "endian: little"});
  expect_bad_nrrd("endian: little", "endian: middle", {"line 8 (endian)", "\"middle\""});
  expect_bad_nrrd("type: short", "type: int64", {"line 2 (type)", "int64", "32-bit"});
  expect_bad_nrrd("type: short", "type: block", {"block"});
  expect_bad_nrrd("dimension: 3", "dimension: 2", {"2 dimensions", "three dimensions"});
  expect_bad_nrrd("dimension: 3", "dimension: x", {"line 3", "\"x\"", "whole number"});
  expect_bad_nrrd("sizes: 3 2 2", "sizes: 3 2", {"line 4 (sizes)", "2 entries for 3"});
  expect_bad_nrrd("sizes: 3 2 2", "sizes: 3 0 2", {"line 4 (sizes)", "size is 0"});
  expect_bad_nrrd("sizes: 3 2 2", "sizes: 3 -2 2", {"line 4 (sizes)", "\"-2\""});
  expect_bad_nrrd("sizes: 3 2 2", "sizes: 4294967296 1 1", {"4294967296", "4294967295"});
  expect_bad_nrrd("sizes: 3 2 2", "sizes: 4294967295 4294967295 4294967295",
                  {"more than can be addressed"});
  expect_bad_nrrd("encoding: raw", "encoding: bzip2", {"bzip2", "raw, gzip or text"});
  expect_bad_nrrd("encoding: raw", "encoding: hex", {"hex", "raw, gzip or text"});
  expect_bad_nrrd("(0,2,0)", "(0,2)", {"line 5 (space directions)", "(0,2)", "three"});
  expect_bad_nrrd("(0,2,0)", "(0,two,0)", {"line 5", "(0,two,0)"});
  expect_bad_nrrd("(0,2,0)", "(0,0,0)", {"line 5", "axis 1", "zero"});
  expect_bad_nrrd("(0,2,0)", "(2,0,0)", {"line 5", "plane"});
  expect_bad_nrrd("(0,2,0)", "(0,inf,0)", {"line 5", "axis 1", "finite"});
  expect_bad_nrrd("(0,2,0)", "none", {"2 values a voxel"});
  expect_bad_nrrd("(5,6,7)", "(5,nan,7)", {"origin"});
  expect_bad_nrrd("kinds: domain", "kinds: vector",
                  {"line 4 (sizes)", "3 values a voxel", "vector"});
  expect_bad_nrrd("space origin", "space orange", {"line 9", "space orange", "not a field"});
  expect_bad_nrrd("space origin", "sizes", {"line 9", "twice"});
  expect_bad_nrrd("space origin", "space", {"does not know the space"});
  expect_bad_nrrd("space origin: (5,6,7)", "line without colon", {"line 9", "neither a field"});
  expect_bad_nrrd("space origin: (5,6,7)", "spacings: 1 x 1", {"line 9 (spacings)", "numbers"});
  expect_bad_nrrd("space origin: (5,6,7)", "space dimension: 2", {"2 dimensions"});
  expect_bad("bad.nrrd", good_nrrd.substr(0, 67), {"blank line", "truncated"});
  expect_bad("bad.nrrd", "NRRD0004\n" + std::string(2 << 20, '#'), {"MiB"});
}

TEST(BadVolume, NrrdSeriesAndVectors) {
  const auto bad = [](const std::string& lines, const std::vector<std::string>& words) {
    expect_bad("four.nrrd",
               "NRRD0004\ntype: uchar\ndimension: 4\nencoding: raw\n" + lines + "\nabcdefghijkl",
               words);
  };
  bad("sizes: 3 2 2 1\nkinds: vector domain domain domain\n",
      {"3 values a voxel", "one component"});
  bad("sizes: 3 1 2 2\nkinds: domain domain domain time\n", {"2 time steps", "Save one time step"});
  bad("sizes: 3 2 2 5\n", {"4 dimensions have more than one sample", "Save one time step"});
  bad("sizes: 1 1 3 4\nkinds: stub scalar domain domain\n", {"only 2 dimensions are of space"});
}

TEST(BadVolume, NrrdData) {
  expect_bad("bad.nrrd", good_nrrd.substr(0, good_nrrd.size() - 1),
             {"3 x 2 x 2 i16 = 24 bytes", "has 23", "truncated"});
  const auto gzip = [](const std::string& data) {
    const std::string raw = with(good_nrrd, "encoding: raw", "encoding: gzip");
    return raw.substr(0, raw.find("\n\n") + 2) + data;
  };
  expect_bad("bad.nrrd", gzip(test::packed("abc", true)), {"24 bytes", "has 3"});
  const std::string whole = test::packed("abcdefghijklmnopqrstuvwx", true);
  expect_bad("bad.nrrd", gzip(whole.substr(0, 20)), {"byte", "stop before their end", "truncated"});
  expect_bad("bad.nrrd", gzip("not gzip at all"), {"byte", "damaged"});
  std::string flipped = whole;
  flipped[flipped.size() - 6] ^= 1;  // of the checksum
  expect_bad("bad.nrrd", gzip(flipped), {"damaged"});
  const auto text = [](const std::string& data) {
    const std::string raw = with(good_nrrd, "encoding: raw", "encoding: text");
    return raw.substr(0, raw.find("\n\n") + 2) + data;
  };
  expect_bad("bad.nrrd", text("1 2 3"), {"bytes of text", "truncated"});
  expect_bad("bad.nrrd", text("1 2 3 4 5 6 7 8 9 10 11        "), {"12 values", "there are 11"});
  expect_bad("bad.nrrd", text("1 2 3 4 5 6 7 8 9 10 11 40000"), {"voxel 11", "40000", "i16"});
  expect_bad("bad.nrrd", text("1 2 3 4 5 six 7 8 9 10 11 12"), {"voxel 5", "\"six\""});
  expect_bad("bad.nrrd", text("1 2 3 4 5 6.5 7 8 9 10 11 12"), {"voxel 5", "6.5"});
}

TEST(BadVolume, NrrdClaimsOfMoreThanTheFileCanHold) {
  const fs::path fuzz = test::test_data("fuzz") / "nrrd";
  expect_bad(fuzz / "huge_raw.nrrd", {"4096 x 4096 x 4096 f32 = 274877906944 bytes", "has 4"});
  expect_bad(fuzz / "huge_gzip.nrrd", {"274877906944 bytes", "has at most"});
  expect_bad(fuzz / "huge_text.nrrd", {"137438953471 bytes", "7 bytes of text"});
}

TEST(BadVolume, NrrdDetachedData) {
  const std::string header = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n";
  expect_bad("d.nhdr", header + "data file: absent.raw\n",
             {"absent.raw", "no such file", "beside the header"});
  // The two in one folder.
  const fs::path folder = write_file("short.raw", "1234567").parent_path();
  const auto bad = [&folder](const std::string& content, const std::vector<std::string>& words) {
    std::ofstream(folder / "d.nhdr", std::ios::binary) << content;
    expect_bad(folder / "d.nhdr", words);
  };
  bad(header + "data file: short.raw\n", {"8 bytes", "has 7", "data file"});
  bad(header + "data file: LIST\na.raw\n", {"a.raw", "no such file"});
  bad(header + "data file: LIST\n", {"line 6", "no names"});
  bad(header + "data file: LIST\nshort.raw\nshort.raw\nshort.raw\n", {"evenly", "3 files"});
  bad(header + "data file: LIST\nshort.raw\n", {"short.raw", "8 bytes", "has 7"});
  bad(header + "byte skip: 4\ndata file: LIST\nshort.raw\nshort.raw\n", {"4 bytes", "has 3"});
  bad(header + "data file: slice%03d.raw 1 2 1\n", {"slice001.raw", "no such file"});
  bad(header + "data file: slice%03d.raw 1 2\n", {"line 6", "range of file numbers"});
  bad(header + "data file: slice%03d.raw 1 9999999999 1\n", {"line 6", "range of file numbers"});
  bad(header + "data file: slice%03d.raw 1 2 1 2 3\n", {"line 6", "range of file numbers"});
  bad(header + "data file: slice%03d.raw 1 2 0\n", {"line 6", "range of file numbers"});
  bad(header + "data file: slice%03d.raw 2 1 1\n", {"line 6", "range of file numbers"});
  bad(header + "data file: slice%03d.raw 1 2 -1\n", {"line 6", "range of file numbers"});
  bad(header + "data file: slice%03d.raw 1 two 1\n", {"line 6", "range of file numbers"});
  // 2^20 files are too many; numbers from 2^40 on are none, whatever their count.
  bad(header + "data file: slice%03d.raw 1 1048577 1\n", {"line 6", "range of file numbers"});
  bad(header + "data file: slice%03d.raw 1099511627776 1099511627776 1\n",
      {"line 6", "range of file numbers"});
  bad(header + "data file: slice%d.raw 1099511627775 1099511627775 1\n",
      {"slice1099511627775.raw", "no such file"});
  bad(header + "data file: slice%20d.raw 1 1 1\n", {"slice                   1.raw"});
  bad(header + "data file: slice%21d.raw 1 1 1\n", {"line 6", "no placeholder"});
  bad(header + "data file: slice%-3d.raw 1 1 1\n", {"line 6", "no placeholder"});
  bad(header + "data file: slice%04d.raw -7 -7 1\n", {"slice-007.raw", "no such file"});
  bad(header + "data file: slice%s.raw 1 2 1\n", {"line 6", "no placeholder"});
  bad(header + "data file: slice%999999999d.raw 1 2 1\n", {"line 6", "no placeholder"});
  bad(header + "data file: short.raw\nline skip: 3\n", {"fewer lines"});
  bad(header + "data file: short.raw\nbyte skip: 8\n", {"8 bytes", "have 7"});
  bad(header + "data file: short.raw\nbyte skip: -2\n", {"\"-2\""});
  bad(header + "data file: .\n", {"directory"});
  bad(with(header, "raw", "gzip") + "data file: short.raw\nbyte skip: -1\n",
      {"only valid for raw encoding"});
}

// ---- MetaImage ----------------------------------------------------------------------------------

const std::string good_meta =
    "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
    "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 5 6 7\nElementSpacing = 1 2 3\nDimSize = 3 2 2\n"
    "ElementType = MET_SHORT\nElementDataFile = LOCAL\nabcdefghijklmnopqrstuvwx";

void expect_bad_meta(const std::string& from, const std::string& to,
                     const std::vector<std::string>& words) {
  expect_bad("bad.mha", with(good_meta, from, to), words);
}

TEST(BadVolume, MetaImage) {
  EXPECT_EQ(load_volume(write_file("good.mha", good_meta)).voxels.size(), 24u);
  expect_bad_meta("= Image", "= Mesh", {"line 1 (ObjectType)", "Mesh", "not an Image"});
  expect_bad_meta("NDims = 3\n", "", {"no field \"NDims\"", "NDims = 3"});
  expect_bad_meta("NDims = 3", "NDims = 2", {"line 2 (NDims)", "three dimensions"});
  expect_bad_meta("BinaryData = True", "BinaryData = Yes", {"line 3", "True nor False"});
  expect_bad_meta("Offset = 5 6 7", "Offset = 5 6", {"line 6 (Offset)", "3 numbers"});
  expect_bad_meta("Offset", "NDims", {"line 6", "twice"});
  expect_bad_meta("1 0 0 0 1 0", "1 0 0 1 0 0", {"plane"});
  expect_bad_meta("ElementSpacing = 1 2 3", "ElementSpacing = 1 0 3", {"line 7", "axis 1", "zero"});
  expect_bad_meta("DimSize = 3 2 2", "DimSize = 3 2 0", {"line 8 (DimSize)", "size is 0"});
  expect_bad_meta("DimSize = 3 2 2", "DimSize = 3 2", {"line 8 (DimSize)", "2 entries for 3"});
  expect_bad_meta("DimSize = 3 2 2", "DimSize = 3 2 2.5", {"line 8 (DimSize)", "\"2.5\""});
  expect_bad_meta("NDims = 3\nBinaryData = True\n", "NDims = 4\n", {"3 entries for 4"});
  expect_bad_meta("MET_SHORT", "MET_LONG_LONG", {"line 9 (ElementType)", "32-bit"});
  expect_bad_meta("MET_SHORT", "MET_FLOAT_ARRAY", {"several values a voxel"});
  expect_bad_meta("MET_SHORT", "MET_SHORT\nElementNumberOfChannels = 3",
                  {"3 values a voxel", "one component"});
  expect_bad_meta("ElementDataFile = LOCAL\n", "", {"line 10"});
  expect_bad("bad.mha", good_meta.substr(0, 29), {"ElementDataFile", "truncated"});
  expect_bad_meta("vwx", "", {"24 bytes", "has 21", "truncated"});
  expect_bad_meta("= LOCAL", "= LIST", {"several files", ".mha"});
  expect_bad_meta("= LOCAL", "= s%03d.raw 1 2 1", {"several files"});
  expect_bad_meta("= LOCAL", "=", {"names no file"});
  expect_bad_meta("= LOCAL", "= absent.raw", {"absent.raw", "no such file", "beside"});
  expect_bad_meta("ElementType", "HeaderSize = 99\nElementType", {"99 bytes", "have 24"});
  expect_bad_meta("ElementType", "HeaderSize = -7\nElementType", {"\"-7\""});
  expect_bad_meta("ElementType", "CompressedData = True\nElementType", {"damaged"});
  expect_bad_meta("ElementType", "CompressedData = True\nHeaderSize = -1\nElementType",
                  {"only valid for uncompressed data"});
  expect_bad_meta("BinaryData = True", "BinaryData = False\nCompressedData = True",
                  {"text cannot be compressed"});
  const std::string four =
      with(with(with(with(good_meta, "NDims = 3", "NDims = 4"), "3 2 2", "3 2 2 5"),
                "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 5 6 7\n", ""),
           "ElementSpacing = 1 2 3\n", "");
  expect_bad("four.mha", four, {"dimension 3 has size 5", "one time step"});
}

// ---- NIfTI --------------------------------------------------------------------------------------

test::NiftiFile good_nifti(bool second) {
  test::NiftiFile file;
  file.second = second;
  file.dim = {3, 3, 2, 2, 1, 1, 1, 1};
  file.datatype = 4;
  return file;
}

TEST(BadVolume, Nifti) {
  const std::string voxels = "abcdefghijklmnopqrstuvwx";
  for (const bool second : {false, true}) {
    for (const ByteOrder order : {ByteOrder::little, ByteOrder::big}) {
      test::NiftiFile good = good_nifti(second);
      good.order = order;
      const auto bad = [&](auto change, const std::vector<std::string>& words) {
        test::NiftiFile file = good;
        change(file);
        expect_bad("bad.nii", file.text(voxels), words);
        expect_bad("bad.nii.gz", test::packed(file.text(voxels), true), words);
      };
      using File = test::NiftiFile;
      EXPECT_EQ(load_volume(write_file("good.nii", good.text(voxels))).voxels.size(), 24u);
      bad(
          [](File& f) {
            f.magic = "ni";
            f.magic += f.second ? "2" : "1";
          },
          {"magic", "two files"});
      bad([](File& f) { f.magic = "abc"; }, {"magic", "Analyze"});
      bad([](File& f) { f.dim[0] = 2; }, {"dim[0]", "2 dimensions"});
      bad([](File& f) { f.dim[0] = 8; }, {"dim[0]"});
      bad([](File& f) { f.dim[0] = -3; }, {"dim[0]"});
      bad([](File& f) { f.dim[2] = 0; }, {"dim", "size is 0"});
      bad([](File& f) { f.dim[2] = -4; }, {"dim[2]", "-4"});
      bad([](File& f) { f.dim = {4, 3, 2, 1, 2, 1, 1, 1}; },
          {"dim[4]", "2 time steps", "one time step"});
      bad([](File& f) { f.dim = {5, 2, 2, 1, 1, 3, 1, 1}; }, {"dim[5]", "3 values a voxel"});
      bad([](File& f) { f.dim[3] = 3; }, {"3 x 2 x 3 i16 = 36 bytes", "24"});
      bad([](File& f) { f.datatype = 1024; }, {"datatype", "code 1024", "32-bit"});
      bad([](File& f) { f.datatype = 128; }, {"datatype", "several values"});
      bad([](File& f) { f.datatype = 32; }, {"datatype", "several values"});
      bad([](File& f) { f.datatype = 0; }, {"datatype", "code 0"});
      bad([](File& f) { f.offset = -100; }, {"vox_offset"});
      bad([](File& f) { f.offset = 1e15; }, {"vox_offset"});
      bad([](File& f) { f.offset = 100000; }, {"24 bytes", "0"});
      expect_bad("bad.nii", good.text(voxels.substr(1)), {"24 bytes", "has 23", "truncated"});
      expect_bad("bad.nii", good.text("").substr(0, 300), {"header", "has 300", "truncated"});
    }
  }
  expect_bad("bad.nii", "\x5c\x01", {"2 bytes", "truncated"});
  test::NiftiFile huge = good_nifti(true);
  huge.dim = {3, 4096, 4096, 4096, 1, 1, 1, 1};
  expect_bad("huge.nii.gz", test::packed(huge.text(voxels), true),
             {"137438953472 bytes", "at most"});
  huge.dim = {3, 1LL << 33, 1, 1, 1, 1, 1, 1};
  expect_bad("huge.nii", huge.text(voxels), {"more than can be addressed"});
}

// ---- raw ----------------------------------------------------------------------------------------

TEST(BadVolume, Raw) {
  const fs::path path = write_file("v.raw", std::string(100, 'x'));
  const auto bad = [&path](ErrorCode code, const RawVolumeLayout& layout,
                           const std::vector<std::string>& words) {
    expect_error(code, path, words, [&] { load_raw_volume(path, layout); });
  };
  EXPECT_EQ(load_raw_volume(path, {.size = {5, 5, 4}}).voxels.size(), 100u);
  bad(ErrorCode::input, {.size = {5, 5, 5}},
      {"5 x 5 x 5 of u8", "125 bytes", "has 100", "Correct the dimensions"});
  bad(ErrorCode::input, {.size = {5, 5, 3}}, {"75 bytes", "has 100", "header bytes to skip"});
  bad(ErrorCode::input, {.size = {5, 5, 4}, .header_bytes = 1}, {"after a header of 1", "has 100"});
  bad(ErrorCode::input, {.size = {5, 5, 4}, .header_bytes = 1000}, {"after a header of 1000"});
  bad(ErrorCode::input, {.size = {5, 5, 5}, .header_bytes = -1}, {"125 bytes", "has 100"});
  bad(ErrorCode::input, {.size = {4294967295, 4294967295, 4294967295}}, {"addressed"});
  bad(ErrorCode::usage, {.size = {5, 0, 5}}, {"5 x 0 x 5", "from 1"});
  bad(ErrorCode::usage, {.size = {4294967296, 1, 1}}, {"4294967295"});
  bad(ErrorCode::usage, {.size = {5, 5, 4}, .spacing = {1, 0, 1}}, {"axis 1", "spacing"});
  bad(ErrorCode::usage, {.size = {5, 5, 4}, .spacing = {1, -1, 1}}, {"axis 1", "spacing"});
  bad(ErrorCode::usage,
      {.size = {5, 5, 4}, .spacing = {1, 1, std::numeric_limits<double>::quiet_NaN()}}, {"axis 2"});
  bad(ErrorCode::usage, {.size = {5, 5, 4}, .header_bytes = -2}, {"-2 bytes"});
  expect_error(ErrorCode::input, "absent.raw", {"no such file"}, [] {
    load_raw_volume("absent.raw", {.size = {1, 1, 1}});
  });
}

// ---- what a fuzzer found, and what it starts from -----------------------------------------------

TEST(BadVolume, HardCasesGiveAVolumeOrAnError) {
  int files = 0;
  for (const auto& [name, format] :
       {std::pair{"nrrd", VolumeFormat::nrrd}, std::pair{"mhd", VolumeFormat::meta_image},
        std::pair{"nii", VolumeFormat::nifti}}) {
    for (const auto& entry : fs::directory_iterator(test::test_data("fuzz") / name)) {
      SCOPED_TRACE(entry.path());
      const std::string bytes = test::read_file(entry.path());
      const auto source = bytes_in_memory(bytes);
      try {
        const VolumeInput input{entry.path().string(), source.get(), nullptr, {}};
        EXPECT_EQ(test::broken_promise(parse_volume(input, format)), "");
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::input);
      }
      ++files;
    }
  }
  EXPECT_GE(files, 32);
}

}  // namespace
}  // namespace kiln
