// SPDX-License-Identifier: GPL-3.0-or-later
#include "row_memory.hpp"

#if __has_include(<sys/mman.h>)
#include <sys/mman.h>
#endif

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <new>

namespace radiosity {
namespace {

constexpr std::size_t kChunk = 1 << 21;  // a large page of most processors
#if !defined(MADV_HUGEPAGE) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::size_t kLargest = 0;  // each by itself, so that a sanitizer sees its ends
#else
constexpr std::size_t kLargest = kChunk / 16;  // no more of a chunk is left over at its end
#endif

struct Chunk {
  std::atomic<std::uint32_t> used = 1;  // pieces, and by the thread that cuts them
};
constexpr std::size_t kHeader = 64;
static_assert(sizeof(Chunk) <= kHeader);

#ifdef MADV_HUGEPAGE
Chunk* map_chunk() {
  // At a multiple of its size: what is before and after goes back.
  void* const all = mmap(nullptr, 2 * kChunk, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (all == MAP_FAILED) throw std::bad_alloc();
  auto* const begin = static_cast<std::byte*>(all);
  const std::size_t before = (kChunk - reinterpret_cast<std::uintptr_t>(begin) % kChunk) % kChunk;
  if (before > 0) munmap(begin, before);
  munmap(begin + before + kChunk, kChunk - before);
  madvise(begin + before, kChunk, MADV_HUGEPAGE);
  return new (begin + before) Chunk;
}
void unmap(Chunk* chunk) {
  munmap(chunk, kChunk);
}
#else
Chunk* map_chunk() {
  throw std::bad_alloc();
}
void unmap(Chunk*) {}
#endif

void release(Chunk* chunk) {
  if (chunk->used.fetch_sub(1, std::memory_order_acq_rel) == 1) unmap(chunk);
}

// Of this thread.
struct Cut {
  ~Cut() {
    if (chunk != nullptr) release(chunk);
  }
  void* next(std::size_t bytes) {
    if (chunk == nullptr || at + bytes > kChunk) {
      if (chunk != nullptr) release(chunk);
      chunk = nullptr;
      chunk = map_chunk();
      at = kHeader;
    }
    chunk->used.fetch_add(1, std::memory_order_relaxed);
    void* const piece = reinterpret_cast<std::byte*>(chunk) + at;
    at += (bytes + 15) / 16 * 16;
    return piece;
  }
  Chunk* chunk = nullptr;
  std::size_t at = 0;
};
thread_local Cut cut;

}  // namespace

void* allocate_row_bytes(std::size_t bytes) {
  return bytes > kLargest ? ::operator new(bytes) : cut.next(bytes);
}

void free_row_bytes(void* piece, std::size_t bytes) {
  if (bytes > kLargest) return ::operator delete(piece);
  const std::uintptr_t offset = reinterpret_cast<std::uintptr_t>(piece) % kChunk;
  release(reinterpret_cast<Chunk*>(static_cast<std::byte*>(piece) - offset));
}

void advise_large_pages([[maybe_unused]] void* data, [[maybe_unused]] std::size_t bytes) {
#ifdef MADV_HUGEPAGE
  constexpr std::uintptr_t kPage = kChunk;
  const auto begin = (reinterpret_cast<std::uintptr_t>(data) + kPage - 1) & ~(kPage - 1);
  const auto end = (reinterpret_cast<std::uintptr_t>(data) + bytes) & ~(kPage - 1);
  if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
#endif
}

}  // namespace radiosity
