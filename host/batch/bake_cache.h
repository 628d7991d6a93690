// Nothing is baked twice: what a result depends on, and whether that is as it was.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/input_log.h"
#include "batch/assets.h"
#include "batch/cache_store.h"
#include "io/file/output_set.h"
#include "kiln/device.h"
#include "options/json.h"

namespace kiln {

/// What is to be done for an asset.
struct CacheDecision {
  enum class Kind : unsigned char {
    unchanged,  ///< Inputs, options and outputs are as they were
    restored,   ///< Its outputs are in the cache
    bake,
  };
  Kind kind = Kind::bake;
  std::string reason;              ///< Why it is not unchanged: "albedo.png changed"
  std::vector<std::string> files;  ///< Outputs, unless it is to be baked
  Json warnings = Json::array();
  double missed = 0;  ///< Share of samples that were missed
  std::string entry;  ///< Of the cache, where it is restored
};

/// Records of what each asset was made of, and a store of results.
///
/// A result is found by two keys, as compilers' caches do it. The first is of options, of this program and of the
/// device's class; below it stands a list of what was read when it was baked: files with hashes, files that were looked
/// for and not there, answers of folders. Where all of one list is as it was, its second key, of the first and the
/// list, names the entry. A record says the same for an asset's last bake, with the state of its outputs.
///
/// A file whose size, times and number are those of the record is not read again, unless it was changed within the two
/// seconds before the record was written: clocks of file systems are coarse. Any thread.
class BakeCache {
 public:
  /// \param folder   of the job file: paths below it are kept relative to it
  /// \param records  folder of the records
  /// \param store    null: records alone
  BakeCache(std::filesystem::path folder, std::filesystem::path records,
            std::unique_ptr<CacheStore> store);

  /// Device class of keys: devices of one class give the same bytes.
  void set_device(const DeviceInfo& info);

  /// What is to be done. Nothing is written but records of what was hashed again.
  CacheDecision decide(const BatchAsset& asset);
  /// Writes the outputs of a decision as files of the open OutputSet. \returns false where the entry is gone or damaged
  bool restore(const BatchAsset& asset, CacheDecision& decision);
  /// An identity of a file's contents, for InputLog.
  static std::string identify(const std::filesystem::path& path);

  /// Keeps a result, before its outputs are placed: their bytes come from where they wait.
  /// \param report  JSON of the bake
  /// \returns what changed while it was baked, so that nothing is kept; empty: nothing
  std::string keep(const BatchAsset& asset, const InputLog::Inputs& inputs,
                   const std::vector<HeldOutput>& outputs, const std::vector<std::string>& files,
                   const Json& warnings, double missed);
  /// Notes the outputs of an asset as they are now, after they were placed. \param read  true: bytes are read again, since
  /// a hook may have changed them
  void note_outputs(const BatchAsset& asset, bool read);

  /// A key of something that is made from an asset's inputs and outputs, such as its pictures: of options, this program,
  /// the contents of its meshes and of `files`, and what it is.
  std::string beside_key(const BatchAsset& asset, const std::vector<std::string>& files,
                         std::string_view what) const;
  /// What was kept by such a key; none: nothing.
  std::optional<std::string> get_beside(const std::string& key);
  void put_beside(const std::string& key, std::string_view text);

  /// Inputs of an asset's record, absolute; none where there is none.
  std::vector<std::string> inputs_of(const BatchAsset& asset);

 private:
  struct File {
    std::string hash, state;  ///< State: size, times and number, or empty where they prove nothing
  };
  struct Record {
    std::string key;
    Json options;
    std::map<std::string, File> inputs, outputs;
    std::vector<std::string> absent;
    std::map<std::pair<std::string, std::string>, std::string> answers;
    std::string entry;
    std::vector<std::string> files;
    Json warnings = Json::array();
    double missed = 0;
  };

  std::string relative(const std::filesystem::path& path) const;
  std::filesystem::path whole(const std::string& path) const;
  Json options_of(const BatchAsset& asset) const;
  std::string key_of(const Json& options) const;
  std::filesystem::path record_path(const BatchAsset& asset) const;
  std::optional<Record> load(const BatchAsset& asset) const;
  void save(const BatchAsset& asset, const Record& record) const;
  /// Why inputs are not as a record has them; empty: they are. \param renewed  out: true if something was hashed again
  std::string why_changed(Record& record, bool& renewed);
  std::string why_outputs_changed(Record& record, bool& renewed);
  bool is_same(const std::string& path, File& file, bool& renewed, bool output);
  std::string hash_now(const std::string& path);
  static std::string list_text(const Record& record);
  bool find_entry(const std::string& key, CacheDecision& decision);

  std::filesystem::path folder_, records_;
  std::unique_ptr<CacheStore> store_;
  std::string program_, device_class_;
  std::mutex mutex_;
  std::map<std::string, std::pair<std::string, std::string>>
      hashes_;                          ///< By path: state and hash, of this run
  std::map<std::string, Record> kept_;  ///< Until their outputs are placed
};

}  // namespace kiln
