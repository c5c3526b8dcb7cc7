// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>

#include "item_buffer.hpp"
#include "pair_kernels.hpp"

namespace radiosity {

#ifdef __x86_64__

#define RADIOSITY_OF_LEVELS(name) kernel_x86_64::name, kernel_x86_64_v3::name, kernel_x86_64_v4::name
namespace kernel_x86_64 {
extern const PairKernels pair_kernels;
extern const item_buffer::Kernel item_buffer_kernel;
}  // namespace kernel_x86_64
namespace kernel_x86_64_v3 {
extern const PairKernels pair_kernels;
extern const item_buffer::Kernel item_buffer_kernel;
}  // namespace kernel_x86_64_v3
namespace kernel_x86_64_v4 {
extern const PairKernels pair_kernels;
extern const item_buffer::Kernel item_buffer_kernel;
}  // namespace kernel_x86_64_v4

namespace {
std::size_t levels() {
  return __builtin_cpu_supports("x86-64-v4") ? 3 : __builtin_cpu_supports("x86-64-v3") ? 2 : 1;
}
}  // namespace

#else

#define RADIOSITY_OF_LEVELS(name) kernel_any::name
namespace kernel_any {
extern const PairKernels pair_kernels;
extern const item_buffer::Kernel item_buffer_kernel;
}  // namespace kernel_any

namespace {
std::size_t levels() {
  return 1;
}
}  // namespace

#endif

std::span<const PairKernels> pair_kernels() {
  static const std::array all{RADIOSITY_OF_LEVELS(pair_kernels)};
  return std::span(all).first(levels());
}

const PairKernels& pair_kernel() {
  static const PairKernels& fastest = pair_kernels().back();
  return fastest;
}

std::span<const item_buffer::Kernel> item_buffer::kernels() {
  static const std::array all{RADIOSITY_OF_LEVELS(item_buffer_kernel)};
  return std::span(all).first(levels());
}

}  // namespace radiosity
