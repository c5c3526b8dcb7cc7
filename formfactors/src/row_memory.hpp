// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

namespace radiosity {

void* allocate_row_bytes(std::size_t bytes);
void free_row_bytes(void* piece, std::size_t bytes);

/// Memory for rows while F is assembled: 10⁵ pieces of some kB, made in the order of the rows and freed in it. Each thread cuts them one
/// after the other from chunks of large pages, where the system has them: a transposition writes to all rows at once, and faults of small
/// pages took a fifth of an assembly. A chunk goes back to the system when the last piece of it is freed, by whatever thread: a row
/// that grows leaves holes, so its size is reserved.
template <class T>
struct RowMemory {
  using value_type = T;
  RowMemory() = default;
  template <class U>
  explicit RowMemory(const RowMemory<U>&) {}
  T* allocate(std::size_t count) { return static_cast<T*>(allocate_row_bytes(count * sizeof(T))); }
  void deallocate(T* piece, std::size_t count) { free_row_bytes(piece, count * sizeof(T)); }
  friend bool operator==(const RowMemory&, const RowMemory&) { return true; }
};

/// Asks for large pages, where the system has them, for what is not touched yet.
void advise_large_pages(void* data, std::size_t bytes);

}  // namespace radiosity
