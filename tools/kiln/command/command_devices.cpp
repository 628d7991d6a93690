#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "accel/tune.h"
#include "arguments/command_options.h"
#include "base/file.h"
#include "base/stopwatch.h"
#include "cl/driver_state.h"
#include "cl/kernel_folder.h"
#include "cl/tuning.h"
#include "commands.h"
#include "job/describe.h"
#include "kiln/job.h"
#include "kiln/options.h"
#include "kiln/version.h"
#include "options/json.h"
#include "options/option_table.h"
#include "options/parse.h"
#include "report/console.h"

namespace kiln::cli {
namespace {

/// Returns the reason why a device cannot be opened or fails its self-test; empty if it passes.
std::string device_failure(const DeviceInfo& info) {
  try {
    Device::open(std::to_string(info.index));
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

void print_device(const DeviceInfo& info) {
  const auto gib = [](std::uint64_t bytes) { return static_cast<double>(bytes) / (1ULL << 30); };
  print_line(stdout, std::to_string(info.index) + "  " + info.name);
  print_line(stdout, std::string("   ") + (info.is_gpu ? "GPU" : "CPU") + ", " + info.platform +
                         ", driver " + info.driver + ", " + std::to_string(info.compute_units) +
                         " compute units");
  std::printf("   memory %.1f GiB, largest buffer %.1f GiB, 64-bit atomics: %s\n",
              gib(info.memory_bytes), gib(info.largest_buffer_bytes),
              info.has_atomics_64 ? "yes" : "no");
  std::printf("   division and root rounded correctly: %s\n",
              info.has_correct_division
                  ? "yes"
                  : "no (maps may differ in the last bit from other devices)");
  if (may_deadlock(info)) {
    print_line(stdout,
               "   may deadlock if several threads use it, as plans do: choose PoCL's pthread "
               "device (POCL_DEVICES=pthread)");
  }
  std::fflush(stdout);  // The output is flushed, since the driver may crash next.
  const std::string fault = device_failure(info);
  print_line(stdout, "   computes as it should: " + (fault.empty() ? "yes" : "no. " + fault));
}

/// Makes a bumpy grid over the unit square with UVs and colours, from which every map can be baked.
/// \param height  height of the bumps
/// \param shift   how far the bumps lean over; more than a square makes folds, in which rays have several hits
Mesh make_bumpy_grid(std::uint32_t squares, float height, float shift) {
  Mesh mesh;
  mesh.name = "sheet";
  const std::uint32_t side_vertices = squares + 1;
  for (std::uint32_t i = 0; i < side_vertices * side_vertices; ++i) {
    const float u = static_cast<float>(i % side_vertices) / static_cast<float>(squares),
                v = static_cast<float>(i / side_vertices) / static_cast<float>(squares);
    const bool is_odd = (i % side_vertices + i / side_vertices) % 2 != 0;
    mesh.positions.push_back({is_odd ? u + shift : u, v, is_odd ? height : 0});
    mesh.uvs.push_back({u, v});
    mesh.colors.push_back({128, 160, 192, 255});
  }
  for (std::uint32_t i = 0; i < squares * squares; ++i) {
    const std::uint32_t a = i / squares * side_vertices + i % squares, b = a + 1,
                        c = a + side_vertices, d = c + 1;
    mesh.triangles.push_back({a, b, d});
    mesh.triangles.push_back({a, d, c});
  }
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

/// Lets all users read the files of a folder. PoCL restricts them to their owner, but the image of a container serves
/// any user.
void allow_all_users_to_read(const std::filesystem::path& folder) {
  using std::filesystem::perms;
  constexpr perms kFile = perms::owner_read | perms::group_read | perms::others_read;
  constexpr perms kFolder = kFile | perms::owner_exec | perms::group_exec | perms::others_exec;
  std::error_code ignored;
  const auto add = [&](const std::filesystem::path& path, perms rights) {
    std::filesystem::permissions(path, rights, std::filesystem::perm_options::add, ignored);
  };
  add(folder, kFolder);
  for (std::filesystem::recursive_directory_iterator file_entry(folder, ignored), end;
       !ignored && file_entry != end; file_entry.increment(ignored)) {
    std::error_code ignored_error;
    add(file_entry->path(), file_entry->is_directory(ignored_error) ? kFolder : kFile);
  }
}

/// Bakes a small sheet, so that the device's kernels for these maps are compiled and cached. \throws Error(usage) for
/// unknown maps
int warm_kernel_cache(const std::string& device, const std::vector<std::string>& maps) {
  constexpr std::uint32_t kTexels = 16, kGridSquares = 8;
  constexpr float kBumpHeight = 0.02F, kBumpLean = 1.2F / kGridSquares;
  Job job;
  job.high.emplace_back(make_bumpy_grid(kGridSquares, kBumpHeight, kBumpLean));
  job.low = JobLow(make_bumpy_grid(1, 0, 0));
  job.out = "warm";
  job.in_memory = true;
  job.bake.width = job.bake.height = kTexels;
  if (!maps.empty()) set_option(job, "maps", maps);
  // Only the folder in POCL_CACHE_DIR is opened to all users; the default one lies in a home folder.
  const char* const variable = std::getenv("POCL_CACHE_DIR");
  const std::string cache_folder = variable != nullptr ? variable : "";
  const Stopwatch watch;
  const Device opened_device = Device::open(device);
  const JobResult result = run(opened_device, job);
  Console console(/*quiet=*/false);
  for (const Warning& warning : kernel_folder_warnings()) console.warning(warning.message);
  if (!cache_folder.empty()) allow_all_users_to_read(cache_folder);
  std::string map_names;
  for (const JobMap& map : result.maps) map_names += (map_names.empty() ? "" : ", ") + map.name;
  console.line(opened_device.info().name + ": kernels of " + map_names + " are in '" +
               ocl::kernel_folder().kiln.parent_path().string() +
               formatted("', %.1f s", watch.total()));
  return 0;
}

std::string milliseconds(double seconds) { return formatted("%.2f", seconds * 1000); }

std::string group_words(std::uint32_t size) { return size == 0 ? "default" : std::to_string(size); }

/// Prints what was measured as tables.
void print_measurements(const tune::Result& result) {
  std::printf("%-20s %12s %12s %12s %12s\n", "BVH (ms)", "host: build", "rays", "device: build",
              "rays");
  for (const tune::BuildTrial& trial : result.builds) {
    std::printf("%-20s %12s %12s %12s %12s  %s\n",
                (std::to_string(trial.triangles) + " triangles").c_str(),
                milliseconds(trial.host_build).c_str(), milliseconds(trial.host_rays).c_str(),
                trial.can_device_build ? milliseconds(trial.device_build).c_str() : "-",
                trial.can_device_build ? milliseconds(trial.device_rays).c_str() : "-",
                trial.is_device_faster() ? "device" : "host");
  }
  std::printf("%-20s %s\n", "kernels (ms)", "work-group size: time");
  for (const tune::GroupTrial& trial : result.groups) {
    std::string row;
    for (std::size_t i = 0; i < trial.sizes.size(); ++i)
      row += group_words(trial.sizes[i]) + ": " + milliseconds(trial.seconds[i]) + "  ";
    std::printf("%-20s %s-> %s\n", trial.name.c_str(), row.c_str(),
                group_words(trial.best).c_str());
  }
}

/// Describes the measurements and the choices as JSON. \param file  file in which the choices are stored
Json describe_tuning(const DeviceInfo& device, const tune::Result& result,
                     const std::filesystem::path& file) {
  const ocl::Tuning& tuning = result.tuning;
  const auto size_or_null = [](std::uint32_t size) { return size == 0 ? Json() : Json(size); };
  Json report = Json::object();
  report["device"] = device.name;
  report["platform"] = device.platform;
  report["driver"] = device.driver;
  report["kiln"] = version();
  report["min_device_build_triangles"] = tuning.min_device_build_triangles == ocl::Tuning::kNever
                                             ? Json()
                                             : Json(tuning.min_device_build_triangles);
  report["ray_group"] = size_or_null(tuning.ray_group);
  report["closest_group"] = size_or_null(tuning.closest_group);
  report["occlusion_group"] = size_or_null(tuning.occlusion_group);
  report["raster_group"] = size_or_null(tuning.raster_group);
  report["view_group"] = size_or_null(tuning.view_group);
  report["file"] = file.string();
  report["builds"] = Json::array();
  for (const tune::BuildTrial& trial : result.builds) {
    Json row = Json::object();
    row["triangles"] = trial.triangles;
    row["host_build_seconds"] = trial.host_build;
    row["host_rays_seconds"] = trial.host_rays;
    row["device_build_seconds"] = trial.can_device_build ? Json(trial.device_build) : Json();
    row["device_rays_seconds"] = trial.can_device_build ? Json(trial.device_rays) : Json();
    row["builder"] = trial.is_device_faster() ? "device" : "host";
    report["builds"].push_back(row);
  }
  report["groups"] = Json::array();
  for (const tune::GroupTrial& trial : result.groups) {
    for (std::size_t i = 0; i < trial.sizes.size(); ++i) {
      Json row = Json::object();
      row["kernels"] = trial.key;
      row["size"] = size_or_null(trial.sizes[i]);
      row["seconds"] = trial.seconds[i];
      report["groups"].push_back(row);
    }
  }
  return report;
}

/// Measures a device, and stores the fastest choices, which later runs use.
int tune_device(const std::string& selector, std::uint32_t faces, bool json) {
  const Device device = Device::open(selector);
  Console console(/*quiet=*/false, json ? "-" : "");
  std::vector<std::string> stages;
  constexpr double kStages = 9;  // On GPUs; CPUs have one stage less
  const tune::Result result = tune::measure(context_of(device), faces, [&](std::string_view stage) {
    stages.emplace_back(stage);
    if (!console.progress(static_cast<double>(stages.size() - 1) / kStages, stage))
      throw Error(ErrorCode::cancelled, "Cancelled.");
  });
  console.progress(1, "");
  ocl::store_tuning(device.info(), result.tuning);
  const std::filesystem::path file = ocl::tuning_file(device.info());
  for (const Warning& warning : kernel_folder_warnings()) {
    // A file that was ignored is replaced now.
    if (warning.code != "tuning") console.warning(warning.message);
  }
  if (json) {
    std::fputs(to_text(describe_tuning(device.info(), result, file)).c_str(), stdout);
    return 0;
  }
  print_measurements(result);
  const std::uint64_t triangles = result.tuning.min_device_build_triangles;
  console.line(device.info().name + ": " +
               (triangles == ocl::Tuning::kNever ? std::string("the host builds every BVH")
                                                 : "the device builds BVHs of at least " +
                                                       std::to_string(triangles) + " triangles") +
               "; stored in '" + file.string() + "'");
  return 0;
}

}  // namespace

Run add_devices(Command& app) {
  Command* command = app.add_command("devices", "List the OpenCL devices");
  struct Arguments {
    bool json = false, warm = false, tune = false;
    std::vector<std::string> maps;
    std::string device;
    std::uint32_t tune_faces = 500000;
  };
  auto arguments = std::make_shared<Arguments>();
  const OptionRow rows[] = {
      {.flag = "--json", .value = toggle(KILN_MEMBER(Arguments, json)), .help = "Print JSON"},
      {.flag = "--warm",
       .value = toggle(KILN_MEMBER(Arguments, warm)),
       .help = "Compile and cache the kernels of --maps in advance, for container images"},
      {.flag = "--maps",
       .value = texts(KILN_MEMBER(Arguments, maps), ','),
       .help = "With --warm: maps whose kernels are compiled (default: normal)"},
      {.flag = "--tune",
       .value = toggle(KILN_MEMBER(Arguments, tune)),
       .help =
           "Measure which builder and work-group sizes are the fastest, and use them from now on"},
      {.flag = "--tune-faces",
       .value = integer(KILN_MEMBER(Arguments, tune_faces), 1000, 20000000),
       .help = "Triangles of the largest mesh that is measured (default: 500000)",
       .needs = "--tune"},
      device_row<Arguments>("")};
  add_options(*command, rows, arguments.get());
  return [arguments] {
    refuse_if(!arguments->warm && !arguments->maps.empty(), "--maps needs --warm: add it.");
    refuse_if(!arguments->warm && !arguments->tune && !arguments->device.empty(),
              "--device needs --warm or --tune: without them, all devices are listed.");
    refuse_if(arguments->warm && arguments->tune, "--warm and --tune exclude each other.");
    refuse_if(arguments->warm && arguments->json, "--warm writes no JSON: leave --json out.");
    if (arguments->tune) {
      return tune_device(arguments->device, arguments->tune_faces, arguments->json);
    }
    if (arguments->warm) return warm_kernel_cache(arguments->device, arguments->maps);
    const std::vector<DeviceInfo> devices = list_devices();
    if (arguments->json) {
      Json list = Json::array();
      for (const DeviceInfo& info : devices) {
        Json file_entry = describe(info);
        file_entry["fault"] = device_failure(info);
        list.push_back(file_entry);
      }
      std::fputs(to_text(list).c_str(), stdout);
      return 0;
    }
    if (devices.empty()) Device::open();  // Throws an error that says how to install a driver
    for (const DeviceInfo& info : devices) print_device(info);
    const Device chosen = Device::open();
    Console console(/*quiet=*/false);
    for (const Warning& warning : kernel_folder_warnings()) console.warning(warning.message);
    std::printf("In use: %d (choose with --device or KILN_DEVICE, by index or part of the name)\n",
                chosen.info().index);
    return 0;
  };
}

}  // namespace kiln::cli
