#include "io/file/placing.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>

#include "base/file.h"
#include "kiln/error.h"
#include "kiln/files.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kHiddenPrefix = ".kiln-";
constexpr const char* kJournal = "journal";
constexpr std::uint64_t kMaxJournalBytes = std::uint64_t{1} << 24;
constexpr double kMaxLockSeconds = 300.0;  // Maximum wait for other processes that place files

std::atomic<bool> is_placing{false};
static_assert(std::atomic<bool>::is_always_lock_free);

const char* remedy_for(int error_number) {
  switch (error_number) {
    case ENOSPC:
#ifdef EDQUOT
    case EDQUOT:
#endif
      return " Free some space there, or write to another disk.";
    case EFBIG:
      return " Raise the limit on file sizes (ulimit -f), or write a smaller file.";
    case EACCES:
    case EPERM:
      return " Change its permissions, or write to another folder.";
    case EROFS:
      return " Write to a folder on a writable disk.";
    case ENOENT:
    case ENOTDIR:
      return " Create the folder first, or correct the path.";
    case EISDIR:
      return " Give a file's name instead.";
    case ENAMETOOLONG:
      return " Use a shorter name.";
    case EMFILE:
    case ENFILE:
      return " Raise the limit on open files (ulimit -n).";
    default:
      return " Check the disk, or write to another folder.";
  }
}

/// An open folder that is locked against other processes that place files in it.
class LockedFolder {
 public:
  /// \throws Error(output) if another process keeps it locked for kMaxLockSeconds
  explicit LockedFolder(const fs::path& path)
      : descriptor_(os::lock_folder(path, kMaxLockSeconds)) {
    if (descriptor_ >= 0 || errno != EWOULDBLOCK) return;
    throw Error(ErrorCode::output,
                "Could not write to '" + path.string() +
                    "': another process has held the folder's lock for five minutes. Stop it "
                    "(fuser -v '" +
                    path.string() + "' shows it), or write to another folder.");
  }
  ~LockedFolder() {
    if (descriptor_ >= 0) os::close(descriptor_);
  }
  LockedFolder(LockedFolder&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  LockedFolder(const LockedFolder&) = delete;
  /// Flushes the list of the folder's files to the medium.
  void sync() const {
    if (descriptor_ >= 0) os::sync(descriptor_);
  }

 private:
  int descriptor_;
};

bool is_journal(const fs::path& path) {
  return state_of_name(path.filename().string(), kJournal) != NameState::foreign;
}

/// True for a file name without a folder part.
bool is_plain(std::string_view name) {
  return !name.empty() && name != "." && name != ".." && name.find('/') == name.npos;
}

/// Completes the renames that a journal lists. Since the folder is locked, the process that wrote
/// the journal has ended.
void complete_journal(const fs::path& folder, const fs::path& journal) {
  const std::optional<os::FileStatus> facts = os::query_link(journal);
  // Journals of other users are ignored, since they may be forged.
  if (!facts || !facts->is_regular || !facts->is_owned_by_user || facts->bytes > kMaxJournalBytes)
    return;
  std::ifstream file(journal, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  std::vector<std::string> names;
  for (std::size_t begin = 0, end; (end = text.find('\0', begin)) != text.npos; begin = end + 1) {
    names.push_back(text.substr(begin, end - begin));
  }
  for (std::size_t i = 0; i + 2 < names.size(); i += 3) {
    const auto& [temporary, target, backup] = std::tie(names[i], names[i + 1], names[i + 2]);
    if (!temporary.starts_with(kHiddenPrefix) || !is_plain(temporary) || !is_plain(target))
      continue;
    // The rename fails if the killed process had already done it.
    if (!os::replace(folder / temporary, folder / target)) errno = 0;
    if (backup.starts_with(kHiddenPrefix) && is_plain(backup)) {
      os::remove_file((folder / backup).c_str());
    }
  }
  os::remove_file(journal.c_str());
}

/// Removes what killed processes left without a journal: links to old files, which are only created
/// while the folder is locked, and unfinished files. A process that cannot be queried, since it is
/// on another machine or in a container, counts as ended if its file has not changed for a week.
void remove_leftovers(const fs::path& path) {
  constexpr std::int64_t kWeekSeconds = std::int64_t{7} * 24 * 3600;
  const std::optional<os::FileStatus> facts = os::query_link(path);
  if (!facts || !facts->is_regular || !facts->is_owned_by_user) return;
  const std::string name = path.filename().string();
  const NameState state = state_of_name(name, "tmp");
  const bool is_old = std::time(nullptr) - facts->modified > kWeekSeconds;
  if (state == NameState::ended || (state == NameState::unknown && is_old) ||
      state_of_name(name, "old") != NameState::foreign) {
    os::remove_file(path.c_str());
  }
}

/// Completes all journals. The folder must be locked.
void complete_journals(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> journals, other_paths;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path& path = entry->path();
    if (!path.filename().string().starts_with(kHiddenPrefix)) continue;
    (is_journal(path) ? journals : other_paths).push_back(path);
  }
  for (const fs::path& journal : journals) complete_journal(folder, journal);
  for (const fs::path& path : other_paths) remove_leftovers(path);
}

/// A transaction of several renames, which can be undone.
class Placement {
 public:
  explicit Placement(std::vector<PendingFile>& files) : files_(files), backups_(files.size()) {
    for (PendingFile& file : files) {
      const fs::path folder = canonical_folder(file.target.parent_path());
      file.target = folder / file.target.filename();
    }
    // All memory is reserved before files are created, so that no allocation can fail between two
    // steps.
    journals_.reserve(folders_.size());
    new_files_.reserve(files.size());
  }
  /// After an exception, removes the links to old files and the journals. At that point no file was
  /// renamed, or all were restored.
  ~Placement() { undo(); }
  Placement(const Placement&) = delete;
  Placement& operator=(const Placement&) = delete;

  void run() {
    for (const PendingFile& file : files_) file.sync();
    for (const fs::path& folder : folders_) locks_.emplace_back(folder);
    for (const fs::path& folder : folders_) complete_journals(folder);
    for (PendingFile& file : files_) file.name();
    link_old_files();
    for (const fs::path& folder : folders_) write_journal(folder);
    is_placing = true;
    rename_all();
    drop_backups();
    is_placing = false;
    for (const LockedFolder& lock : locks_) lock.sync();
  }

 private:
  /// The first path of a folder stands for all of its paths. Links and mounts may give a folder
  /// several, and locking it twice would deadlock.
  fs::path canonical_folder(const fs::path& path) {
    const std::optional<os::FileStatus> facts = os::query_file(path);
    for (const fs::path& folder : folders_) {
      const auto known = os::query_file(folder);
      if (folder == path || (facts && known && facts->id == known->id)) return folder;
    }
    folders_.push_back(path);
    return path;
  }

  /// Keeps old files as hard links. On file systems without hard links, old files cannot be
  /// restored.
  void link_old_files() {
    for (std::size_t i = 0; i < files_.size(); ++i) {
      TemporaryName name(files_[i].target.parent_path(), "old");
      if (os::add_hard_link(files_[i].target, name.path())) {
        backups_[i] = std::move(name);
      } else if (errno == ENOENT) {
        new_files_.push_back(i);
      }
    }
  }

  void write_journal(const fs::path& folder) {
    std::string text;
    for (std::size_t i = 0; i < files_.size(); ++i) {
      if (files_[i].target.parent_path() != folder) continue;
      text += files_[i].temporary.path().filename().string() + '\0';
      text += files_[i].target.filename().string() + '\0';
      text += backups_[i].path().filename().string() + '\0';
    }
    TemporaryName journal(folder, kJournal);
    TemporaryName temporary_journal(folder);
    const int file = os::create_file(temporary_journal.path(), 0600);
    bool good = file >= 0;
    if (good) {
      good = os::write_some(file, text.data(), text.size()) ==
                 static_cast<std::ptrdiff_t>(text.size()) &&
             os::sync(file);
      os::close(file);
    }
    if (!good || !os::replace(temporary_journal.path(), journal.path())) {
      const int saved_error = errno;
      os::remove_file(temporary_journal.path().c_str());
      fail_to_write(files_.front().destination, "", saved_error);
    }
    journals_.push_back(std::move(journal));
  }

  void rename_all() {
    for (std::size_t i = 0; i < files_.size(); ++i) {
      if (os::replace(files_[i].temporary.path(), files_[i].target)) continue;
      const int saved_error = errno;
      for (std::size_t k = i; k-- > 0;) restore_old_files(k);
      is_placing = false;
      fail_to_write(files_[i].destination, "", saved_error);
    }
  }

  void restore_old_files(std::size_t i) {
    const fs::path& target = files_[i].target;
    if (!backups_[i].empty()) {
      if (os::replace(backups_[i].path(), target)) backups_[i].release();
    } else if (std::find(new_files_.begin(), new_files_.end(), i) != new_files_.end()) {
      os::remove_file(target.c_str());
    }
  }

  /// After all files were placed, removes the links to old files and the journals.
  void drop_backups() {
    for (PendingFile& file : files_) file.temporary.release();
    undo();
  }

  void undo() noexcept {
    for (std::vector<TemporaryName>* names : {&journals_, &backups_}) {
      for (TemporaryName& name : *names) {
        if (!name.empty()) os::remove_file(name.path().c_str());
        name.release();
      }
    }
  }

  std::vector<PendingFile>& files_;
  std::vector<TemporaryName> backups_, journals_;
  std::vector<std::size_t> new_files_;  ///< Indices of the files that did not replace an old one
  std::vector<fs::path> folders_;
  std::vector<LockedFolder> locks_;
};

}  // namespace

PendingFile::~PendingFile() { discard(); }

PendingFile::PendingFile(PendingFile&& other) noexcept
    : destination(std::move(other.destination)),
      target(std::move(other.target)),
      temporary(std::move(other.temporary)),
      descriptor(std::exchange(other.descriptor, -1)),
      run(other.run) {}

PendingFile& PendingFile::operator=(PendingFile&& other) noexcept {
  if (this != &other) {
    discard();
    destination = std::move(other.destination);
    target = std::move(other.target);
    temporary = std::move(other.temporary);
    descriptor = std::exchange(other.descriptor, -1);
    run = other.run;
  }
  return *this;
}

void PendingFile::sync() const {
  const int opened = descriptor >= 0 ? -1 : os::open_to_read(temporary.path());
  const int file = descriptor >= 0 ? descriptor : opened;
  const bool good = file >= 0 && os::sync(file);
  const int saved_error = errno;
  if (opened >= 0) os::close(opened);
  // Some file systems do not support flushing a folder, and report EINVAL or ENOTSUP.
  if (!good && saved_error != EINVAL && saved_error != ENOTSUP)
    fail_to_write(destination, "", saved_error);
}

void PendingFile::name() {
  if (!temporary.empty()) return;
  for (int attempt = 0;; ++attempt) {
    TemporaryName name(target.parent_path());
    if (os::link_unnamed_file(descriptor, name.path())) {
      temporary = std::move(name);
      os::close(std::exchange(descriptor, -1));
      return;
    }
    if (errno != EEXIST || attempt == kNameAttempts) fail_to_write(destination, "", errno);
  }
}

void PendingFile::discard() noexcept {
  if (descriptor >= 0) os::close(std::exchange(descriptor, -1));
  if (!temporary.empty()) os::remove_file(temporary.path().c_str());
  temporary.release();
}

void place_files(std::vector<PendingFile>& files) {
  if (files.empty()) return;
  if (files.size() > 1) {
    Placement(files).run();
    return;
  }
  PendingFile& file = files.front();
  file.sync();
  const LockedFolder folder(file.target.parent_path());
  // Completes the journals before the rename: completed later, one of them might replace this file
  // by an older one
  complete_journals(file.target.parent_path());
  file.name();
  if (!os::replace(file.temporary.path(), file.target)) {
    fail_to_write(file.destination, "", errno);
  }
  file.temporary.release();
  folder.sync();
}

void finish_interrupted(const fs::path& folder) noexcept {
  try {
    std::error_code error;
    bool any = false;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
      any = any || is_journal(entry->path());
    }
    if (!any) return;
    const LockedFolder lock(folder);
    complete_journals(folder);
    lock.sync();
  } catch (...) {
    // The journal does not fit in memory. The next process that writes to the folder will complete
    // the journal.
    return;
  }
}

void fail_to_write(const fs::path& destination, std::string_view what, int error_number) {
  std::string message = "Could not write '" + destination.string() + "'";
  if (!what.empty()) message += ": " + std::string(what);
  if (error_number != 0) {
    const std::string reason = std::generic_category().message(error_number);
    message += what.empty() ? ": " + reason : " (" + reason + ")";
  } else if (what.empty()) {
    message += ": the disk reported an error";
  }
  message += ".";
  if (error_number != 0 || what.empty()) message += remedy_for(error_number);
  throw Error(ErrorCode::output, message);
}

bool is_committing_outputs() noexcept { return is_placing.load(); }

}  // namespace kiln
