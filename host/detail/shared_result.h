// Results that several maps of a bake share.
#pragma once

#include <memory>
#include <vector>

namespace kiln {

/// A result that several maps of a bake use. The first map that needs it computes it; the others
/// reuse it while it is valid.
class SharedWork {
 public:
  SharedWork() = default;
  SharedWork(const SharedWork&) = delete;
  SharedWork& operator=(const SharedWork&) = delete;
  virtual ~SharedWork() = default;
  /// Invalidates results that depend on the last band or match.
  virtual void next_band() = 0;
  /// Invalidates results that depend on the high poly, too.
  virtual void next_source() { next_band(); }
};

/// The shared results of one bake: at most one object of each type.
class SharedWorks {
 public:
  /// Returns the object of a type, which the first call constructs from the arguments.
  template <typename Work, typename... Arguments>
  std::shared_ptr<Work> of(const Arguments&... arguments) {
    for (const std::shared_ptr<SharedWork>& work : works_) {
      if (auto work_of_type = std::dynamic_pointer_cast<Work>(work)) return work_of_type;
    }
    auto work_of_type = std::make_shared<Work>(arguments...);
    works_.push_back(work_of_type);
    return work_of_type;
  }
  /// Adds an existing object.
  void add(std::shared_ptr<SharedWork> work) { works_.push_back(std::move(work)); }
  void next_band() {
    for (const std::shared_ptr<SharedWork>& work : works_) work->next_band();
  }
  void next_source() {
    for (const std::shared_ptr<SharedWork>& work : works_) work->next_source();
  }

 private:
  std::vector<std::shared_ptr<SharedWork>> works_;
};

}  // namespace kiln
