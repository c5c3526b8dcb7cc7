// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

namespace radiosity {

/// Values one after the other, as they lie in memory: for a process of the same program.
class Packer {
 public:
  template <class T>
  void put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  template <class T>
  void put_all(const T* values, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    put(count);
    bytes_.append(reinterpret_cast<const char*>(values), count * sizeof(T));
  }
  std::string& bytes() { return bytes_; }

 private:
  std::string bytes_;
};

/// Takes them out again. Absent where the bytes end too early, which is for good.
class Unpacker {
 public:
  explicit Unpacker(const std::string& bytes) : bytes_(bytes) {}

  template <class T>
  T take() {
    T value{};
    if (enough(1, sizeof value)) {
      std::memcpy(&value, bytes_.data() + at_, sizeof value);
      at_ += sizeof value;
    }
    return value;
  }
  template <class T>
  std::vector<T> take_all() {
    const auto count = take<std::size_t>();
    std::vector<T> values;
    if (enough(count, sizeof(T))) {
      values.resize(count);
      if (count > 0) std::memcpy(values.data(), bytes_.data() + at_, count * sizeof(T));
      at_ += count * sizeof(T);
    }
    return values;
  }
  /// Everything was there, and nothing is left.
  bool complete() const { return good_ && at_ == bytes_.size(); }
  bool good() const { return good_; }

 private:
  bool enough(std::size_t count, std::size_t size) {
    good_ = good_ && count <= (bytes_.size() - at_) / size;
    return good_;
  }

  const std::string& bytes_;
  std::size_t at_ = 0;
  bool good_ = true;
};

struct ChildLimits {
  std::uint64_t bytes;  ///< of memory in use beyond what this process uses already
  double seconds;       ///< by the clock
};

enum class ChildEnd { done, crashed, out_of_memory, out_of_time };

/// What became of work in a child process; `bytes` is complete only where `end` is `done`.
struct ChildResult {
  ChildEnd end;
  std::string bytes;
};

/// Does `work` in a child process, so that this one survives whatever it does, and returns its result. The child is
/// a copy of this process with one thread only: the work must not need the others, and may print nothing. A child that
/// does nothing is replaced by another, so that the work may begin several times. Throws IoError where there can be no
/// child.
ChildResult run_in_child(const std::function<std::string()>& work, const ChildLimits& limits);

/// Limits for reading that many bytes: 1 GB and 100 bytes for each, 10 s and 20 s for each megabyte.
ChildLimits limits_for(std::uint64_t bytes);

/// run_in_child for a library that reads a file and may not survive it. Throws IoError where it crashes or needs
/// more than limits_for the file's size.
std::string run_isolated(const std::filesystem::path& file, const std::string& library,
                         const std::function<std::string()>& work);

}  // namespace radiosity
