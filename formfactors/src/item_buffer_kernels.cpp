// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>

#include "item_buffer.hpp"

namespace radiosity::item_buffer {

#ifdef __x86_64__

extern const Kernel kernel_x86_64, kernel_x86_64_v3, kernel_x86_64_v4;

std::span<const Kernel> kernels() {
  static const std::array<Kernel, 3> all{kernel_x86_64, kernel_x86_64_v3, kernel_x86_64_v4};
  static const std::size_t runs = __builtin_cpu_supports("x86-64-v4")   ? 3
                                  : __builtin_cpu_supports("x86-64-v3") ? 2
                                                                        : 1;
  return std::span(all).first(runs);
}

#else

extern const Kernel kernel_any;

std::span<const Kernel> kernels() {
  return {&kernel_any, 1};
}

#endif

}  // namespace radiosity::item_buffer
