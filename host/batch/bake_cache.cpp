#include "batch/bake_cache.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <system_error>
#include <utility>

#include "asset/file_finder.h"
#include "asset/udim_files.h"
#include "base/file.h"
#include "base/process.h"
#include "batch/content_hash.h"
#include "io/file/atomic_file.h"
#include "job/files.h"
#include "job/job_options.h"
#include "kiln/error.h"
#include "kiln/files.h"
#include "kiln/options.h"
#include "kiln/version.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFormatVersion =
    // Version of the format of keys, records and entries. A new version invalidates all former ones.
    "1";
constexpr std::int64_t kCoarsestTimeResolution =
    2000000000;  // Coarsest time resolution of file systems (FAT's), in nanoseconds
constexpr std::size_t kMaxListsPerKey = 64;   // Maximum number of dependency lists per key
constexpr const char* kMissingFile = "none";  // Stands for the hash of a file that cannot be read

/// Returns the size, the times and the inode number of a file as text; empty if there is no file.
/// \param proves_unchanged  receives true if an equal state at a later time proves that the file has not changed
std::string state_of(const fs::path& path, bool& proves_unchanged) {
  const std::optional<os::FileStatus> facts = os::query_file(path);
  if (!facts || !facts->is_regular) return {};
  const auto current_time = std::chrono::duration_cast<std::chrono::nanoseconds>(
                                std::chrono::system_clock::now().time_since_epoch())
                                .count();
  // If a file has changed within the clock's resolution, or its time is in the future, the next change may give it the
  // same time.
  const std::int64_t last_change = std::max(facts->modified_ns, facts->changed_ns);
  proves_unchanged = facts->changed_ns != 0 && current_time - last_change > kCoarsestTimeResolution;
  return std::to_string(facts->bytes) + ":" + std::to_string(facts->modified_ns) + ":" +
         std::to_string(facts->changed_ns) + ":" + std::to_string(facts->id.device) + ":" +
         std::to_string(facts->id.file);
}

/// True if the source of a user-defined map has an #include. The OpenCL compiler reads the included files, so that
/// InputLog does not register them.
bool includes_files(const Job& job) {
  for (const std::string& map : job.own_maps) {
    std::ifstream in(map.substr(map.find('=') + 1), std::ios::binary);
    const std::string source(std::istreambuf_iterator<char>(in), {});
    if (source.find("include") != std::string::npos) return true;
  }
  return false;
}

std::string current_answer(const fs::path& path, const std::string& question) {
  if (question == kTilesAnswerKey) {
    const auto name = TileName::parse_token(path);
    std::string answer;
    if (name) {
      for (const std::uint32_t tile : name->files()) answer += std::to_string(tile) + " ";
    }
    return answer;
  }
  return FileFinder(path).find_by_name(
      question.substr(std::string_view(kNamedAnswerPrefix).size()));
}

}  // namespace

BakeCache::BakeCache(fs::path folder, fs::path records, std::unique_ptr<CacheStore> store)
    : given_folder_(folder),
      folder_(os::absolute_normal(folder.empty() ? fs::path(".") : folder)),
      records_(std::move(records)),
      store_(std::move(store)) {
  if (!folder_.has_filename()) folder_ = folder_.parent_path();
  // The program's bytes are part of the key, since two builds of one version may differ.
  program_ = std::string(version()) + " " + file_hash(os::own_program()).value_or("");
}

void BakeCache::set_device(const DeviceInfo& info) {
  device_class_ = info.platform + "|" + info.driver + "|" + (info.is_gpu ? info.name : "CPU") +
                  "|" + (info.has_correct_division ? "d" : "") + (info.has_denormals ? "n" : "") +
                  (info.has_atomics_64 ? "a" : "");
}

std::string BakeCache::relative(const fs::path& path) const {
  const std::string file = os::absolute_normal(path).generic_string();
  const std::string base = folder_.generic_string() + (folder_ == folder_.root_path() ? "" : "/");
  return file.starts_with(base) ? file.substr(base.size()) : file;
}

fs::path BakeCache::given_path(const std::string& path) const {
  return given_folder_.empty() ? fs::path(path) : os::join(given_folder_, path);
}

fs::path BakeCache::absolute_path(const std::string& path) const { return os::join(folder_, path); }

std::string BakeCache::identify(const fs::path& path) {
  return file_hash(path).value_or(kMissingFile);
}

/// Returns all options of an asset that affect its result, with paths relative to the job file's folder.
Json BakeCache::portable_options(const BatchAsset& asset) const {
  const Json json = Json::parse(to_json(asset.job));
  Json options = Json::object();
  const auto relative_path = [&](const OptionRow* row, const std::string& word) {
    if (row == nullptr) return word;
    return replace_path(*row, word, [&](const std::string& path) { return relative(path); });
  };
  for (const std::string& key : json.keys()) {
    // These options do not affect the result: the device's class is part of the key already.
    if (key == "quiet" || key == "device") continue;
    const OptionRow* const row = find_option_row(key);
    const Json& value = json.at(key);
    if (value.is_array()) {
      Json list = Json::array();
      for (const Json& element : value.elements()) {
        list.push_back(element.is_string() ? Json(relative_path(row, element.text())) : element);
      }
      options[key] = list;
    } else {
      options[key] = value.is_string() ? Json(relative_path(row, value.text())) : value;
    }
  }
  if (!asset.after.empty()) options["after"] = asset.after;
  return options.with_texts(escape_bytes);
}

std::string BakeCache::key_of(const Json& options) const {
  ContentHash hash;
  for (const std::string& part :
       {std::string(kFormatVersion), program_, device_class_, options.dump()}) {
    hash.add(std::string_view(part));
  }
  return hash.text();
}

fs::path BakeCache::record_path(const BatchAsset& asset) const {
  return records_ / (content_hash(asset.name) + ".json");
}

namespace {

Json pairs_json(const std::map<std::string, std::string>& pairs) {
  Json json = Json::array();
  for (const auto& [name, value] : pairs) json.push_back(Json::array({name, value}));
  return json;
}

bool is_texts(const Json& list, std::size_t count) {
  return list.is_array() && list.size() == count &&
         std::all_of(list.elements().begin(), list.elements().end(),
                     [](const Json& e) { return e.is_string(); });
}

}  // namespace

std::optional<BakeCache::Record> BakeCache::load(const BatchAsset& asset) const {
  std::ifstream in(record_path(asset), std::ios::binary);
  if (!in) return std::nullopt;
  const std::string text(std::istreambuf_iterator<char>(in), {});
  // A record begins with the hash of its other bytes, which detects truncation and changes.
  if (text.size() < 33 || content_hash(std::string_view(text).substr(33)) != text.substr(0, 32))
    return std::nullopt;
  Json json = Json::parse(std::string_view(text).substr(33));
  if (!json.is_object() || !json.at("asset").is_string() ||
      unescape_bytes(json.at("asset").text()) != asset.name) {
    return std::nullopt;
  }
  Record record;
  record.key = json.at("key").text();
  record.options = json.at("options");
  record.entry = json.at("entry").text();
  record.warnings = json.at("warnings");
  record.missed = json.at("missed").number();
  for (const auto& [name, files] :
       {std::pair{"inputs", &record.inputs}, std::pair{"outputs", &record.outputs}}) {
    for (const Json& file : json.at(name).elements()) {
      if (!is_texts(file, 3)) return std::nullopt;
      (*files)[unescape_bytes(file[0].text())] = {file[1].text(), file[2].text()};
    }
  }
  for (const Json& path : json.at("absent").elements())
    record.missing_files.push_back(unescape_bytes(path.text()));
  for (const Json& path : json.at("files").elements())
    record.files.push_back(unescape_bytes(path.text()));
  for (const Json& answer : json.at("answers").elements()) {
    if (!is_texts(answer, 3)) return std::nullopt;
    record.query_results[{unescape_bytes(answer[0].text()), unescape_bytes(answer[1].text())}] =
        unescape_bytes(answer[2].text());
  }
  return record;
}

void BakeCache::save(const BatchAsset& asset, const Record& record) const {
  Json json = {{"asset", asset.name},         {"key", record.key},
               {"options", record.options},   {"entry", record.entry},
               {"warnings", record.warnings}, {"inputs", Json::array()},
               {"outputs", Json::array()},    {"absent", record.missing_files},
               {"files", record.files},       {"answers", Json::array()},
               {"missed", record.missed}};
  for (const auto& [path, file] : record.inputs)
    json["inputs"].push_back(Json::array({path, file.hash, file.state}));
  for (const auto& [path, file] : record.outputs)
    json["outputs"].push_back(Json::array({path, file.hash, file.state}));
  for (const auto& [query, answer] : record.query_results) {
    json["answers"].push_back(Json::array({query.first, query.second, answer}));
  }
  const std::string text = json.with_texts(escape_bytes).dump();
  const fs::path path = record_path(asset);
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  const fs::path written = path.string() + ".tmp-" + std::to_string(os::process_id());
  std::ofstream out(written, std::ios::binary | std::ios::trunc);
  out << content_hash(text) << "\n" << text;
  out.close();
  if (!out || !os::replace(written, path)) fs::remove(written, error);
}

std::string BakeCache::current_hash(const std::string& path) {
  bool proves_unchanged = false;
  const std::string state = state_of(path, proves_unchanged);
  if (state.empty()) return kMissingFile;
  {
    const std::lock_guard lock(mutex_);
    const auto cached_hash = hashes_.find(path);
    if (proves_unchanged && cached_hash != hashes_.end() && cached_hash->second.first == state)
      return cached_hash->second.second;
  }
  const std::string hash = identify(path);
  const std::lock_guard lock(mutex_);
  if (proves_unchanged) hashes_[path] = {state, hash};
  return hash;
}

bool BakeCache::is_file_unchanged(const std::string& path, File& file, bool& renewed,
                                  bool is_output) {
  bool proves_unchanged = false;
  const std::string name = absolute_path(path).string();
  const std::string state = state_of(name, proves_unchanged);
  if (state.empty()) return file.hash == kMissingFile;
  if (!file.state.empty() && file.state == state) return true;
  if ((is_output ? identify(name) : current_hash(name)) != file.hash) return false;
  // The file has a new time but the same contents, so the record gets its new state.
  const std::string new_state = proves_unchanged ? state : "";
  renewed = renewed || new_state != file.state;
  file.state = new_state;
  return true;
}

std::string BakeCache::describe_input_change(Record& record, bool& renewed) {
  for (auto& [path, file] : record.inputs) {
    if (is_file_unchanged(path, file, renewed, false)) continue;
    std::error_code error;
    return path + (fs::exists(absolute_path(path), error) ? " changed" : " is gone");
  }
  for (const std::string& path : record.missing_files) {
    std::error_code error;
    if (fs::is_regular_file(absolute_path(path), error)) return path + " is new";
  }
  for (const auto& [query, answer] : record.query_results) {
    if (current_answer(absolute_path(query.first), query.second) != answer) {
      return query.first + " has other files (" + query.second + ")";
    }
  }
  return {};
}

std::string BakeCache::describe_output_change(Record& record, bool& renewed) {
  for (auto& [path, file] : record.outputs) {
    std::error_code error;
    if (!fs::exists(absolute_path(path), error)) return path + " is gone";
    if (!is_file_unchanged(path, file, renewed, true))
      return path + " changed after it was written";
  }
  return {};
}

std::string BakeCache::dependency_list_text(const Record& record) {
  Json json = Json::array();
  std::map<std::string, std::string> files;
  for (const auto& [path, file] : record.inputs) files[path] = file.hash;
  json.push_back(pairs_json(files));
  json.push_back(record.missing_files);
  for (const auto& [query, answer] : record.query_results)
    json.push_back(Json::array({query.first, query.second, answer}));
  return json.with_texts(escape_bytes).dump();
}

namespace {

/// Names the options that differ between two jobs.
std::string changed_options(const Json& former, const Json& now) {
  std::string list;
  const auto add = [&](const std::string& text) { list += (list.empty() ? "" : ", ") + text; };
  for (const std::string& key : now.keys()) {
    const Json& former_value = former.at(key);
    if (former_value.dump() == now.at(key).dump()) continue;
    add(former_value.is_null() ? key + " is new"
                               : key + " changed from " + format_as_word(former_value) + " to " +
                                     format_as_word(now.at(key)));
  }
  for (const std::string& key : former.keys()) {
    if (now.at(key).is_null()) add(key + " is gone");
  }
  return list.empty() ? "Kiln or the device changed" : list;
}

}  // namespace

bool BakeCache::find_entry(const std::string& key, CacheDecision& decision) {
  if (store_ == nullptr) return false;
  const std::optional<std::string> text = store_->get("lists/" + key);
  if (!text) return false;
  const Json lists = Json::parse(*text);
  for (const Json& list : lists.elements()) {
    Record record;
    const Json& inputs = list.at("inputs");
    bool is_valid = inputs.is_array() && list.at("entry").is_string();
    for (const Json& file : inputs.elements()) {
      is_valid = is_valid && is_texts(file, 2);
      if (is_valid) record.inputs[unescape_bytes(file[0].text())] = {file[1].text(), ""};
    }
    for (const Json& path : list.at("absent").elements())
      record.missing_files.push_back(unescape_bytes(path.text()));
    for (const Json& answer : list.at("answers").elements()) {
      is_valid = is_valid && is_texts(answer, 3);
      if (is_valid) {
        record.query_results[{unescape_bytes(answer[0].text()), unescape_bytes(answer[1].text())}] =
            unescape_bytes(answer[2].text());
      }
    }
    bool renewed = false;
    if (!is_valid || !describe_input_change(record, renewed).empty()) continue;
    decision.entry = list.at("entry").text();
    decision.kind = CacheDecision::Kind::restored;
    return true;
  }
  return false;
}

CacheDecision BakeCache::decide(const BatchAsset& asset) {
  CacheDecision decision;
  if (includes_files(asset.job)) {
    decision.reason = "a user-defined map includes files, whose changes cannot be tracked";
    return decision;
  }
  const Json options = portable_options(asset);
  const std::string key = key_of(options);
  std::optional<Record> record = load(asset);
  bool renewed = false;
  if (!record) {
    decision.reason = "no earlier bake is recorded";
  } else if (record->key != key) {
    decision.reason = changed_options(record->options, options);
  } else {
    decision.reason = describe_input_change(*record, renewed);
    if (decision.reason.empty()) {
      decision.reason = describe_output_change(*record, renewed);
      if (decision.reason.empty()) {
        decision.kind = CacheDecision::Kind::unchanged;
        decision.warnings = record->warnings;
        decision.missed = record->missed;
        for (const std::string& file : record->files)
          decision.files.push_back(given_path(file).string());
        if (renewed) save(asset, *record);
        return decision;
      }
    }
  }
  find_entry(key, decision);
  return decision;
}

std::string BakeCache::store_result(const BatchAsset& asset, const InputLog::Inputs& inputs,
                                    const std::vector<PendingOutput>& outputs,
                                    const std::vector<std::string>& files, const Json& warnings,
                                    double missed) {
  if (includes_files(asset.job)) return {};
  Record record;
  record.options = portable_options(asset);
  record.key = key_of(record.options);
  record.warnings = warnings;
  record.missed = missed;
  for (const std::string& file : files) record.files.push_back(relative(file));
  std::map<std::string, std::string> written;
  for (const PendingOutput& output : outputs)
    written[relative(output.destination)] = output.bytes.string();
  for (const auto& [path, hash] : inputs.files) {
    // Outputs of the bake are not inputs, even if the bake has read them to check whether they may be replaced.
    if (written.count(relative(path)) != 0) continue;
    if (identify(path) != hash) return relative(path) + " changed while it was baked";
    record.inputs[relative(path)] = {hash, ""};
  }
  for (const std::string& path : inputs.missing_files) {
    std::error_code error;
    if (written.count(relative(path)) != 0 || record.inputs.count(relative(path)) != 0) continue;
    if (fs::is_regular_file(path, error)) return relative(path) + " appeared while it was baked";
    record.missing_files.push_back(relative(path));
  }
  for (const auto& [query, answer] : inputs.answers) {
    if (current_answer(query.first, query.second) != answer)
      return query.first + " changed while it was baked";
    record.query_results[{relative(query.first), query.second}] = answer;
  }
  // An entry is a JSON header, followed by the bytes of all files.
  Json header = {{"files", Json::array()},
                 {"outputs", record.files},
                 {"warnings", warnings},
                 {"missed", missed}};
  std::string bytes;
  for (const auto& [path, from] : written) {
    std::ifstream in(from, std::ios::binary);
    const std::string content(std::istreambuf_iterator<char>(in), {});
    if (!in) return path + " could not be read again";
    header["files"].push_back({{"path", path}, {"bytes", content.size()}});
    record.outputs[path] = {content_hash(content), ""};
    if (store_ != nullptr) bytes += content;
  }
  record.entry = content_hash(record.key + dependency_list_text(record));
  if (store_ != nullptr) {
    const std::string text = header.with_texts(escape_bytes).dump();
    if (store_->put("entries/" + record.entry, std::to_string(text.size()) + "\n" + text + bytes)) {
      Json lists = Json::array();
      Json list = {{"entry", record.entry},
                   {"inputs", Json::array()},
                   {"absent", record.missing_files},
                   {"answers", Json::array()}};
      for (const auto& [path, file] : record.inputs)
        list["inputs"].push_back(Json::array({path, file.hash}));
      for (const auto& [query, answer] : record.query_results)
        list["answers"].push_back(Json::array({query.first, query.second, answer}));
      lists.push_back(list.with_texts(escape_bytes));
      if (const auto former_lists = store_->get("lists/" + record.key)) {
        const Json other_lists = Json::parse(*former_lists);
        for (const Json& other : other_lists.elements()) {
          if (lists.size() < kMaxListsPerKey && other.at("entry").text() != record.entry)
            lists.push_back(other);
        }
      }
      store_->put("lists/" + record.key, lists.dump());
    }
  }
  const std::lock_guard lock(mutex_);
  pending_records_[asset.name] = std::move(record);
  return {};
}

void BakeCache::record_outputs(const BatchAsset& asset, bool rehash) {
  Record record;
  {
    const std::lock_guard lock(mutex_);
    const auto kept_record = pending_records_.find(asset.name);
    if (kept_record == pending_records_.end()) {
      // The state of the current outputs is unknown, so the former record is removed.
      std::error_code error;
      fs::remove(record_path(asset), error);
      return;
    }
    record = std::move(kept_record->second);
    pending_records_.erase(kept_record);
  }
  for (auto& [path, file] : record.outputs) {
    if (rehash) file.hash = identify(absolute_path(path));
  }
  save(asset, record);
}

bool BakeCache::restore(const BatchAsset& asset, CacheDecision& decision) {
  const std::optional<std::string> entry = store_->get("entries/" + decision.entry);
  if (!entry) return false;
  const std::size_t line = entry->find('\n');
  std::size_t size = 0;
  double number = 0;
  if (line == std::string::npos || !read_number(std::string_view(*entry).substr(0, line), number))
    return false;
  // Converting a negative, infinite or NaN number to an integer is undefined behaviour.
  const auto fits_in_entry = [&](double bytes, std::size_t first) {
    return bytes >= 0 && bytes <= static_cast<double>(entry->size() - first);
  };
  if (!fits_in_entry(number, line + 1)) return false;
  size = static_cast<std::size_t>(number);
  const Json header = Json::parse(std::string_view(*entry).substr(line + 1, size));
  if (!header.is_object()) return false;
  const fs::path out = os::absolute_normal(out_folder(asset.job));
  const auto is_own_output = [&](const fs::path& file) {
    const fs::path folder = file.parent_path();
    if (folder == out || folder / "" == out) return true;
    for (const std::string* const output :
         {&asset.job.json, &asset.job.save_match, &asset.job.save_cage, &asset.job.save_source}) {
      if (!output->empty() && folder == os::absolute_normal(*output).parent_path()) return true;
    }
    return false;
  };
  std::size_t file_offset = line + 1 + size;
  std::vector<std::pair<fs::path, std::string_view>> files;
  Record record;
  for (const Json& file : header.at("files").elements()) {
    const std::string path = unescape_bytes(file.at("path").text());
    if (!fits_in_entry(file.at("bytes").number(), file_offset)) return false;
    const auto bytes = static_cast<std::size_t>(file.at("bytes").number());
    const fs::path name = os::normal(absolute_path(path));
    // A shared cache is not trusted: its entries may only write files in the asset's output folders.
    if (!is_own_output(name)) return false;
    files.emplace_back(name, std::string_view(*entry).substr(file_offset, bytes));
    record.outputs[path] = {content_hash(files.back().second), ""};
    file_offset += bytes;
  }
  const bool checks_record = asset_file(asset.job).empty() && !asset.job.force;
  if (checks_record) check_folder_holds_same_low(out, low_stem(asset.job), low_source(asset.job));
  for (const auto& [path, bytes] : files) {
    if (lower_extension(path) == ".obj" || lower_extension(path) == ".mtl")
      check_obj_is_replaceable(path, asset.job.force);
    prepare_output_folder(path.parent_path());
  }
  for (const auto& [path, bytes] : files) {
    AtomicFile file(path);
    file.write(bytes);
    file.commit();
  }
  decision.warnings = header.at("warnings");
  decision.missed = header.at("missed").number();
  for (const Json& path : header.at("outputs").elements()) {
    record.files.push_back(unescape_bytes(path.text()));
    decision.files.push_back(given_path(record.files.back()).string());
  }
  // The new record gets the list of dependencies that led to the entry.
  record.options = portable_options(asset);
  record.key = key_of(record.options);
  record.entry = decision.entry;
  record.warnings = decision.warnings;
  record.missed = decision.missed;
  const auto text = store_->get("lists/" + record.key);
  if (!text) return true;
  const Json lists = Json::parse(*text);
  for (const Json& list : lists.elements()) {
    if (list.at("entry").text() != decision.entry) continue;
    for (const Json& file : list.at("inputs").elements()) {
      record.inputs[unescape_bytes(file[0].text())] = {file[1].text(), ""};
    }
    for (const Json& path : list.at("absent").elements())
      record.missing_files.push_back(unescape_bytes(path.text()));
    for (const Json& answer : list.at("answers").elements()) {
      record.query_results[{unescape_bytes(answer[0].text()), unescape_bytes(answer[1].text())}] =
          unescape_bytes(answer[2].text());
    }
    const std::lock_guard lock(mutex_);
    pending_records_[asset.name] = std::move(record);
    break;
  }
  return true;
}

std::string BakeCache::derived_data_key(const BatchAsset& asset,
                                        const std::vector<std::string>& files,
                                        std::string_view what) const {
  ContentHash hash;
  hash.add(what);
  hash.add(std::string_view(key_of(portable_options(asset))));
  std::vector<std::string> inputs = high_files(asset.job);
  const std::vector<std::string> low = low_files(asset.job);
  inputs.insert(inputs.end(), low.begin(), low.end());
  inputs.insert(inputs.end(), files.begin(), files.end());
  for (const std::string& file : inputs) {
    hash.add(std::string_view(relative(file)));
    hash.add(std::string_view(identify(file)));
  }
  return hash.text();
}

std::optional<std::string> BakeCache::get_derived_data(const std::string& key) {
  return store_ == nullptr ? std::nullopt : store_->get("entries/" + key);
}

void BakeCache::put_derived_data(const std::string& key, std::string_view text) {
  if (store_ != nullptr) store_->put("entries/" + key, text);
}

std::vector<std::string> BakeCache::inputs_of(const BatchAsset& asset) {
  std::vector<std::string> inputs;
  if (const std::optional<Record> record = load(asset)) {
    for (const auto& [path, file] : record->inputs) inputs.push_back(absolute_path(path).string());
  }
  return inputs;
}

}  // namespace kiln
