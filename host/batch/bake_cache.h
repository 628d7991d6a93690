// Incremental bakes: records the dependencies of each result, and detects changes of them.
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

/// Whether an asset must be baked, and why.
struct CacheDecision {
  enum class Kind : unsigned char {
    unchanged,  ///< Inputs, options and outputs have not changed
    restored,   ///< The outputs can be copied from the cache
    bake,
  };
  Kind kind = Kind::bake;
  std::string reason;  ///< Why the asset is not `unchanged`, such as "albedo.png changed"
  std::vector<std::string> files;  ///< Output files of the stored result; empty for `bake`
  Json warnings = Json::array();
  double missed = 0;  ///< Share of missed samples of the stored result
  std::string entry;  ///< Name of the cache entry, for `restored`
};

/// Records of each asset's dependencies, and a store of results.
///
/// A result is found by two keys, as in the direct mode of ccache. The first key is a hash of the options, this program
/// and the device class. It leads to lists of dependencies, one for each bake with these options: files with hashes,
/// missing files that were searched for, and the results of queries about folders (such as which UDIM tiles a folder
/// contains). If all dependencies of a list are unchanged, its second key, the hash of the first key and the list,
/// names the entry. A record stores the same for an asset's last bake, together with the state of its outputs.
///
/// A file whose size, times and inode number equal the recorded ones is not read again, unless it changed within the
/// two seconds before the record was written, because file systems have coarse clocks. Thread-safe.
class BakeCache {
 public:
  /// Creates a cache.
  /// \param folder  folder of the job file; paths below it are stored relative to it
  /// \param records  folder of the records
  /// \param store  storage of results; null: only records are kept
  BakeCache(std::filesystem::path folder, std::filesystem::path records,
            std::unique_ptr<CacheStore> store);

  /// Sets the device class, which is part of all keys. Devices of one class produce the same bytes.
  void set_device(const DeviceInfo& info);

  /// Decides whether an asset must be baked. Rewrites the asset's record only if the state of a file has changed, but
  /// not its contents.
  CacheDecision decide(const BatchAsset& asset);
  /// Writes the outputs of a cache entry to the open OutputSet. \returns false if the entry is missing or damaged
  bool restore(const BatchAsset& asset, CacheDecision& decision);
  /// Returns the hash of a file's contents, by which InputLog identifies them.
  static std::string identify(const std::filesystem::path& path);

  /// Stores a result from its temporary files, before these are moved to their destinations.
  /// \returns the name of an input that changed during the bake, in which case nothing is stored; otherwise an empty
  ///          text
  std::string store_result(const BatchAsset& asset, const InputLog::Inputs& inputs,
                           const std::vector<PendingOutput>& outputs,
                           const std::vector<std::string>& files, const Json& warnings,
                           double missed);
  /// Records the state of an asset's outputs, after they were moved to their destinations.
  /// \param rehash  true to hash the outputs again, since a hook may have changed them
  void record_outputs(const BatchAsset& asset, bool rehash);

  /// Computes the key of data that is derived from an asset's inputs and outputs, such as its pictures: a hash of the
  /// options, this program, the contents of the meshes and of `files`, and `what`, the kind of the data.
  std::string derived_data_key(const BatchAsset& asset, const std::vector<std::string>& files,
                               std::string_view what) const;
  /// Loads the data stored under a key from derived_data_key(); nullopt if there is none.
  std::optional<std::string> get_derived_data(const std::string& key);
  void put_derived_data(const std::string& key, std::string_view text);

  /// Returns the absolute paths of the inputs in an asset's record; empty if there is no record.
  std::vector<std::string> inputs_of(const BatchAsset& asset);

 private:
  struct File {
    /// Hash of the file's contents, and its state: size, times and inode number. The state is empty if an equal state
    /// would not prove that the file is unchanged
    std::string hash, state;
  };
  struct Record {
    std::string key;
    Json options;
    std::map<std::string, File> inputs, outputs;
    std::vector<std::string> missing_files;
    std::map<std::pair<std::string, std::string>, std::string> query_results;
    std::string entry;
    std::vector<std::string> files;
    Json warnings = Json::array();
    double missed = 0;
  };

  std::string relative(const std::filesystem::path& path) const;
  std::filesystem::path absolute_path(const std::string& path) const;
  /// Converts a record's path to the form that bakes report: the job file's folder as the user wrote it, followed by
  /// the relative path.
  std::filesystem::path given_path(const std::string& path) const;
  Json portable_options(const BatchAsset& asset) const;
  std::string key_of(const Json& options) const;
  std::filesystem::path record_path(const BatchAsset& asset) const;
  std::optional<Record> load(const BatchAsset& asset) const;
  void save(const BatchAsset& asset, const Record& record) const;
  /// Describes the first input that differs from a record; empty if all are equal.
  /// \param renewed  receives true if the record has got the new state of a file whose contents are unchanged
  std::string describe_input_change(Record& record, bool& renewed);
  std::string describe_output_change(Record& record, bool& renewed);
  bool is_file_unchanged(const std::string& path, File& file, bool& renewed, bool is_output);
  std::string current_hash(const std::string& path);
  static std::string dependency_list_text(const Record& record);
  bool find_entry(const std::string& key, CacheDecision& decision);

  std::filesystem::path given_folder_, folder_, records_;
  std::unique_ptr<CacheStore> store_;
  std::string program_, device_class_;
  std::mutex mutex_;
  std::map<std::string, std::pair<std::string, std::string>>
      /// States and hashes of the files that this run has read, by path
      hashes_;
  std::map<std::string, Record>
      /// Records of results whose outputs have not been moved to their destinations yet
      pending_records_;
};

}  // namespace kiln
