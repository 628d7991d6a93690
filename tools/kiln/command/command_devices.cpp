#include <cstdio>
#include <memory>

#include "arguments/command_options.h"
#include "cl/driver_state.h"
#include "commands.h"
#include "job/describe.h"
#include "kiln/kiln.h"
#include "options/json.h"
#include "options/option_table.h"
#include "report/console.h"

namespace kiln::cli {
namespace {

/// Result of the device's self-test, or why it cannot be opened; empty: it computes as it should.
std::string fault_of(const DeviceInfo& info) {
  try {
    Device::open(std::to_string(info.index));
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

void print(const DeviceInfo& info) {
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
  if (may_wait_for_itself(info)) {
    print_line(stdout,
               "   may wait for itself without end where several threads use it, as plans do: "
               "choose PoCL's pthread (POCL_DEVICES=pthread)");
  }
  std::fflush(stdout);  // what comes next may crash
  const std::string fault = fault_of(info);
  print_line(stdout, "   computes as it should: " + (fault.empty() ? "yes" : "no. " + fault));
}

}  // namespace

Run add_devices(Command& app) {
  Command* command = app.add_command("devices", "List the OpenCL devices");
  struct Arguments {
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  const OptionRow rows[] = {
      {.flag = "--json", .value = toggle(KILN_MEMBER(Arguments, json)), .help = "Print JSON"}};
  add_options(*command, rows, arguments.get());
  return [arguments] {
    const std::vector<DeviceInfo> devices = list_devices();
    if (arguments->json) {
      Json list = Json::array();
      for (const DeviceInfo& info : devices) {
        Json entry = describe(info);
        entry["fault"] = fault_of(info);
        list.push_back(entry);
      }
      std::fputs(to_text(list).c_str(), stdout);
      return 0;
    }
    if (devices.empty()) Device::open();  // says how to get one
    for (const DeviceInfo& info : devices) print(info);
    const Device chosen = Device::open();
    Console console(/*quiet=*/false);
    for (const Warning& warning : kernel_folder_warnings()) console.warning(warning.message);
    std::printf("In use: %d (choose with --device or KILN_DEVICE, by index or part of the name)\n",
                chosen.info().index);
    return 0;
  };
}

}  // namespace kiln::cli
