// Results that several maps of a bake share.
#pragma once

#include <memory>
#include <vector>

namespace kiln {

/// Work done for the first map that asks, and kept for as long as it is true.
class SharedWork {
 public:
  SharedWork() = default;
  SharedWork(const SharedWork&) = delete;
  SharedWork& operator=(const SharedWork&) = delete;
  virtual ~SharedWork() = default;
  /// Another band follows, or another match of it: what is known of the last one is gone.
  virtual void next_band() = 0;
  /// The high poly changed, too.
  virtual void next_source() { next_band(); }
};

/// The shared work of one bake: one of each type.
class SharedWorks {
 public:
  /// The one of a type; made of the arguments where it is missing.
  template <typename Work, typename... Arguments>
  std::shared_ptr<Work> of(const Arguments&... arguments) {
    for (const std::shared_ptr<SharedWork>& work : works_) {
      if (auto made = std::dynamic_pointer_cast<Work>(work)) return made;
    }
    auto made = std::make_shared<Work>(arguments...);
    works_.push_back(made);
    return made;
  }
  /// One that is made already.
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
