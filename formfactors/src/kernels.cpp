// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>

#include "item_buffer.hpp"
#include "pair_kernels.hpp"

namespace radiosity {

#ifdef __x86_64__
#define RADIOSITY_OF_LEVELS(f) f(kernel_x86_64) f(kernel_x86_64_v3) f(kernel_x86_64_v4)
#else
#define RADIOSITY_OF_LEVELS(f) f(kernel_any)
#endif

#define RADIOSITY_DECLARE(level)                       \
  namespace level {                                    \
  extern const PairKernels pair_kernels;               \
  extern const item_buffer::Kernel item_buffer_kernel; \
  }
RADIOSITY_OF_LEVELS(RADIOSITY_DECLARE)

namespace {

// Of them this processor can run so many.
std::size_t levels() {
#ifdef __x86_64__
  return __builtin_cpu_supports("x86-64-v4") ? 3 : __builtin_cpu_supports("x86-64-v3") ? 2 : 1;
#else
  return 1;
#endif
}

}  // namespace

#define RADIOSITY_PAIR_KERNELS(level) level::pair_kernels,
#define RADIOSITY_ITEM_BUFFER_KERNEL(level) level::item_buffer_kernel,

std::span<const PairKernels> pair_kernels() {
  static const std::array all{RADIOSITY_OF_LEVELS(RADIOSITY_PAIR_KERNELS)};
  return std::span(all).first(levels());
}

const PairKernels& pair_kernel() {
  static const PairKernels& fastest = pair_kernels().back();
  return fastest;
}

std::span<const item_buffer::Kernel> item_buffer::kernels() {
  static const std::array all{RADIOSITY_OF_LEVELS(RADIOSITY_ITEM_BUFFER_KERNEL)};
  return std::span(all).first(levels());
}

}  // namespace radiosity
