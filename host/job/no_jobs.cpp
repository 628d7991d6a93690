// Stubs for builds without file formats: each function throws an error that says so.
#include "kiln/asset.h"
#include "kiln/error.h"
#include "kiln/image.h"
#include "kiln/job.h"
#include "kiln/option_error.h"
#include "kiln/options.h"

namespace kiln {
namespace {

[[noreturn]] void fail() {
  throw Error(ErrorCode::usage,
              "Jobs need file formats, but this build of Kiln has none: build it with "
              "KILN_WITH_IO=ON, or call bake().",
              "no-files");
}

}  // namespace

std::vector<std::byte> encode_glb(const Mesh& /*low*/, std::span<const AssetMaterial> /*materials*/,
                                  const SaveAssetOptions& /*options*/) {
  fail();
}
JobResult run(const Device& /*device*/, const Job& /*job*/, const Progress& /*progress*/) {
  fail();
}
void check(const Job& /*job*/) { fail(); }
std::vector<std::filesystem::path> save_image(const BakedMap& /*map*/,
                                              const std::filesystem::path& /*path*/,
                                              const SaveImageOptions& /*options*/) {
  fail();
}
void set_option(Job& /*job*/, std::string_view /*name*/, std::string_view /*value*/) { fail(); }
void set_option(Job& /*job*/, std::string_view /*name*/,
                const std::vector<std::string>& /*values*/) {
  fail();
}
void set_options(Job& /*job*/, std::string_view /*json*/) { fail(); }
std::vector<std::string> option_values(const Job& /*job*/, std::string_view /*name*/) { fail(); }
bool is_given(const Job& /*job*/, std::string_view /*name*/) { fail(); }
std::string to_json(const Job& /*job*/) { fail(); }
Job job_from_json(std::string_view /*json*/) { fail(); }
std::string options_json() { fail(); }
std::string job_schema() { fail(); }

// This build has no table of options, so messages spell options by their names.
std::string option_as_flag(std::string_view name, std::string_view /*value*/) {
  return std::string(name);
}
std::string option_as_keyword(std::string_view name, std::string_view /*value*/) {
  return std::string(name);
}
std::string option_as_member(std::string_view name, std::string_view /*value*/) {
  return std::string(name);
}

}  // namespace kiln
